// Conditions on named numbers and words: the language of hpcwhirl.analysis.expression,
// with the same refusals (tests/analysis/test_expression.py runs both). parse(text) gives a tree; compile(tree, lookup) a function of the case. Nothing
// is run as code.

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
    const [, number, name, single, double, instead, sign] = part;
    if (instead !== undefined) refuse(`'${instead}' is not known here, ${INSTEAD[instead]}`);
    if (number !== undefined) found.push(["number", number]);
    else if (name !== undefined) found.push(["name", name]);
    else if (sign !== undefined) found.push(["sign", sign]);
    else found.push(["word", single ?? double]);
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
    at < list.length && list[at][0] === kind && values.includes(list[at][1]);
  const joined = (part, kind, ...signs) => {
    let tree = part();
    while (is(kind, ...signs)) tree = [list[at++][1], tree, part()];
    return tree;
  };
  const repeated = (part, kind, sign, does) => {
    let count = 0;
    for (; is(kind, sign); at += 1) count += 1;
    let tree = part();
    for (; count; count -= 1) tree = [does, tree];
    return tree;
  };
  const either = () => joined(both, "name", "or");
  const both = () => joined(negated, "name", "and");
  const negated = () => repeated(compared, "name", "not", "not");
  const compared = () => {
    let before = sum();
    if (is("name", "not", "in")) return member(before);
    let tree = null;
    while (is("sign", ...COMPARED)) {
      const sign = list[at++][1];
      const after = sum();
      const pair = [sign, before, after];
      tree = tree ? ["and", tree, pair] : pair;
      before = after;
    }
    return tree ?? before;
  };
  const member = (one) => {
    const away = list[at++][1] === "not";
    if (away && !is("name", "in")) refuse("'in' is missing after 'not'");
    if (away) at += 1;
    const closing = CLOSING[list[at]?.[0] === "sign" ? list[at][1] : ""];
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
    const before = at < list.length ? ` before '${list[at][1]}'` : "";
    if (!is("sign", closing)) refuse(`'${closing}' is missing${before}`);
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
    const [kind, value] = list[at];
    if (kind === "sign" || (kind === "name" && RESERVED.includes(value)))
      refuse(`'${value}' stands where a number or a name should`);
    at += 1;
    if (kind === "name" && is("sign", "(")) return call(value);
    return [kind, kind === "number" ? numberOf(value) : value];
  };
  const call = (name) => {
    if (!Object.hasOwn(FUNCTIONS, name))
      refuse(`there is no function '${name}'; there are ${Object.keys(FUNCTIONS).join(", ")}`);
    const [least, most] = FUNCTIONS[name];
    const parts = listed(either, ")");
    const wanted = least === most ? `${least}` : `${least} to ${most}`;
    if (parts.length < least || parts.length > most)
      refuse(`the number of arguments of ${name} must be ${wanted}, got ${parts.length}`);
    return [name, ...parts];
  };
  const tree = either();
  if (at < list.length) refuse(`'${list[at][1]}' is not expected there`);
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
