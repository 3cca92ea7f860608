// The small figures of one case.

const LENGTHS = [[1, ""], [1e3, "m"], [1e6, "µ"], [1e9, "n"], [1e12, "p"]]
  .map(([factor, prefix]) => [factor, prefix + columns.get("gap").unit]);
const GAP_FITS = 0.05; // least size of an orbit, over the gap, to draw the gap's circle

function lengthUnit(largest) {
  return LENGTHS.find(([factor]) => largest * factor >= 0.1) ?? LENGTHS.at(-1);
}

const POWER_DECADES = 1e-8; // smallest power drawn, over the largest
const CHART = { width: 330, height: 200, marginLeft: 52, marginBottom: 36, marginTop: 24, marginRight: 12 };

// A logarithmic axis with a few powers of ten.
function decades(label, [low, high]) {
  const [a, b] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const step = Math.max(1, Math.ceil((b - a) / 5));
  const ticks = d3.range(a, b + 1, step).map((p) => 10 ** p);
  return { label, type: "log", domain: [low, high], ticks: ticks.filter((t) => t >= low && t <= high), tickFormat: (v) => v.toExponential(0).replace("e+", "e"), grid: true };
}

const middles = (count, end) => d3.range(count).map((j) => ((j + 0.5) / count) * end);
const used = (values) => {
  const first = values.findIndex(Number.isNaN);
  return first < 0 ? values.length : first;
};

function figureOf(title, plot, caption) {
  const figure = document.createElement("figure");
  const text = document.createElement("figcaption");
  text.textContent = caption;
  plot.setAttribute("role", "img");
  plot.setAttribute("aria-label", `${title}. ${caption}`);
  figure.append(heading("h4", title), plot, text);
  return figure;
}

function heading(kind, text) {
  const element = document.createElement(kind);
  element.textContent = text;
  return element;
}

function orbitFigure(record, i, frame, whole) {
  const [x, y] = frame === "static" ? ["x", "y"] : ["u", "v"];
  const gap = valueOf("gap", i);
  const steady = Math.max(Math.floor(valueOf("window", i) / record.step), 1);
  const late = record.orbit.slice(-steady);
  const early = whole ? record.orbit.slice(0, Math.max(record.orbit.length - steady + 1, 0)) : [];
  const drawn = whole ? record.orbit : late;
  const largest = d3.max(drawn, (p) => Math.max(Math.abs(p.x), Math.abs(p.y))) ?? 0;
  const [factor, unit] = lengthUnit(largest);
  const withGap = largest > GAP_FITS * gap;
  const side = factor * (withGap ? Math.max(largest * 1.42, gap * 1.1) : largest * 1.45) || 1;
  const spot = { x: (p) => factor * p[x], y: (p) => factor * p[y] };
  const turn = d3.range(0, 181).map((j) => (j * Math.PI) / 90);
  const circle = withGap
    ? [Plot.line(turn, {
        x: (a) => factor * gap * Math.cos(a), y: (a) => factor * gap * Math.sin(a),
        strokeDasharray: "4 3", stroke: "currentColor",
      })]
    : [];
  const [across, up] = frame === "static" ? ["X", "Y"] : ["x", "y"];
  const scale = (label) => ({ domain: [-side, side], label: `${label}, ${unit}`, ticks: 5 });
  const plot = Plot.plot({
    width: 300, height: 300, marginLeft: 46, marginBottom: 40, marginRight: 10, marginTop: 20,
    x: scale(across), y: scale(up),
    marks: [
      ...circle,
      Plot.line(early, { ...spot, stroke: "var(--pale)", strokeWidth: 1 }),
      Plot.line(late, { ...spot, stroke: "var(--series-0)", strokeWidth: 1 }),
      Plot.dot(late.slice(-1), { ...spot, fill: "var(--series-0)", r: 3 }),
    ],
  });
  const milliseconds = short(1e3 * record.step * Math.max(drawn.length - 1, 0));
  const circled = withGap ? "dashed: the gap" : `the gap, ${short(factor * gap)} ${unit}, lies outside`;
  return figureOf(
    `Orbit, ${frame} frame`, plot,
    `last ${milliseconds} ms, ${drawn.length} places ${short(1e3 * record.step)} ms apart; ` +
      `dot: the end; ${circled}`,
  );
}

function overTime(record, i, curves, { label, log }) {
  const end = valueOf("end_time", i);
  const start = end - valueOf("window", i);
  const rows = curves.flatMap(({ values, name }) => {
    const count = used(values);
    return middles(count, end).map((t, j) => ({ t, v: values[j], name }));
  });
  const names = curves.map((c) => c.name);
  return Plot.plot({
    ...CHART,
    x: { label: told.labels.time, domain: [0, end || 1], ticks: 6 },
    y: log ? decades(label, d3.extent(rows.filter((r) => r.v > 0), (r) => r.v)) : { label, tickFormat: short, ticks: 5, grid: true },
    color: { domain: names, range: ["var(--series-0)", "var(--second)", "var(--third)"].slice(0, names.length), legend: names.length > 1 },
    marks: [
      Plot.ruleX([start], { strokeDasharray: "2 3" }),
      Plot.line(log ? rows.filter((r) => r.v > 0) : rows, { x: "t", y: "v", stroke: "name", strokeWidth: 1.2 }),
    ],
  });
}

