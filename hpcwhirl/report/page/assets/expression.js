// Conditions on named numbers and words: the language of hpcwhirl.analysis.expression
// (rules) and of `hpcwhirl cases --where` (filter), whose `in` it knows, too.
// parse(text) gives a tree; compile(tree, lookup) a function of the case. Nothing is
// run as code.

const FUNCTIONS = { abs: 1, min: 2, max: 2 };
const COMPARED = ["==", "!=", "<=", ">=", "<", ">"];
const TOKEN =
  /\s*(?:((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|([\p{L}_][\p{L}\p{N}_.]*)|'([^']*)'|"([^"]*)"|(==|!=|<=|>=|[<>()[\]{}+\-*\/,]))/uy;

function tokens(text) {
  const found = [];
  const end = text.trimEnd().length;
  TOKEN.lastIndex = 0;
  while (TOKEN.lastIndex < end) {
    const at = TOKEN.lastIndex;
    const part = TOKEN.exec(text);
    if (!part) throw new Error(`cannot read '${text.slice(at).trim().slice(0, 12)}'`);
    if (part[1] !== undefined) found.push(["number", Number(part[1])]);
    else if (part[2] !== undefined) found.push(["name", part[2]]);
    else if (part[5] !== undefined) found.push(["sign", part[5]]);
    else found.push(["word", part[3] ?? part[4]]);
  }
  return found;
}

function parse(text) {
  const list = tokens(text);
  let at = 0;
  const is = (...signs) =>
    at < list.length && list[at][0] === "sign" && signs.includes(list[at][1]);
  const named = (word) => at < list.length && list[at][0] === "name" && list[at][1] === word;
  const expect = (sign) => {
    if (!is(sign)) throw new Error(`'${sign}' is missing`);
    at += 1;
  };
  const left = (part, ...signs) => {
    let tree = part();
    while (is(...signs)) tree = [list[at++][1], tree, part()];
    return tree;
  };
  const joined = (part, word) => {
    let tree = part();
    while (named(word)) {
      at += 1;
      tree = [word, tree, part()];
    }
    return tree;
  };
  const either = () => joined(both, "or");
  const both = () => joined(negated, "and");
  const negated = () => {
    if (!named("not")) return compared();
    at += 1;
    return ["not", negated()];
  };
  const compared = () => {
    let before = sum();
    const away = named("not");
    if (away || named("in")) return member(before, away);
    let tree = null;
    while (is(...COMPARED)) {
      const sign = list[at++][1];
      const after = sum();
      const pair = [sign, before, after];
      tree = tree ? ["and", tree, pair] : pair;
      before = after;
    }
    return tree ?? before;
  };
  const member = (one, away) => {
    if (away) at += 1;
    if (!named("in")) throw new Error("'in' is missing");
    at += 1;
    const close = { "(": ")", "[": "]", "{": "}" }[list[at]?.[0] === "sign" ? list[at][1] : ""];
    if (!close) throw new Error("a list such as (damped, sustained) is missing after 'in'");
    at += 1;
    let tree = ["==", one, sum()];
    while (is(",")) {
      at += 1;
      if (!is(close)) tree = ["or", tree, ["==", one, sum()]];
    }
    expect(close);
    return away ? ["not", tree] : tree;
  };
  const sum = () => left(product, "+", "-");
  const product = () => left(signed, "*", "/");
  const signed = () => {
    if (!is("-")) return atom();
    at += 1;
    return ["negative", signed()];
  };
  const atom = () => {
    if (at >= list.length) throw new Error("something is missing at the end");
    const [kind, value] = list[at++];
    if (kind === "sign" && value === "(") {
      const tree = either();
      expect(")");
      return tree;
    }
    if (kind === "sign" || (kind === "name" && ["and", "or", "not", "in"].includes(value)))
      throw new Error(`'${value}' stands where a number or name should`);
    if (kind === "name" && is("(")) return call(value);
    return [kind, value];
  };
  const call = (name) => {
    if (!Object.hasOwn(FUNCTIONS, name)) throw new Error(`no function '${name}'`);
    expect("(");
    const parts = [either()];
    while (is(",")) {
      at += 1;
      parts.push(either());
    }
    expect(")");
    if (parts.length !== FUNCTIONS[name])
      throw new Error(`${name} takes ${FUNCTIONS[name]}, got ${parts.length}`);
    return [name, ...parts];
  };
  const tree = either();
  if (at < list.length) throw new Error(`'${list[at][1]}' is not expected there`);
  return tree;
}

const MEANING = {
  "+": (a, b) => (i) => a(i) + b(i),
  "-": (a, b) => (i) => a(i) - b(i),
  "*": (a, b) => (i) => a(i) * b(i),
  "/": (a, b) => (i) => a(i) / b(i),
  "==": (a, b) => (i) => a(i) === b(i),
  "!=": (a, b) => (i) => a(i) !== b(i),
  "<": (a, b) => (i) => a(i) < b(i),
  "<=": (a, b) => (i) => a(i) <= b(i),
  ">": (a, b) => (i) => a(i) > b(i),
  ">=": (a, b) => (i) => a(i) >= b(i),
  and: (a, b) => (i) => Boolean(a(i)) && Boolean(b(i)),
  or: (a, b) => (i) => Boolean(a(i)) || Boolean(b(i)),
  not: (a) => (i) => !a(i),
  negative: (a) => (i) => -a(i),
  abs: (a) => (i) => Math.abs(a(i)),
  min: (a, b) => (i) => Math.min(a(i), b(i)),
  max: (a, b) => (i) => Math.max(a(i), b(i)),
};

// As `cases --where` takes equality: to nine digits.
const near = (x, y) =>
  x === y || (typeof x === "number" && Math.abs(x - y) <= 1e-9 * Math.abs(y));
const LENIENT = {
  ...MEANING,
  "==": (a, b) => (i) => near(a(i), b(i)),
  "!=": (a, b) => (i) => !near(a(i), b(i)),
};

// lookup(name) gives a function of the case, or null where the name is a word itself.
function compile(tree, lookup, meaning = MEANING) {
  const [kind, ...parts] = tree;
  if (kind === "number" || kind === "word") return () => parts[0];
  if (kind === "name") return lookup(parts[0]) ?? (() => parts[0]);
  return meaning[kind](...parts.map((part) => compile(part, lookup, meaning)));
}

function namesIn(tree) {
  if (tree[0] === "name") return [tree[1]];
  if (tree[0] === "number" || tree[0] === "word") return [];
  return tree.slice(1).flatMap(namesIn);
}
