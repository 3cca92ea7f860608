// Why a case has its word, in sentences with units: what happened, what fed it.

// Four digits; powers of ten where there would be many zeros.
function sized(value) {
  const far = Math.abs(value) >= 1e5 || (value !== 0 && Math.abs(value) < 1e-3);
  return far && Number.isFinite(value) ? short(value.toExponential(3).replace(/\.?0*e\+?/, "e")) : short(value);
}

const isTold = (unit) => !UNITLESS.has(unit);
const inUnit = (value, unit) => `${sized(value)}${isTold(unit) ? ` ${unit}` : ""}`;
const quantity = (name, i) => inUnit(valueOf(name, i), columns.get(name).unit);

// An input's value: what is swept, else what all cases share.
function inputOf(name, i) {
  const own = swept.find((s) => s.variable === name);
  return own ? own.value(i) : told.inputs.find((s) => s.name.split(".").pop() === name)?.value;
}

const ENDINGS = {
  amplitude: (i) => {
    const share = inputOf("amplitude_limit", i);
    const far = share === undefined ? "the limit of amplitude" : `${short(100 * share)} % of the radius (amplitude_limit)`;
    return `Tips reached ${far} at ${quantity("end_time", i)}, where the run ended.`;
  },
  nonfinite: (i) => `The motion was not finite any more at ${quantity("end_time", i)}.`,
  complementarity: (i) => `The contact problem had no solution at ${quantity("end_time", i)}.`,
};

const hasNoContact = (i) => valueOf("contacts", i) === 0 && valueOf("late_contacts", i) === 0;

function touched(i) {
  if (valueOf("certificate", i) >= 0)
    return `From ${quantity("certificate", i)} on no contact can recur, which is proved.`;
  if (hasNoContact(i)) return "No blade touched the casing.";
  const count = valueOf("late_contacts", i);
  return `In the last ${quantity("window", i)} ${count ? "blades touched the casing" : "no blade touched the casing"}`;
}

// What became of the energy, and of what is fed and lost.
function changed(i) {
  const rate = valueOf("growth_rate", i);
  const steady = Math.abs(rate) <= limits.significance * valueOf("growth_error", i);
  const size = inUnit(Math.abs(rate), columns.get("growth_rate").unit);
  if (steady) return "the amplitude neither grew nor fell clearly";
  return `the amplitude ${rate > 0 ? "grew" : "fell"} at ${size}`;
}

function budget(i) {
  const [fed, lost] = ["late_fed", "late_lost"].map((name) => valueOf(name, i));
  const unit = columns.get("late_fed").unit;
  const verb = fed < 0 ? "took out" : "put in";
  return `Rotation and friction ${verb} ${inUnit(Math.abs(fed), unit)}, damping and impacts took ${inUnit(lost, unit)}.`;
}

// How near a case came to a bound by which parts of it are left out.
function leanness(i) {
  const share = columns.get("lean_checked")?.value(i) ?? 0;
  if (!(share > 0)) return "";
  const beyond = share > 1 ? ", beyond it: its message names the part" : "";
  return `What the model leaves out reached ${sized(share)} of its bound (lean_checked)${beyond}.`;
}

// Sentences that end with the word.
function story(i, word, against) {
  const known = valueOf("certificate", i) >= 0 || hasNoContact(i);
  const during = known ? touched(i) : `${touched(i)}, and ${changed(i)}.`;
  const parts = [ENDINGS[valueOf("stop", i)]?.(i), during, known ? "" : budget(i), leanness(i)];
  const whole = [...parts, against].filter((part) => part && !part.includes("NaN")).join(" ");
  return `${whole} Hence: ${word}.`;
}