const spansDecades = (values) => {
  const positive = Array.from(values).filter((v) => v > 0);
  return positive.length > 1 && d3.max(positive) / d3.min(positive) > 100;
};

function radiusFigure(record, i) {
  const count = used(record.largest);
  const largest = d3.max(record.largest) ?? 0;
  const [factor, unit] = lengthUnit(largest);
  const gap = factor * valueOf("gap", i);
  const log = spansDecades(record.largest.subarray(Math.floor(count / 20), count));
  const end = valueOf("end_time", i);
  const least = log ? (v) => Math.max(v, 1e-6 * factor * largest) : (v) => v;
  const rows = middles(count, end).map((t, j) => ({
    t, low: least(factor * record.least[j]), high: least(factor * record.largest[j]),
  }));
  const ends = [d3.min(rows, (r) => r.low), d3.max(rows, (r) => r.high)];
  const plot = Plot.plot({
    ...CHART,
    x: { label: told.labels.time, domain: [0, end || 1], ticks: 6 },
    y: log ? decades(`|Z|, ${unit}`, ends) : { label: `|Z|, ${unit}`, ticks: 5, tickFormat: short, grid: true, zero: true },
    marks: [
      Plot.ruleX([end - valueOf("window", i)], { strokeDasharray: "2 3" }),
      ...(gap < 20 * factor * largest && (!log || gap > ends[0]) ? [Plot.ruleY([gap], { strokeDasharray: "4 3" })] : []),
      Plot.areaY(rows, { x: "t", y1: "low", y2: "high", fill: "var(--series-0)", fillOpacity: 0.45, stroke: "none" }),
      Plot.lineY(rows, { x: "t", y: "high", stroke: "var(--series-0)", strokeWidth: 1 }),
    ],
  });
  return figureOf(
    "Radius of the centre, |Z|(t)", plot,
    `largest and least of each of ${count} pieces of the run; dashed: the gap; dotted: the window of the words begins`,
  );
}

function spectrumFigure(record, i) {
  const count = record.lines.length;
  const [factor, unit] = lengthUnit(d3.max(record.lines) ?? 0);
  const speed = valueOf("speed", i);
  const rows = Array.from(record.lines, (v, j) => ({
    w: ((j + 0.5) / count) * 2 * record.reach - record.reach, v: factor * v,
  })).filter((r) => r.v > 0);
  const top = d3.max(rows, (r) => r.v) ?? 1;
  const plot = Plot.plot({
    ...CHART,
    x: { label: `${told.labels.line_frequency}; right of 0 anticlockwise`, domain: [-record.reach || -1, record.reach || 1], ticks: 6 },
    y: { ...decades(`line of Z, ${unit}`, [1e-4 * top, 2 * top]), clamp: true },
    marks: [
      Plot.ruleX([0]),
      Plot.ruleX([speed], { strokeDasharray: "4 3" }),
      Plot.line(rows, { x: "w", y: "v", stroke: "var(--series-0)", curve: "step", strokeWidth: 1.2 }),
    ],
  });
  const [width, turning] = [short((2 * record.reach) / count), columns.get("speed").unit];
  return figureOf(
    "Spectrum, static frame", plot,
    `window of the words; largest line of each ${width} ${turning}; dashed: Ω = ${short(speed)} ${turning}`,
  );
}

function energyFigure(record, i) {
  const count = used(record.energy);
  const plot = overTime(record, i, [{ name: "energy", values: record.energy }], {
    label: told.labels.energy, log: spansDecades(record.energy.subarray(0, count)),
  });
  return figureOf("Energy of both bodies", plot, `mean of each of ${count} pieces of the run`);
}

// Powers span decades; negative ones are dashed.
function powerFigure(record, i) {
  const curves = [
    { name: "fed by friction", values: record.friction },
    { name: "fed by rotation", values: record.rotation },
    { name: "lost", values: record.lost },
  ];
  const [count, end] = [used(record.energy), valueOf("end_time", i)];
  const sizes = curves.flatMap(({ values }) => Array.from(values.subarray(0, count), Math.abs)).filter((v) => v > 0);
  const top = d3.max(sizes) ?? 1;
  const least = Math.max(d3.min(sizes) ?? 0.1 * top, POWER_DECADES * top);
  const range = [10 ** Math.floor(Math.log10(least)), 10 ** Math.ceil(Math.log10(1.5 * top))];
  const rows = (sign) => curves.flatMap(({ values, name }) =>
    middles(count, end).map((t, j) => ({ t, name, v: sign * values[j] >= range[0] ? sign * values[j] : NaN })));
  const look = { x: "t", y: "v", stroke: "name", strokeWidth: 1.2 };
  const names = curves.map((c) => c.name);
  const plot = Plot.plot({
    ...CHART,
    x: { label: told.labels.time, domain: [0, end || 1], ticks: 6 },
    y: decades(told.labels.power, range),
    color: { domain: names, range: ["var(--series-0)", "var(--second)", "var(--third)"], legend: true },
    marks: [
      Plot.ruleX([end - valueOf("window", i)], { strokeDasharray: "2 3" }),
      Plot.line(rows(1), look),
      Plot.line(rows(-1), { ...look, strokeDasharray: "3 2" }),
    ],
  });
  return figureOf(
    "What feeds it, and what it loses", plot,
    `mean power of each of ${count} pieces; lost: damping and impacts; dashed: taken out, not fed`,
  );
}
