// The check of a filter before it is evaluated, as hpcwhirl.analysis.condition does it
// for `cases --where`: kinds, names and units of its parts.

const ORDERED = ["<", "<=", ">", ">="];
const LOGIC = ["and", "or", "not"];
const ALIKE = ["+", "-", "min", "max", "negative", "abs"]; // one unit for all
const UNCLEAR = "?"; // unit of a product or a power, which is not worked out
const SHOWN_MOST = 100; // characters of a text in a message
const MEASURED = /^\s*[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?\s*(?:1\/|[^\s0-9]).*$/u;

function cutText(text) {
  if (text.length <= SHOWN_MOST) return text;
  const half = SHOWN_MOST / 2;
  return `${text.slice(0, half)} (${text.length - SHOWN_MOST} characters) ${text.slice(-half)}`;
}

// Decimal digits times decimal digits, rounded once.
function timesExactly(a, b) {
  const split = (text) => {
    const [digits, power] = text.toLowerCase().split("e");
    const [whole, part = ""] = digits.split(".");
    return [BigInt(whole + part), Number(power ?? 0) - part.length];
  };
  const [[m, p], [n, q]] = [split(a), split(b)];
  return Number(`${m * n}e${p + q}`);
}

// Resolves, in a tree from parse, each name to a variable or a word, and each number to
// SI; refuses what gives another kind of value than `wanted`, "truth" or "number".
// source: variable(name), the full name of a variable, or an error; isText(variable);
// words, {variable: words that it can have}; units, {variable: SI unit}; factors,
// {SI unit: {unit: factor, as digits}}.
function checked(tree, source, wanted) {
  const told = new Map(); // of trees, of which some occur twice
  const plain = new Map(); // {tree of a plain number: its quantity's unit}
  const quoted = (text) => `'${cutText(text)}'`;
  const wordsFor = (part) => source.words[part.variable] ?? [];

  const lost = (number, why) => refuse(`${quoted(number.text)} cannot be converted: ${why}`);
  const convert = (number, beside) => {
    if (!number.unit) {
      plain.set(number, beside.unit);
      return;
    }
    const what = quoted(beside.text);
    if (beside.unit === UNCLEAR) lost(number, `the unit of ${what} is not worked out`);
    const factor = source.factors[beside.unit]?.[number.unit];
    if (factor === undefined)
      lost(number, `${what} ${beside.unit === "1" ? "has no unit" : `is in ${beside.unit}`}`);
    number[1] = timesExactly(String(number[1]), factor);
    number.unit = "";
  };
  const alike = (parts, text) => {
    const known = parts.find((part) => part.unit);
    if (!known) return { kind: "number", text, unit: "", open: parts.flatMap((p) => p.open) };
    for (const part of parts) for (const number of part.open) convert(number, known);
    return { kind: "number", text, unit: known.unit, open: [] };
  };
  const alone = (part) => {
    for (const number of part.open)
      if (number.unit) lost(number, "nothing with a unit is beside it");
  };
  const calculated = (does, parts, text) => {
    if (ALIKE.includes(does)) return alike(parts, text);
    const [a, b] = parts;
    const has = (part) => Boolean(part.unit) || part.open.some((number) => number.unit);
    const scaled = parts.filter(has);
    const made = (unit, open = []) => ({ kind: "number", text, unit, open });
    const linear = ["*", "/"].includes(does);
    if (linear && (!scaled.length || (scaled.length === 1 && scaled[0] === a)))
      return made(a.unit, a.open);
    if (does === "*" && scaled.length === 1) return made(b.unit, b.open);
    const units = new Set(parts.map((part) => part.unit).filter(Boolean));
    if (does === "/" && units.size === 1 && scaled.length === 2) {
      alike(parts, text);
      return made("1");
    }
    parts.forEach(alone);
    return made(scaled.length ? UNCLEAR : "");
  };

  const unquoted = (part) =>
    !part.variable && MEASURED.test(part.word) && /[\p{L}%°]/u.test(part.word.replace(/^\s*[+-]?[0-9.]+([eE][+-]?[0-9]+)?/u, ""))
      ? `: write ${part.word} without quotation marks`
      : "";
  const checkName = (part) => {
    if (!part.bare) return;
    for (const [variable, list] of Object.entries(source.words))
      if (list.includes(part.bare))
        refuse(`${quoted(part.text)} is a word: write ${variable} == ${part.bare}`);
    source.variable(part.bare);
  };
  const number = (part) => {
    checkName(part);
    if (part.kind !== "text") return;
    refuse(`${quoted(part.text)} is text${unquoted(part) || ": compare it by == or !="}`);
  };
  const truth = (part) => {
    checkName(part);
    if (part.kind !== "truth")
      refuse(`${quoted(part.text)} is no condition: compare it with a number or a word`);
  };
  // A name as a word if the variable beside it can have that word.
  const asWord = (part, beside) => {
    if (!part.variable || !wordsFor(beside).includes(part.word)) return part;
    return { kind: "text", text: part.text, word: part.word, unit: "", open: [], turned: true };
  };
  // The trees of both sides of == or !=, names that are words turned into words.
  const equal = (sides, trees) => {
    const [first, second] = sides;
    const a = asWord(first, second);
    const b = asWord(second, a);
    const texts = [a, b].map((part) => part.kind === "text");
    if (texts[0] !== texts[1] || (!a.variable && !b.variable && texts[0])) {
      [a, b].forEach(checkName);
      refuse(`${quoted(b.text)} cannot be equal to ${quoted(a.text)}: one is text${unquoted(a) || unquoted(b)}`);
    }
    for (const [one, other] of [[a, b], [b, a]]) {
      const allowed = wordsFor(one);
      if (allowed.length && !other.variable && !allowed.includes(other.word))
        refuse(`unknown ${one.variable} '${cutText(other.word)}'; known: ${[...allowed].sort().join(", ")}`);
    }
    return [a, b].map((part, j) => (part.turned ? ["word", part.word] : trees[j]));
  };

  const leaf = (node) => {
    const [kind, value] = node;
    const { text } = node;
    if (kind === "number") return { kind, text, unit: "", open: [node] };
    const word = { kind: "text", text, word: value, unit: "", open: [] };
    if (kind === "word") return word;
    let variable;
    try {
      variable = source.variable(value);
    } catch {
      node[0] = "word";
      return { ...word, bare: value };
    }
    node[1] = variable;
    if (source.isText(variable)) return { ...word, variable };
    return { ...word, kind: "number", variable, unit: source.units[variable] ?? "1" };
  };
  const known = (node) => {
    const chain = []; // signs before one operand, which may be thousands
    let inner = node;
    for (; ["negative", "not"].includes(inner[0]) && !told.has(inner); inner = inner[1])
      chain.push(inner);
    if (!told.has(inner)) told.set(inner, part(inner));
    for (const outer of chain.reverse()) told.set(outer, part(outer));
    return told.get(node);
  };
  const part = (node) => {
    const [does, ...trees] = node;
    if (["number", "word", "name"].includes(does)) return leaf(node);
    const parts = trees.map(known);
    const { text } = node;
    if (COMPARED.includes(does)) {
      if (ORDERED.includes(does)) parts.forEach(number);
      else [node[1], node[2]] = equal(parts, trees);
      if (parts[0].kind !== "text") alone(alike(parts, text));
      return { kind: "truth", text, unit: "", open: [] };
    }
    parts.forEach(LOGIC.includes(does) ? truth : number);
    if (LOGIC.includes(does)) return { kind: "truth", text, unit: "", open: [] };
    return calculated(does, parts, text);
  };

  const whole = known(tree);
  if (wanted === "truth") truth(whole);
  else {
    number(whole);
    alone(whole);
  }
  return { tree, plain };
}
