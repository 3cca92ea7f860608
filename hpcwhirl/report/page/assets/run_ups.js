// Cases whose speed changes: the speed over time with the words, and a waterfall.

const runUpOf = (i) => told.runUps[i] ?? null;

// "370 → 550", or "370 → 550 → 200" where the speed turns, in the unit shown.
function rangeOf({ speed }) {
  const factor = unitShown(columns.get("speed").unit)[1];
  const turns = speed.filter((v, j) =>
    j === 0 || j === speed.length - 1 || (v - speed[j - 1]) * (speed[j + 1] - v) < 0);
  return turns.slice(0, 5).map((v) => short(factor * v, 6)).join(" → ");
}

function speedFigure(i) {
  const run = runUpOf(i);
  const si = columns.get("speed").unit;
  const [turning, factor] = unitShown(si);
  const rows = run.time.map((t, j) => ({ t, v: factor * run.speed[j] }));
  const [low, high] = d3.extent(rows, (r) => r.v);
  const foot = low - 0.14 * (high - low || Math.abs(high) || 1);
  const spells = run.spells.map(([begin, end, , , regime, way]) => ({ begin, end, regime, way }));
  const wide = spells.filter(({ begin, end }) => end - begin > 0.04 * run.time.at(-1));
  const band = { x1: "begin", x2: "end", y1: foot, y2: low - 0.04 * (high - low || 1) };
  const spot = { x: (s) => (s.begin + s.end) / 2, y: (band.y1 + band.y2) / 2 };
  const plot = Plot.plot({
    ...CHART,
    x: { label: told.labels.time, domain: [0, run.time.at(-1) || 1], ticks: 6 },
    y: { label: `Ω, ${turning}`, tickFormat: rounded, ticks: 5, grid: true },
    marks: [
      Plot.rect(spells, { ...band, fill: (s) => told.looks[s.regime].colour }),
      Plot.text(wide, { ...spot, text: (s) => told.looks[s.regime].letter, fill: (s) => told.looks[s.regime].ink }),
      Plot.line(rows, { x: "t", y: "v", stroke: "var(--series-0)", strokeWidth: 1.4 }),
      Plot.tip(rows, Plot.pointerX({ x: "t", y: "v", title: (r) => `${short(r.v)} ${turning} at ${short(r.t)} s: ${wordAt(spells, r.t)}`, ...TIP })),
    ],
  });
  const words = [...new Set(spells.map((s) => s.regime))].map((w) => `${told.looks[w].letter} ${told.looks[w].told}`);
  return figureOf("Speed over time", plot, `below: the words of windows of the run; ${words.join(", ")}`);
}

function wordAt(spells, t) {
  const { regime, way } = spells.find((s) => t <= s.end) ?? spells.at(-1);
  return way === "none" ? told.looks[regime].told : `${told.looks[regime].told}, ${way}`;
}

function waterfallFigure(i) {
  const fall = runUpOf(i).waterfall;
  if (!fall) return null;
  const [turning, factor] = unitShown(columns.get("speed").unit);
  const values = new Uint8Array(bytesOf(fall.data));
  const [size, unit] = lengthUnit(fall.top);
  const reach = factor * fall.reach;
  const at = (x, y) => {
    const column = Math.min(Math.floor(((x - fall.from) / (fall.to - fall.from)) * fall.columns), fall.columns - 1);
    const row = Math.min(Math.floor(((y + reach) / (2 * reach)) * fall.rows), fall.rows - 1);
    return values[row * fall.columns + column];
  };
  const run = runUpOf(i);
  const own = run.time.map((t, j) => ({ t, v: factor * run.speed[j] })).filter(({ t }) => t >= fall.from && t <= fall.to);
  const line = { x: "t", stroke: "white", strokeDasharray: "4 3", strokeWidth: 1 };
  const plot = Plot.plot({
    ...CHART,
    x: { label: told.labels.time, ticks: 6 },
    y: { label: labelShown(told.labels.line_frequency, columns.get("speed").unit), ticks: 6, tickFormat: rounded },
    color: { type: "linear", scheme: "cividis", domain: [0, 255] },
    marks: [
      Plot.raster(values, {
        width: fall.columns, height: fall.rows, x1: fall.from, x2: fall.to, y1: -reach, y2: reach,
        imageRendering: "pixelated",
      }),
      Plot.line(own, { ...line, y: "v" }),
      Plot.line(own, { ...line, y: (r) => -r.v }),
      Plot.tip(own, Plot.pointerX({ x: "t", y: "v", title: (r) => `${short(r.t)} s, Ω = ${short(r.v)} ${turning}\nline at Ω: ${lineSize(at(r.t, r.v), fall, size)} ${unit}`, ...TIP })),
    ],
  });
  return figureOf("Waterfall, static frame", plot,
    `spectra over time; brightest ${short(size * fall.top)} ${unit}, darkest 1e-${fall.decades} of it or less; dashed: Ω and −Ω`);
}

const lineSize = (code, { top, decades: count }, factor) => sized(factor * top * 10 ** (count * (code / 255 - 1)));
