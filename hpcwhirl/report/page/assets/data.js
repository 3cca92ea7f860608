// The campaign as it stands in the page: facts, columns, and a record of traces a case.

const element = (id) => document.getElementById(id);
const told = JSON.parse(element("facts").textContent);
const COUNT = told.cases;
// Cases whose words count: a case that a confirming preset has computed again does not.
const superseded = new Set(told.superseded);
const CASES = Array.from({ length: COUNT }, (_, i) => i).filter((i) => !superseded.has(i));

function bytesOf(text) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i += 1) bytes[i] = raw.charCodeAt(i);
  return bytes.buffer;
}

const KINDS = { f8: Float64Array, f4: Float32Array, i4: Int32Array };
const columns = new Map();

(() => {
  const block = element("columns");
  const buffer = bytesOf(block.textContent);
  block.remove();
  for (const column of told.columns) {
    const values = new KINDS[column.kind](buffer, column.at, column.same ? 1 : COUNT);
    const place = column.same ? () => 0 : (i) => i;
    const value = column.words
      ? (i) => column.words[values[place(i)]]
      : (i) => values[place(i)];
    columns.set(column.name, { ...column, value, isWord: Boolean(column.words) });
  }
})();

const valueOf = (name, i) => columns.get(name).value(i);

// Swept inputs by variable: exact values, where a column has seven digits.
const swept = told.swept.map((input) => {
  const level = columns.get(`level of ${input.name}`).value;
  const numeric = input.levels.every((v) => typeof v === "number");
  return { ...input, level, numeric, value: (i) => input.levels[level(i)] };
});

for (const input of swept) {
  const known = columns.get(input.variable);
  columns.set(input.variable, {
    name: input.variable,
    unit: input.unit,
    meaning: known?.meaning ?? `swept input ${input.name}`,
    isWord: !input.numeric,
    value: input.numeric ? input.value : (i) => String(input.value(i)),
  });
}

for (const [name, derived] of Object.entries(told.derived)) {
  const value = compile(parse(derived.is), (n) => columns.get(n)?.value ?? null);
  columns.set(name, { name, ...derived, isWord: false, value });
}

// What integrates a case again, keeps its traces and draws them.
function commandOf(i) {
  const own = told.commands[i] ?? told.program + swept.map((s) => ` ${s.set[s.level(i)]}`).join("") + told.tail;
  return `${own} --out case-${i}.h5 --plot case-${i}`;
}

// The same by the campaign's file; "" if the file does not give the case.
function commandByFile(i) {
  if (!told.file || told.commands[i]) return "";
  return `${told.file}${swept.map((s) => ` ${s.set[s.level(i)]}`).join("")} --out case-${i}.h5 --plot case-${i}`;
}

// A record: scale of the places (m), angle of the rotating frame at the first (rad),
// step (s), end of the spectrum (rad/s), scales of the curves; then places and curves,
// see thin.py.
const tracesText = element("traces").textContent;
element("traces").remove();

function recordOf(i) {
  const slot = valueOf("record", i);
  if (slot < 0) return null;
  const size = (told.traces.bytes / 3) * 4;
  const buffer = bytesOf(tracesText.slice(slot * size, (slot + 1) * size));
  const [scale, start, step, reach, ...scales] = new Float32Array(buffer, 0, 8);
  const { orbit, radius, ledger, lines } = told.traces;
  const places = new Int16Array(buffer, 32, 2 * orbit);
  const codes = new Int16Array(buffer, 32 + 4 * orbit, 2 * radius + 4 * ledger + lines);
  let used = 0;
  const take = (count, of) =>
    Float32Array.from(codes.subarray(used, (used += count)), (code) => decoded(code, scales[of]));
  return {
    step,
    reach,
    orbit: placesOf(places, orbit, scale, start, step * valueOf("speed", i)),
    least: take(radius, 0),
    largest: take(radius, 0),
    energy: take(ledger, 1),
    friction: take(ledger, 2),
    rotation: take(ledger, 2),
    lost: take(ledger, 2),
    lines: take(lines, 3),
  };
}

function decoded(code, scale) {
  if (code === -32768) return NaN;
  return code ? Math.sign(code) * scale * 2 ** (-40 * (1 - Math.abs(code) / 32767)) : 0;
}

function placesOf(places, count, scale, start, turn) {
  const found = [];
  for (let j = 0; j < count && places[j] !== -32768; j += 1) {
    const x = (places[j] * scale) / 32767;
    const y = (places[count + j] * scale) / 32767;
    const angle = -(start + j * turn);
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    found.push({ x, y, u: x * c - y * s, v: x * s + y * c });
  }
  return found;
}
