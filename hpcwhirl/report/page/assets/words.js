// Words of all cases by the tables of hpcwhirl.scene.words, and why.

const NO_REGIME = ["unstable", "overloaded"]; // outcomes, as `scene.words` has them
const limits = Object.fromEntries(told.thresholds.map((t) => [t.name, t.value]));
const given = { ...limits };

const defined = Object.fromEntries(
  Object.entries(told.rules.defined).map(([name, text]) => [name, parse(text)]),
);
const definedValue = {};

function ruleName(name) {
  if (Object.hasOwn(definedValue, name)) return definedValue[name];
  if (Object.hasOwn(limits, name)) return () => limits[name];
  return columns.get(name)?.value ?? null;
}

for (const [name, tree] of Object.entries(defined))
  definedValue[name] = compile(tree, ruleName);

const tables = Object.fromEntries(
  Object.entries(told.rules.tables).map(([name, rules]) => [
    name,
    rules.map(({ word, needs }) => ({
      word,
      needs: needs.map((text) => {
        const tree = parse(text);
        return { text, tree, holds: compile(tree, ruleName) };
      }),
    })),
  ]),
);

const ruleOf = (table, i) =>
  tables[table].find(({ needs }) => needs.every((need) => need.holds(i)));

function wordsByRule(i) {
  const outcome = ruleOf("outcome", i).word;
  if (NO_REGIME.includes(outcome)) return [outcome, "none", "none"];
  return [outcome, ruleOf("regime", i).word, ruleOf("whirl", i).word];
}

// The word by which a case is shown, as by `words_of` in store/reading/shares.py.
function shownWord(status, outcome, regime) {
  if (status !== "ok") return status === "missing" ? "missing" : "failed";
  if (NO_REGIME.includes(outcome)) return outcome;
  return regime === "none" ? "unstable" : regime;
}

// The word by which a case is coloured: the most frequent one of case and twins. With
// moved thresholds the twins' words are not known here, so the case's own word counts.
function byMajority(own, i, moved) {
  const most = columns.get("word_majority")?.value(i) ?? "none";
  return moved || most === "none" ? own : most;
}

// Whether a free motion grows without contact.
const isGrowing = (i) => (columns.get("free_growth")?.value(i) ?? 0) > 0;

// Whether too few twins have the word of a case.
const isUnsure = (i) => (columns.get("word_share")?.value(i) ?? NaN) < told.sure;

const words = { shown: [], own: [], whirl: [], outcome: [], regime: [] };
const stored = {
  outcome: columns.get("outcome").value,
  regime: columns.get("regime").value,
  whirl: columns.get("whirl").value,
};

// Before a threshold has been moved the words are those of the file.
function nameAll() {
  const moved = Object.keys(limits).some((n) => limits[n] !== given[n]);
  let changed = 0;
  for (const i of CASES) {
    const status = valueOf("status", i);
    const old = [stored.outcome(i), stored.regime(i), stored.whirl(i)];
    const now = moved && status === "ok" ? wordsByRule(i) : old;
    [words.outcome[i], words.regime[i], words.whirl[i]] = now;
    words.own[i] = shownWord(status, now[0], now[1]);
    words.shown[i] = byMajority(words.own[i], i, moved);
    if (now.some((word, j) => word !== old[j])) changed += 1;
  }
  return changed;
}

// Cases whose stored words, of another version, differ from those of the tables here.
function otherwiseNamed() {
  return CASES.filter(
    (i) =>
      valueOf("status", i) === "ok" &&
      wordsByRule(i).join() !== [stored.outcome(i), stored.regime(i), stored.whirl(i)].join(),
  );
}

const SIGNS = { "<=": "≤", ">=": "≥", "==": "=", "!=": "≠" };
const OPPOSITE = { "<": ">=", ">=": "<", ">": "<=", "<=": ">", "==": "!=", "!=": "==" };
const wordsOfName = (name) => name.replace(/^late_/, "").replaceAll("_", " ");

function spoken(tree) {
  const [kind, a, b] = tree;
  if (kind === "number") return short(a);
  if (kind === "word") return a;
  if (kind === "name")
    return Object.hasOwn(defined, a) && isTruth(defined[a]) ? spoken(defined[a]) : wordsOfName(a);
  if (kind === "negative") return `−${spoken(a)}`;
  if (kind === "not") return `not (${spoken(a)})`;
  if (Object.hasOwn(FUNCTIONS, kind))
    return kind === "abs" ? `|${spoken(a)}|` : `${kind}(${tree.slice(1).map(spoken).join(", ")})`;
  return `${spoken(a)} ${kind === "*" ? "×" : (SIGNS[kind] ?? kind)} ${spoken(b)}`;
}

const isTruth = (tree) => ["and", "or", "not", ...COMPARED].includes(tree[0]);
const isLimit = (tree) => tree[0] === "name" && Object.hasOwn(limits, tree[1]);

// [text, holds] of each comparison of a condition. The text is what is so, whether it
// is what the condition asks for or its opposite: "fed over lost 0.93 ≥ 0.8 (replaced)".
function reasons(tree, i) {
  const [kind, a, b] = tree;
  const holds = Boolean(compile(tree, ruleName)(i));
  if (kind === "name" && Object.hasOwn(defined, a)) return reasons(defined[a], i);
  if (kind === "and") return [...reasons(a, i), ...reasons(b, i)];
  const joined = (...parts) => parts.flatMap((t) => reasons(t, i)).map(([text]) => text).join(" and ");
  if (kind === "or") return [[joined(a, b), holds]];
  if (kind === "not") return [[joined(a), holds]];
  if (!COMPARED.includes(kind)) return [[spoken(tree), holds]];
  return [[comparison(holds ? kind : OPPOSITE[kind], a, b, i), holds]];
}

function comparison(kind, a, b, i) {
  if (a[1] === "late_contacts") return `${kind === "==" ? "no contact" : "contact"} in the window`;
  const sign = SIGNS[kind] ?? kind;
  const number = (tree) => compile(tree, ruleName)(i);
  const limit = (tree) => `${short(limits[tree[1]])} (${tree[1].replaceAll("_", " ")})`;
  // x >= limit * y is told as x over y against the limit
  if (b[0] === "*" && isLimit(b[1]) && number(b[2]) > 0)
    return `${spoken(a)} over ${spoken(b[2])} ${short(number(a) / number(b[2]))} ${sign} ${limit(b[1])}`;
  const unit = a[0] === "name" ? (columns.get(a[1])?.unit ?? "") : "";
  const left = `${spoken(a)} ${inUnit(number(a), unit)} ${sign}`;
  if (isLimit(b)) return `${left} ${limit(b)}`;
  if (b[0] === "negative" && isLimit(b[1])) return `${left} −${limit(b[1])}`;
  if (b[0] === "number" || b[0] === "word") return `${left} ${short(b[1])}`;
  return `${left} ${spoken(b)} ${short(number(b))}`;
}

const texts = (found) => found.map(([text]) => text).join("; ");

// A number of an input, whose text gives it to 1e-6: neighbours on an axis differ.
function exact(value) {
  for (let digits = 4; digits < 10; digits += 1)
    if (Math.abs(value.toPrecision(digits) - value) <= 1e-6 * Math.abs(value))
      return short(value, digits);
  return short(value, 10);
}

// A round number at a tick, without what arithmetic has left in its last digits.
const rounded = (value) => short(value, 10);

// Four digits; words as they are.
function short(value, digits = 4) {
  if (typeof value !== "number") return String(value);
  if (!Number.isFinite(value)) return String(value);
  return String(Number(value.toPrecision(digits))).replaceAll("-", "−");
}
