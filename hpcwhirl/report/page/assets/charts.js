// The small figures of one case.

const LENGTHS = [[1, ""], [1e3, "m"], [1e6, "µ"], [1e9, "n"], [1e12, "p"]]
  .map(([factor, prefix]) => [factor, prefix + columns.get("gap").unit]);
const GAP_FITS = 0.2; // least size of an orbit, over the gap, to draw the gap's circle

function lengthUnit(largest) {
  return LENGTHS.find(([factor]) => largest * factor >= 0.1) ?? LENGTHS.at(-1);
}

const STROKES = told.series.map(({ stroke }) => stroke);
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

// A label of an axis, which ends with its SI unit, in the unit shown.
const labelShown = (label, si) => `${label.slice(0, label.lastIndexOf(","))}, ${unitShown(si)[0]}`;

const ZOOMS = [["+", "zoom in", 0.5], ["−", "zoom out", 2], ["whole", "show all", Infinity]];

// A chart drawn anew for the part that is dragged over; `draw` takes {x, y} of that
// part, or {} for all, and returns the plot. `both`: along y, too.
function zoomable(title, caption, draw, both) {
  let plot = draw({});
  const figure = figureOf(title, plot, caption);
  const ends = () => ({ x: plot.scale("x").domain, ...(both && { y: plot.scale("y").domain }) });
  const whole = ends();
  const bar = document.createElement("span");
  bar.className = "zoom";
  const show = (view) => {
    const next = draw(view);
    for (const name of ["role", "aria-label"]) next.setAttribute(name, plot.getAttribute(name));
    plot.replaceWith(next);
    plot = next;
    figure.dataset.zoom = short((whole.x[1] - whole.x[0]) / (ends().x[1] - ends().x[0]));
    listen(plot, both, show);
  };
  for (const [text, meaning, times] of ZOOMS) {
    const button = textElement("button", text);
    button.type = "button";
    button.setAttribute("aria-label", `${meaning}: ${title}`);
    button.addEventListener("click", () => {
      const [from, view] = [ends(), {}];
      for (const axis of Object.keys(whole)) view[axis] = around(from[axis], times, whole[axis]);
      show(view.x[0] === whole.x[0] && view.x[1] === whole.x[1] ? {} : view);
    });
    bar.append(button);
  }
  figure.firstChild.after(bar);
  listen(plot, both, show);
  return figure;
}

// An interval `times` as long about the same middle, within another.
function around([low, high], times, [least, most]) {
  const half = Math.min((times * (high - low)) / 2, (most - least) / 2);
  const middle = Math.min(Math.max((low + high) / 2, least + half), most - half);
  return [middle - half, middle + half];
}

const LEAST_DRAG = 6; // pixels

function listen(plot, both, show) {
  const svg = plot.tagName === "svg" ? plot : plot.querySelector("svg:last-of-type");
  const [x, y] = [plot.scale("x"), plot.scale("y")];
  const inside = ([px, py]) => [[px, x], [py, y]].map(([p, { range }]) => Math.min(Math.max(p, Math.min(...range)), Math.max(...range)));
  let [from, box] = [null, null];
  svg.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "touch" || event.button) return;
    from = inside(d3.pointer(event, svg));
    box = d3.select(svg).append("rect").attr("class", "dragged");
    addEventListener("pointerup", finish, { once: true });
  }, true); // before the tip, which keeps the event to itself
  svg.addEventListener("pointermove", (event) => {
    if (!from) return;
    const to = inside(d3.pointer(event, svg));
    const [ys, ye] = both ? [from[1], to[1]] : y.range;
    box.attr("x", Math.min(from[0], to[0])).attr("y", Math.min(ys, ye))
      .attr("width", Math.abs(to[0] - from[0])).attr("height", Math.abs(ye - ys));
  });
  const finish = (event) => {
    const [a, b] = [from, inside(d3.pointer(event, svg))];
    box.remove();
    from = null;
    if (Math.abs(a[0] - b[0]) < LEAST_DRAG) return;
    const ordered = (...ends) => ends.sort((p, q) => p - q);
    const across = ordered(x.invert(a[0]), x.invert(b[0]));
    if (!both) {
      show({ x: across });
      return;
    }
    const half = Math.max(across[1] - across[0], Math.abs(y.invert(a[1]) - y.invert(b[1]))) / 2;
    const middle = (p, q) => (p + q) / 2;
    const [mx, my] = [middle(...across), middle(y.invert(a[1]), y.invert(b[1]))];
    show({ x: [mx - half, mx + half], y: [my - half, my + half] }); // circles stay round
  };
  svg.addEventListener("dblclick", () => show({}));
}

