// Axes and panels: levels of an input, their edges, and what they are called.

const UNITLESS = new Set(["1", ""]);
const MOST_PANELS = 12;
const MOST_ACROSS = 6;

const withUnit = (name, unit) =>
  name.replaceAll("_", " ") + (UNITLESS.has(unit) ? "" : `, ${unit}`);

// An SI unit as it is shown, and the factor to it; conditions and commands stay in SI.
const unitShown = (unit) => told.shown[unit] ?? [unit, 1];
const withUnitShown = (name, unit) => withUnit(name, unitShown(unit)[0]);

function cut(text, most) {
  return text.length > most ? `${text.slice(0, most - 1)}…` : text;
}

const counted = (count) => `${count} ${count === 1 ? "case" : "cases"}`;

// A list by its runs of equal numbers: "21 × 0, 0.01".
function runsOf(values, factor) {
  const runs = [];
  for (const value of values) {
    if (runs.at(-1)?.[1] === value) runs.at(-1)[0] += 1;
    else runs.push([1, value]);
  }
  return runs.map(([count, v]) => (count > 1 ? `${count} × ${levelText(v, factor)}` : levelText(v, factor))).join(", ");
}

// The text of an input's level; `factor`: from SI to the unit shown.
function levelText(value, factor = 1) {
  if (Array.isArray(value)) return runsOf(value, factor) || "none";
  return typeof value === "number" ? exact(factor * value) : String(value);
}

// Whether a refined input has a logarithmic axis; undefined for others: levels decide.
function scaleOfRefined(name) {
  const place = told.refined?.over.indexOf(name) ?? -1;
  return place < 0 ? undefined : told.refined.scale[place] === "log";
}

// Inputs that an axis may show: swept ones with several levels; else speed and gap.
const axes = (() => {
  const found = swept
    .filter((s) => s.levels.length > 1)
    .map((s) => ({
      name: s.variable,
      title: withUnitShown(s.variable, s.unit),
      factor: unitShown(s.unit)[1],
      levels: s.levels,
      level: s.level,
      numeric: s.numeric,
      log: scaleOfRefined(s.variable),
    }));
  for (const name of ["speed", "gap"]) {
    if (found.length >= 2 || found.some((axis) => axis.name === name)) continue;
    const column = columns.get(name);
    if (column && !swept.some((s) => s.variable === name && s.levels.length > 1))
      found.push({
        name,
        title: withUnitShown(name, column.unit),
        factor: unitShown(column.unit)[1],
        levels: [column.value(0)],
        level: () => 0,
        numeric: true,
      });
  }
  return found;
})();

const axisOf = (name) => axes.find((axis) => axis.name === name) ?? null;

// Logarithmic where steps are nearer to equal ratios than to equal differences.
function isLogarithmic(levels) {
  if (levels.length < 3 || levels[0] <= 0) return false;
  const spread = (values) => {
    const steps = d3.pairs(values, (a, b) => b - a);
    return d3.max(steps) / d3.min(steps);
  };
  return levels.at(-1) / levels[0] >= 8 && spread(levels) > spread(levels.map(Math.log));
}

// Position, edges and scale of an axis: numbers to scale, words one step apart.
function placed(axis) {
  if (!axis.numeric) return placedWords(axis);
  const log = axis.log ?? isLogarithmic(axis.levels);
  const to = log ? Math.log : (v) => v;
  const from = log ? Math.exp : (v) => v;
  const at = axis.levels.map(to);
  const middles = d3.pairs(at, (a, b) => (a + b) / 2);
  const first = at.length > 1 ? at[1] - at[0] : Math.abs(at[0]) / 5 || 1;
  const last = at.length > 1 ? at.at(-1) - at.at(-2) : first;
  const edges = [at[0] - first / 2, ...middles, at.at(-1) + last / 2].map(from);
  return {
    edges,
    place: (i) => axis.levels[axis.level(i)],
    scale: {
      type: log ? "log" : "linear",
      domain: [edges[0], edges.at(-1)],
      label: axis.title,
      tickFormat: (v) => levelText(v, axis.factor),
      ticks: axis.levels.length <= 8 ? axis.levels : roundTicks(edges, axis.factor, log),
    },
  };
}

// Round numbers of the unit shown; of a logarithmic axis the plot's own.
function roundTicks(edges, factor, log) {
  if (log) return undefined;
  return d3.ticks(factor * edges[0], factor * edges.at(-1), 8).map((v) => v / factor);
}

function placedWords(axis) {
  const count = axis.levels.length;
  const step = Math.ceil(count / 16);
  return {
    edges: d3.range(count + 1).map((j) => j - 0.5),
    place: (i) => axis.level(i),
    scale: {
      type: "linear",
      domain: [-0.5, count - 0.5],
      label: axis.title,
      ticks: d3.range(0, count, step),
      tickFormat: (j) => cut(levelText(axis.levels[j] ?? "", axis.factor), 18),
    },
  };
}

// Whether one of other axes decides an input's level, as of inputs that [zip] varies together.
// An axis that no two cases share, as of drawn inputs, decides nothing.
const followers = new Map();
function follows(axis, names) {
  return names.some((name) => {
    const key = `${axis.name}|${name}`;
    if (!followers.has(key)) followers.set(key, isDecided(axis, axisOf(name)));
    return followers.get(key);
  });
}

function isDecided(axis, other) {
  const seen = new Map();
  if (!other || other === axis) return false;
  for (const i of CASES) {
    const at = other.level(i);
    if (!seen.has(at)) seen.set(at, axis.level(i));
    if (seen.get(at) !== axis.level(i)) return false;
  }
  return seen.size < CASES.length;
}

// The first choice of axes: speed across, numbers before words, then panels.
function firstChoice() {
  const names = axes.map((axis) => axis.name);
  const x = names.includes("speed") ? "speed" : names[0];
  const others = axes.filter((axis) => axis.name !== x);
  const own = others.filter((axis) => !follows(axis, [x]));
  const y = (own.find((axis) => axis.numeric) ?? own[0] ?? others[0])?.name ?? "";
  const rest = own.filter((axis) => axis.name !== y && !follows(axis, [y]));
  const across = rest.find((axis) => axis.levels.length <= MOST_ACROSS)?.name ?? "";
  const wide = axisOf(across)?.levels.length ?? 1;
  const down = rest.find(
    (axis) => axis.name !== across && !follows(axis, [across]) && wide * axis.levels.length <= MOST_PANELS,
  );
  return { x, y, across, down: down?.name ?? "" };
}

// Inputs that neither an axis nor a panel shows: each needs a value.
function leftOver(choice) {
  const used = [choice.x, choice.y, choice.across, choice.down];
  return axes.filter(
    (axis) => axis.levels.length > 1 && !used.includes(axis.name) && !follows(axis, used),
  );
}
