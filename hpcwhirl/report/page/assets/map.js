// The map: cells to scale, or points where the design is no grid.

const MOST_LETTERS = 300;
const MOST_WORD = 20; // characters of a panel's name
const WHIRL_MARKS = { forward: "▲", backward: "▼", mixed: "●", none: "" };

// {fill(i), ink(i), legend()} of what colours the cells.
function colouring(name, shown) {
  if (name === "regime") return { ...byWords((i) => words.shown[i], told.looks, shown), letter: letters };
  if (name === "whirl") return { ...byWords((i) => words.whirl[i], told.whirls, shown), isWhirl: true };
  const column = columns.get(name);
  const title = withUnitShown(name, column.unit);
  const factor = unitShown(column.unit)[1];
  const numbers = shown.map((i) => column.value(i)).filter(Number.isFinite);
  const [low, high] = d3.extent(numbers);
  if (low === undefined) return byWords((i) => words.shown[i], told.looks, shown);
  const scale = scaleFor(numbers, low, high);
  const of = Plot.scale({ color: scale });
  const fill = (i) => {
    const v = column.value(i);
    const known = Number.isFinite(v) && (scale.type !== "log" || v > 0);
    return known ? of.apply(v) : told.looks[words.shown[i]].colour;
  };
  return {
    fill,
    ink: (i) => (d3.lab(fill(i)).l > 55 ? "black" : "white"),
    legend: () => Plot.legend({ color: { ...scale, label: title }, width: 320, tickFormat: (v) => short(factor * v) }),
  };
}

function scaleFor(numbers, low, high) {
  if (low < 0 && high > 0) {
    const most = Math.max(-low, high);
    return { type: "diverging", scheme: "puor", domain: [-most, most], pivot: 0 };
  }
  const positive = numbers.filter((v) => v > 0);
  const least = d3.min(positive);
  if (low >= 0 && least !== undefined && d3.quantile(positive, 0.9) / least > 1000)
    return { type: "log", scheme: "cividis", domain: [least, high] };
  return { type: "linear", scheme: "cividis", domain: low < high ? [low, high] : [low - 1, low + 1] };
}

function byWords(word, looks, shown) {
  const counts = d3.rollup(shown, (v) => v.length, word);
  return {
    fill: (i) => looks[word(i)].colour,
    ink: (i) => looks[word(i)].ink,
    letter: (i) => looks[word(i)].letter,
    counts: Object.keys(looks)
      .filter((name) => counts.has(name))
      .map((name) => ({ name, look: looks[name], count: counts.get(name) })),
  };
}

// The letter of the word a case is coloured by, and its own where twins have another.
function letters(i) {
  const [most, own] = [words.shown[i], words.own[i]].map((word) => told.looks[word].letter);
  return most === own ? most : `${most}(${own})`;
}

// Cases at the same place share its cell, side by side.
function sharedCells(shown, keyOf) {
  const cells = d3.group(shown, keyOf);
  const part = new Map();
  for (const group of cells.values())
    group.forEach((i, j) => part.set(i, [j / group.length, (j + 1) / group.length]));
  return { part, cells: cells.size };
}

function isGrid(shown, x, y) {
  const used = (axis) => new Set(shown.map(axis.level)).size;
  return used(x) * used(y) <= Math.max(4 * shown.length, 16);
}

function cellMarks(shown, x, y, facet, colour) {
  const [px, py] = [placed(x), placed(y)];
  const { part } = sharedCells(
    shown,
    (i) => `${x.level(i)}|${y.level(i)}|${facet.fx?.(i)}|${facet.fy?.(i)}`,
  );
  const between = (edges, j, share) => {
    const [a, b] = [edges[j], edges[j + 1]];
    return px.scale.type === "log" ? a * (b / a) ** share : a + (b - a) * share;
  };
  const edge = (end) => (i) => between(px.edges, x.level(i), part.get(i)[end]);
  const middle = (i) => between(px.edges, x.level(i), (part.get(i)[0] + part.get(i)[1]) / 2);
  return [
    Plot.rect(shown, {
      ...facet,
      x1: edge(0),
      x2: edge(1),
      y1: (i) => py.edges[y.level(i)],
      y2: (i) => py.edges[y.level(i) + 1],
      fill: colour.fill,
      inset: shown.length <= 2000 ? 0.4 : 0,
      shapeRendering: shown.length <= 2000 ? undefined : "crispEdges",
    }),
    ...letterMarks(shown, middle, py.place, facet, colour),
  ];
}