const TIP = { fill: "var(--raised)", stroke: "var(--edge)", fontSize: 12 };

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
        strokeDasharray: "4 3", stroke: "currentColor", clip: true,
      })]
    : [];
  const [across, up] = frame === "static" ? ["X", "Y"] : ["x", "y"];
  const scale = (label) => ({ label: `${label}, ${unit}`, ticks: 5 });
  const end = 1e3 * valueOf("end_time", i);
  const tip = (p, j) => [
    `${across} = ${short(factor * p[x])}, ${up} = ${short(factor * p[y])} ${unit}`,
    `|Z| = ${short(factor * Math.hypot(p.x, p.y))} ${unit}`,
    `t = ${(end - 1e3 * record.step * (late.length - 1 - j)).toFixed(2)} ms`,
  ].join("\n");
  const draw = (view) => Plot.plot({
    width: 300, height: 300, marginLeft: 46, marginBottom: 40, marginRight: 10, marginTop: 20,
    x: { ...scale(across), domain: view.x ?? [-side, side] },
    y: { ...scale(up), domain: view.y ?? [-side, side] },
    marks: [
      ...circle,
      Plot.line(early, { ...spot, stroke: "var(--pale)", strokeWidth: 1, clip: true }),
      Plot.line(late, { ...spot, stroke: "var(--series-0)", strokeWidth: 1, clip: true }),
      Plot.dot(late.slice(-1), { ...spot, fill: "var(--series-0)", r: 3, clip: true }),
      Plot.tip(late, Plot.pointer({ ...spot, title: tip, ...TIP })),
    ],
  });
  const milliseconds = short(1e3 * record.step * Math.max(drawn.length - 1, 0));
  const circled = withGap ? "dashed: the gap" : `the gap, ${short(factor * gap)} ${unit}, lies outside`;
  return zoomable(
    `Orbit, ${frame} frame`,
    `last ${milliseconds} ms, ${drawn.length} points ${short(1e3 * record.step)} ms apart; ` +
      `dot: the end; ${circled}`,
    draw, true,
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
    y: log ? decades(label, d3.extent(rows.filter((r) => r.v > 0), (r) => r.v)) : { label, tickFormat: rounded, ticks: 5, grid: true },
    color: { domain: names, range: STROKES.slice(0, names.length), legend: names.length > 1 },
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
    y: log ? decades(`|Z|, ${unit}`, ends) : { label: `|Z|, ${unit}`, ticks: 5, tickFormat: rounded, grid: true, zero: true },
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
  const [turning, scaled] = unitShown(columns.get("speed").unit);
  const [speed, reach] = [scaled * valueOf("speed", i), scaled * record.reach];
  const rows = Array.from(record.lines, (v, j) => ({
    w: ((j + 0.5) / count) * 2 * reach - reach, v: factor * v,
  })).filter((r) => r.v > 0);
  const top = d3.max(rows, (r) => r.v) ?? 1;
  const orders = speed ? (r) => ` = ${(r.w / speed).toFixed(2)} Ω` : () => "";
  const tip = (r) => `${short(r.w)} ${turning}${orders(r)}\n${short(r.v)} ${unit}`;
  const draw = (view) => Plot.plot({
    ...CHART,
    x: {
      label: `${labelShown(told.labels.line_frequency, columns.get("speed").unit)}; right of 0 anticlockwise`,
      domain: view.x ?? [-reach || -1, reach || 1], ticks: 5,
    },
    y: { ...decades(`line of Z, ${unit}`, [1e-4 * top, 2 * top]), clamp: true },
    marks: [
      Plot.ruleX([0], { clip: true }),
      Plot.ruleX([speed], { strokeDasharray: "4 3", clip: true }),
      Plot.line(rows, { x: "w", y: "v", stroke: "var(--series-0)", curve: "step", strokeWidth: 1.2, clip: true }),
      Plot.tip(rows, Plot.pointerX({ x: "w", y: "v", title: tip, ...TIP })),
    ],
  });
  const width = short((2 * reach) / count);
  return zoomable(
    "Spectrum, static frame",
    `window of the words; largest line of each ${width} ${turning}; dashed: Ω = ${exact(speed)} ${turning}`,
    draw, false,
  );
}

function energyFigure(record, i) {
  const count = used(record.energy);
  const plot = overTime(record, i, [{ name: "energy", values: record.energy }], {
    label: told.labels.energy, log: spansDecades(record.energy.subarray(0, count)),
  });
  return figureOf("Energy of both bodies", plot, `mean of each of ${count} pieces of the run`);
}

// Some sixteen points of each curve, at places that the others leave free.
const spacedRows = (rows, names) => {
  const times = [...new Set(rows.map((r) => r.t))].sort((a, b) => a - b);
  const every = Math.max(names.length, Math.ceil(times.length / 16));
  const place = new Map(times.map((t, j) => [t, j % every]));
  const own = new Map(names.map((name, n) => [name, Math.floor((n * every) / names.length)]));
  return rows.filter((r) => place.get(r.t) === own.get(r.name) && Number.isFinite(r.v));
};

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
    color: { domain: names, range: STROKES },
    symbol: { domain: names, range: ["circle", "square", "triangle"], legend: true },
    marks: [
      Plot.ruleX([end - valueOf("window", i)], { strokeDasharray: "2 3" }),
      Plot.line(rows(1), look),
      Plot.line(rows(-1), { ...look, strokeDasharray: "3 2" }),
      Plot.dot(spacedRows([...rows(1), ...rows(-1)], names), { ...look, symbol: "name", fill: "var(--ground)", r: 3 }),
    ],
  });
  return figureOf(
    "What feeds it, and what it loses", plot,
    `mean power of each of ${count} pieces; lost: damping and impacts; dashed: taken out, not fed`,
  );
}
