// Conditions on named numbers and words: the language of hpcwhirl.analysis.expression,
// with the same refusals (tests/analysis/conditions.toml has examples for both).
// parse(text) gives a tree, [what, ...operands] with its text, and with its unit if it
// is a number with one; compile(tree, lookup) a function of the case. Nothing is run as
// code.

const LONGEST = 2000; // characters
const DEEPEST = 30; // brackets within brackets
const EQUAL = 1e-9; // relative difference of numbers that are one value
const FUNCTIONS = {
  abs: [1, 1], sqrt: [1, 1], exp: [1, 1], log: [1, 1], log10: [1, 1],
  min: [2, 99], max: [2, 99],
};
const COMPARED = ["==", "!=", "<=", ">=", "<", ">"];
const RESERVED = ["and", "or", "not", "in"];
const CLOSING = { "(": ")", "[": "]", "{": "}" };
const INSTEAD = {
  "=": "write == for 'is equal to'", "&": "write and", "&&": "write and",
  "|": "write or", "||": "write or", "!": "write not", "<>": "write !=",
  "**": "there are no powers: write x * x", "^": "there are no powers: write x * x",
  "%": "there is no remainder",
};
const WRITTEN = [
  "m", "mm", "um", "inch", "s", "ms", "rad/s", "rpm", "Hz", "N", "kN", "MN", "N/m",
  "N/mm", "kN/mm", "MN/m", "Pa", "MPa", "GPa", "kg/m^3", "g/cm^3", "%", "1/s",
  "lbf", "lbf/in", "psi", "g mm", "oz in", "cP", "deg", "rev", "cm", "in", "mil",
  "ft", "us", "RPM", "krpm", "kHz", "rev/s", "rev/min", "1/min", "deg/s", "rad",
  "rad/s^2", "rpm/s", "m/s", "mm/s", "N s", "N s/m", "ksi", "Pa s", "J", "mJ", "kJ",
  "kg m", "g m", "kg mm", "kg m^2",
];
// "%" before a number is no unit, nor is "in" before a list.
const UNIT = new RegExp(
  `\\s*(?:(${WRITTEN.filter((u) => u !== "%").sort((a, b) => b.length - a.length)
    .map((u) => u.replace(/[^\w ]/g, "\\$&")).join("|")})(?![\\p{L}\\p{N}_.]|\\s*[(\\[{])|(%)(?!\\s*[0-9(.]))`, "uy");
const TOKEN =
  /\s*(?:((?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)|([\p{L}_][\p{L}\p{N}_.]*)|'([^']*)'|"([^"]*)"|(&&?|\|\|?|\*\*|<>|\^|%|=(?!=)|!(?!=))|(==|!=|<=|>=|[<>()[\]{}+\-*\/,]))/uy;

function refuse(why) {
  throw new Error(why);
}

function tokens(text) {
  const found = [];
  const end = text.trimEnd().length;
  TOKEN.lastIndex = 0;
  while (TOKEN.lastIndex < end) {
    const at = TOKEN.lastIndex;
    const part = TOKEN.exec(text);
    if (!part) refuse(`'${text.slice(at).trim().slice(0, 12)}' is not expected there`);
    const [whole, number, name, single, double, instead, sign] = part;
    if (instead !== undefined) refuse(`'${instead}' is not known here, ${INSTEAD[instead]}`);
    const start = at + whole.search(/\S/u);
    const token = { start, end: TOKEN.lastIndex, unit: "" };
    if (number !== undefined) [token.kind, token.value] = ["number", number];
    else if (name !== undefined) [token.kind, token.value] = ["name", name];
    else if (sign !== undefined) [token.kind, token.value] = ["sign", sign];
    else [token.kind, token.value] = ["word", single ?? double];
    UNIT.lastIndex = token.end;
    const unit = number === undefined ? null : UNIT.exec(text);
    if (unit) [token.unit, token.end] = [unit[1] ?? unit[2], UNIT.lastIndex];
    TOKEN.lastIndex = token.end;
    found.push(token);
  }
  return found;
}

function numberOf(text) {
  const value = Number(text);
  if (value === Infinity) refuse(`a number is below 1.8e308, got one of ${text.length} characters`);
  return value;
}

