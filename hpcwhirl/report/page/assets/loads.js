// Loads of the shaft: force of each support on the rotor, torque of the drive.

const SYMBOLS = ["circle", "square", "triangle", "diamond", "star", "cross", "wye"];

function loadFigures(i) {
  const loads = told.loads[i];
  if (!loads) return null;
  const values = new Float32Array(bytesOf(loads.data));
  const rows = Array.from({ length: loads.supports.length + 2 }, (_, j) =>
    Array.from(values.subarray(j * loads.count, (j + 1) * loads.count), (v) => (Number.isFinite(v) ? v : NaN)));
  const block = document.createElement("div");
  block.className = "figures loads";
  block.append(forceFigure(i, loads.supports, rows), torqueFigure(i, ...rows.slice(-2)));
  return block;
}

function forceFigure(i, names, rows) {
  const [unit, factor] = unitShown("N");
  const end = valueOf("end_time", i);
  const times = middles(rows[0].length, end);
  const points = names.flatMap((name, j) => times.map((t, n) => ({ t, name, v: factor * rows[j][n] })));
  const look = { x: "t", y: "v", stroke: "name", strokeWidth: 1.2 };
  const plot = Plot.plot({
    ...CHART,
    x: { label: told.labels.time, domain: [0, end || 1], ticks: 6 },
    y: { label: `force on the rotor, ${unit}`, tickFormat: rounded, ticks: 5, grid: true, zero: true },
    color: { domain: names, range: names.map((_, j) => STROKES[j % STROKES.length]) },
    symbol: { domain: names, range: names.map((_, j) => SYMBOLS[j % SYMBOLS.length]), legend: true },
    marks: [
      Plot.ruleX([end - valueOf("window", i)], { strokeDasharray: "2 3" }),
      Plot.line(points, look),
      Plot.dot(spacedRows(points, names), { ...look, symbol: "name", fill: "var(--ground)", r: 3 }),
    ],
  });
  const peaks = names.map((name, j) => `${name} ${short(factor * d3.max(rows[j]))}`);
  return figureOf("Force of each support", plot,
    `largest of each of ${rows[0].length} pieces of the run; at most, ${unit}: ${peaks.join(", ")}`);
}

function torqueFigure(i, least, largest) {
  const [unit, factor] = unitShown("N m");
  const end = valueOf("end_time", i);
  const rows = middles(least.length, end).map((t, n) => ({ t, low: factor * least[n], high: factor * largest[n] }));
  if (!rows.some(({ high }) => Number.isFinite(high)))
    return textElement("p", "The torque of the drive is not known: the engine's file lacks the load of a changing speed.", "note");
  const plot = Plot.plot({
    ...CHART,
    x: { label: told.labels.time, domain: [0, end || 1], ticks: 6 },
    y: { label: `torque on the rotor, ${unit}`, tickFormat: rounded, ticks: 5, grid: true, zero: true },
    marks: [
      Plot.ruleX([end - valueOf("window", i)], { strokeDasharray: "2 3" }),
      Plot.ruleY([0]),
      Plot.areaY(rows, { x: "t", y1: "low", y2: "high", fill: "var(--series-0)", fillOpacity: 0.45, stroke: "var(--series-0)", strokeWidth: 0.8 }),
    ],
  });
  const most = d3.max(rows, ({ low, high }) => Math.max(Math.abs(low), Math.abs(high)));
  return figureOf("Torque of the drive", plot,
    `least and largest of each of ${rows.length} pieces of the run, anticlockwise > 0; at most ${short(most)} ${unit}`);
}
