// Maps of refined campaigns: cells at their own sizes, boundaries and speckle, as map.png.

const SPECKLE = [0.25, 0.75]; // places of its dots, of the width of a cell

const isRefined = (axis) => Boolean(told.refined?.over.includes(axis.name));
const isRefinedMap = (x, y) => isRefined(x) || isRefined(y);

// Of the corners of cells, last refined input fastest: the place of an input in the number.
const cornerBit = (name) => 1 << (told.refined.over.length - 1 - told.refined.over.indexOf(name));

// From where to where a corner is the nearest one along an axis; null if that is unknown.
function nearestTo(axis, corners, j) {
  const own = corners[j];
  if (!isRefined(axis)) return placed(axis).edges.slice(axis.level(own), axis.level(own) + 2);
  const mate = corners[j ^ cornerBit(axis.name)];
  if (mate < 0) return null;
  const [a, b] = [own, mate].map((i) => axis.levels[axis.level(i)]);
  const middle = axis.log ? Math.sqrt(a * b) : (a + b) / 2;
  return [Math.min(a, middle), Math.max(a, middle)];
}

// [{i, cell, x1, x2, y1, y2}]: the part of each cell that is nearest to one of its cases.
// A plane between two cells is that of the upper one, but for the last plane.
function refinedBoxes(shown, x, y) {
  const wanted = new Set(shown);
  const hidden = told.refined.over.filter((name) => name !== x.name && name !== y.name);
  const isLast = (name, i) => axisOf(name).level(i) === axisOf(name).levels.length - 1;
  const boxes = [];
  told.refined.corner.forEach((corners, cell) => {
    corners.forEach((i, j) => {
      if (!wanted.has(i)) return;
      if (hidden.some((name) => j & cornerBit(name) && !isLast(name, i))) return;
      const [across, up] = [x, y].map((axis) => nearestTo(axis, corners, j));
      if (across && up) boxes.push({ i, cell, x1: across[0], x2: across[1], y1: up[0], y2: up[1] });
    });
  });
  return boxes;
}

// White dots in cells whose words are chance.
function speckleDots(boxes) {
  const own = d3.group(boxes.filter(({ cell }) => told.refined.speckle[cell]), (box) => box.cell);
  return Array.from(own.values()).flatMap((parts) => {
    const [across, up] = [["x1", "x2"], ["y1", "y2"]].map(([low, high]) => [
      d3.min(parts, (p) => p[low]), d3.max(parts, (p) => p[high]),
    ]);
    const at = ([a, b], share) => a + (b - a) * share;
    return SPECKLE.flatMap((s) => SPECKLE.map((t) => ({ i: parts[0].i, x: at(across, s), y: at(up, t) })));
  });
}

// Boundaries of what is on the axes: lines of two refined inputs, bars of one.
function boundaryLines(shown, x, y, of) {
  const { over, panelOf, boundaries } = told.refined;
  const { at, points, lines } = boundaries[of] ?? boundaries.regime;
  const first = new Map(shown.map((i) => [panelOf[i], i]).reverse());
  const known = (p) => first.has(points[p]);
  if (over.length === 2 && isRefined(x) && isRefined(y))
    return lines.filter(([p]) => known(p)).map(([p, q]) => ({
      i: first.get(points[p]), x1: at[x.name][p], x2: at[x.name][q], y1: at[y.name][p], y2: at[y.name][q],
    }));
  if (over.length === 1 && isRefined(x))
    return points.flatMap((panel, p) => {
      if (!known(p)) return [];
      const [i, edges] = [first.get(panel), placed(y).edges];
      return [{ i, x1: at[x.name][p], x2: at[x.name][p], y1: edges[y.level(i)], y2: edges[y.level(i) + 1] }];
    });
  return [];
}

const MOST_LARGE = 800; // boxes: beyond, dots of speckle are smaller

function refinedMarks(shown, x, y, facet, colour) {
  const boxes = refinedBoxes(shown, x, y);
  const of = Object.fromEntries(Object.entries(facet).map(([key, at]) => [key, (d) => at(d.i)]));
  const ends = { x1: "x1", x2: "x2", y1: "y1", y2: "y2" };
  const marks = [
    Plot.rect(boxes, { ...of, ...ends, fill: (d) => colour.fill(d.i), shapeRendering: "crispEdges" }),
    Plot.text(speckleDots(boxes), {
      ...of, x: "x", y: "y", text: () => "•", fontSize: boxes.length < MOST_LARGE ? 9 : 6, fill: "white",
      stroke: "black", strokeOpacity: 0.4, strokeWidth: 1, pointerEvents: "none",
    }),
    Plot.link(boundaryLines(shown, x, y, colour.isWhirl ? "whirl" : "regime"), {
      ...of, ...ends, stroke: "black", strokeWidth: 1.2, pointerEvents: "none",
    }),
  ];
  return { marks, cases: boxes.map((d) => d.i), boxes };
}

// An axis as long as what is drawn along it.
function fitted(axis, ends, boxes) {
  const { scale } = placed(axis);
  const [low, high] = ends;
  const domain = [d3.min(boxes, (d) => d[low]), d3.max(boxes, (d) => d[high])];
  return domain[0] < domain[1] ? { ...scale, domain } : scale;
}