function letterMarks(shown, x, y, facet, colour) {
  if (shown.length > MOST_LETTERS || !colour.letter) return [];
  const mark = colour.isWhirl ? () => "" : (i) => WHIRL_MARKS[words.whirl[i]];
  const text = (i) => [colour.letter(i), mark(i)].filter(Boolean).join("\n");
  const look = { fill: colour.ink, fontSize: 10, pointerEvents: "none" };
  return [Plot.text(shown, { ...facet, x, y, text, ...look })];
}

function pointMarks(shown, x, y, facet, colour) {
  const [px, py] = [placed(x), placed(y)];
  const r = Math.min(9, Math.max(2.5, 160 / Math.sqrt(shown.length)));
  const spot = { ...facet, x: px.place, y: py.place };
  const look = { fill: colour.fill, stroke: "currentColor", strokeWidth: 0.5, r };
  return [
    Plot.dot(shown, { ...spot, ...look }),
    ...letterMarks(shown, spot.x, spot.y, facet, colour),
  ];
}

function facetsOf(choice) {
  const facet = {};
  const scales = {};
  for (const [key, name] of [["fx", choice.across], ["fy", choice.down]]) {
    const axis = axisOf(name);
    if (!axis) continue;
    facet[key] = (i) => axis.level(i);
    scales[key] = {
      domain: d3.range(axis.levels.length),
      label: axis.title,
      tickFormat: (j) => cut(levelText(axis.levels[j], axis.factor), MOST_WORD),
    };
  }
  return { facet, scales };
}

const longest = (axis) =>
  d3.max(axis.levels, (level) => cut(levelText(level, axis.factor), MOST_WORD).length);

// Draw into `frame`; returns {plot, colour} with `data-case` on every cell.
function drawMap(frame, choice, shown) {
  const [x, y] = [axisOf(choice.x), axisOf(choice.y) ?? ONE];
  const colour = colouring(choice.colour, shown);
  const { facet, scales } = facetsOf(choice);
  const rows = axisOf(choice.down)?.levels.length ?? 1;
  const refined = isRefinedMap(x, y) ? refinedMarks(shown, x, y, facet, colour) : null;
  const plain = isGrid(shown, x, y) ? cellMarks : pointMarks;
  const { marks, cases } = refined ?? { marks: plain(shown, x, y, facet, colour), cases: shown };
  const scaled = (axis, ...ends) => (refined?.boxes.length ? fitted(axis, ends, refined.boxes) : placed(axis).scale);
  const tall = y === ONE ? 110 : Math.min(460, Math.max(160, 60 + 48 * y.levels.length));
  const plot = Plot.plot({
    width: Math.max(frame.clientWidth, 320),
    height: Math.max(rows * (rows > 1 ? 170 : tall), tall) + 50,
    marginLeft: y.numeric ? 62 : 110,
    marginBottom: 40,
    marginRight: choice.down ? 40 + 6.5 * longest(axisOf(choice.down)) : 16,
    x: scaled(x, "x1", "x2"),
    y: { ...scaled(y, "y1", "y2"), reverse: false },
    color: { type: "identity" },
    ...scales,
    marks,
  });
  plot.setAttribute("aria-hidden", "true");
  frame.replaceChildren(plot);
  for (const cell of cellsOf(plot)) {
    const i = cases[cell.__data__];
    cell.dataset.case = i;
    cell.dataset.word = words.shown[i];
    cell.dataset.whirl = words.whirl[i];
    cell.classList.toggle("unsure", isUnsure(i));
  }
  hatchGrowing(plot);
  return { plot, colour, refined: Boolean(refined) };
}

// Lay a hatch over the cells of cases whose free motion grows without contact.
function hatchGrowing(plot) {
  const growing = [...cellsOf(plot)].filter((cell) => isGrowing(Number(cell.dataset.case)));
  if (!growing.length) return;
  const pattern = d3.select(plot).append("defs").append("pattern");
  pattern.attr("id", "growing").attr("patternUnits", "userSpaceOnUse").attr("width", 7).attr("height", 7);
  pattern.append("path").attr("d", "M-1,8 8,-1").attr("stroke", "var(--growing)").attr("stroke-width", 1.2);
  for (const cell of growing) {
    const hatch = document.createElementNS(cell.namespaceURI, cell.tagName);
    for (const name of ["x", "y", "width", "height", "cx", "cy", "r"])
      if (cell.hasAttribute(name)) hatch.setAttribute(name, cell.getAttribute(name));
    hatch.setAttribute("class", "growing");
    hatch.setAttribute("fill", "url(#growing)");
    hatch.setAttribute("pointer-events", "none");
    cell.after(hatch);
  }
}

const ONE = { name: "", title: "", levels: [""], level: () => 0, numeric: false };

const cellsOf = (plot) => plot.querySelectorAll("[aria-label=rect] rect:not(.growing), [aria-label=dot] circle:not(.growing)");