function parse(text) {
  if ([...text].length > LONGEST)
    refuse(`a condition has at most ${LONGEST} characters, got ${[...text].length}`);
  const list = tokens(text);
  let at = 0;
  let depth = 0;
  const is = (kind, ...values) =>
    at < list.length && list[at].kind === kind && values.includes(list[at].value);
  const take = () => list[at++].value;
  // The tree of what stands from the token `first` up to here.
  const made = (first, tree) =>
    Object.assign(tree, { text: text.slice(list[first]?.start, list[at - 1]?.end) });
  const joined = (part, kind, ...signs) => {
    const first = at;
    let tree = part();
    while (is(kind, ...signs)) {
      const does = take();
      const other = part();
      tree = made(first, [does, tree, other]);
    }
    return tree;
  };
  const repeated = (part, kind, sign, does) => {
    const firsts = [];
    for (; is(kind, sign); at += 1) firsts.push(at);
    let tree = part();
    for (const first of firsts.reverse()) tree = made(first, [does, tree]);
    return tree;
  };
  const either = () => joined(both, "name", "or");
  const both = () => joined(negated, "name", "and");
  const negated = () => repeated(compared, "name", "not", "not");
  const compared = () => {
    const first = at;
    let before = sum();
    if (is("name", "not", "in")) return made(first, member(before));
    let tree = null;
    while (is("sign", ...COMPARED)) {
      const sign = take();
      const after = sum();
      const pair = made(first, [sign, before, after]);
      tree = tree ? made(first, ["and", tree, pair]) : pair;
      before = after;
    }
    return tree ?? before;
  };
  const member = (one) => {
    const away = take() === "not";
    if (away && !is("name", "in")) refuse("'in' is missing after 'not'");
    if (away) at += 1;
    const closing = CLOSING[list[at]?.kind === "sign" ? list[at].value : ""];
    if (!closing) refuse("a list such as (damped, sustained) is missing after 'in'");
    const equal = listed(sum, closing).map((other) => ["==", one, other]);
    const tree = equal.reduce((before, after) => ["or", before, after]);
    return away ? ["not", tree] : tree;
  };
  const listed = (part, closing) => {
    depth += 1;
    if (depth > DEEPEST) refuse(`it has more than ${DEEPEST} brackets within each other`);
    at += 1;
    const parts = [part()];
    while (is("sign", ",")) {
      at += 1;
      if (is("sign", closing)) break;
      parts.push(part());
    }
    if (!is("sign", closing)) {
      if (noUnit()) end();
      refuse(`'${closing}' is missing${at < list.length ? ` before '${list[at].value}'` : ""}`);
    }
    at += 1;
    depth -= 1;
    return parts;
  };
  const sum = () => joined(product, "sign", "+", "-");
  const product = () => joined(signed, "sign", "*", "/");
  const signed = () => repeated(atom, "sign", "-", "negative");
  const atom = () => {
    if (is("sign", "(")) {
      const parts = listed(either, ")");
      if (parts.length > 1) refuse("a list may stand only after 'in'");
      return parts[0];
    }
    if (at >= list.length) refuse("something is missing at its end");
    const { kind, value, unit } = list[at];
    if (kind === "sign" || (kind === "name" && RESERVED.includes(value)))
      refuse(`'${value}' stands where a number or a name should`);
    at += 1;
    if (kind === "name" && is("sign", "(")) return call(value);
    const leaf = [kind, kind === "number" ? numberOf(value) : value];
    return Object.assign(made(at - 1, leaf), { unit });
  };
  const call = (name) => {
    const first = at - 1;
    if (!Object.hasOwn(FUNCTIONS, name))
      refuse(`there is no function '${name}'; there are ${Object.keys(FUNCTIONS).join(", ")}`);
    const [least, most] = FUNCTIONS[name];
    const parts = listed(either, ")");
    const wanted = least === most ? `${least}` : `${least} to ${most}`;
    if (parts.length < least || parts.length > most)
      refuse(`the number of arguments of ${name} must be ${wanted}, got ${parts.length}`);
    return made(first, [name, ...parts]);
  };
  // A hint where a name follows a number, as in "300 rmp".
  const noUnit = () => {
    const [last, next] = [list[at - 1], list[at]];
    const follows = last?.kind === "number" && !last.unit && next?.kind === "name";
    return follows ? ", and is no unit of conditions, such as mm, rpm, kN" : "";
  };
  const end = () => {
    if (at < list.length) refuse(`'${list[at].value}' is not expected there${noUnit()}`);
  };
  const tree = either();
  end();
  return tree;
}

// Words that are the same, or numbers to nine digits.
const same = (x, y) =>
  x === y || (typeof x !== "string" && Number.isFinite(y) && Math.abs(x - y) <= EQUAL * Math.abs(y));

// A comparison with a missing number is missing: NaN, neither true nor false.
const isMissing = (x) => Number.isNaN(x);
const compared = (holds) => (a, b) => (isMissing(a) || isMissing(b) ? NaN : holds(a, b));
// `and` is false if one side is, `or` true if one side is; else it may be missing.
const either = (a, b, wins) => {
  if ([a, b].some((x) => !isMissing(x) && Boolean(x) === wins)) return wins;
  return isMissing(a) || isMissing(b) ? NaN : !wins;
};

const MEANING = {
  "+": (a, b) => a + b,
  "-": (a, b) => a - b,
  "*": (a, b) => a * b,
  "/": (a, b) => a / b,
  "==": compared(same),
  "!=": compared((a, b) => !same(a, b)),
  "<": compared((a, b) => a < b),
  "<=": compared((a, b) => a <= b),
  ">": compared((a, b) => a > b),
  ">=": compared((a, b) => a >= b),
  and: (a, b) => either(a, b, false),
  or: (a, b) => either(a, b, true),
  not: (a) => (isMissing(a) ? NaN : !a),
  negative: (a) => -a,
  abs: Math.abs,
  sqrt: Math.sqrt,
  exp: Math.exp,
  log: Math.log,
  log10: Math.log10,
  min: Math.min,
  max: Math.max,
};

// lookup(name) gives a function of the case, or null where the name is a word itself.
function compile(tree, lookup) {
  const [kind, ...parts] = tree;
  if (kind === "number" || kind === "word") return () => parts[0];
  if (kind === "name") return lookup(parts[0]) ?? (() => parts[0]);
  const meaning = MEANING[kind];
  const asked = parts.map((part) => compile(part, lookup));
  const [a, b] = asked;
  if (asked.length === 1) return (i) => meaning(a(i));
  if (asked.length === 2) return (i) => meaning(a(i), b(i));
  return (i) => meaning(...asked.map((part) => part(i)));
}

function namesIn(tree) {
  if (tree[0] === "name") return [tree[1]];
  if (tree[0] === "number" || tree[0] === "word") return [];
  return tree.slice(1).flatMap(namesIn);
}
