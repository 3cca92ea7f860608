// The wheel in motion: blades, casing, gap, contact forces and the centre's trail.
// All displacements, and the gap, are enlarged by one factor about the undeformed tips.

const motions = JSON.parse(element("motions").textContent);
const RATES = [[0.001, "1/1000"], [0.003, "1/300"], [0.01, "1/100"], [0.03, "1/30"], [0.1, "1/10"]];
const RADIUS = 0.385; // of the wheel / side of the canvas
const AROUND = 240; // points of the casing's line
const TRAIL = 90; // frames of the centre's trail
const still = matchMedia("(prefers-reduced-motion: reduce)");
// The canvas has its colours from the page's style, by day, by night and in print.
let redraw = () => {};
for (const media of ["print", "(prefers-color-scheme: dark)"])
  matchMedia(media).addEventListener("change", () => redraw());

function framesOf(i) {
  const m = motions[i];
  const buffer = bytesOf(m.data);
  const { frames, blades, orders } = m;
  let at = 0;
  const floats = (count) => {
    const part = new Float32Array(buffer, at, count);
    at += 4 * count;
    return part;
  };
  const steps = (count, scale) => {
    const part = Float32Array.from(new Int16Array(buffer, at, count), (v) => (v * scale) / 32767);
    at += 2 * count;
    return part;
  };
  const [gap, angle] = [floats(frames), floats(frames)];
  const [centre, tips, wall, force] = [2, 2 * blades, 2 * orders, blades].map((wide, j) => steps(frames * wide, m.scales[j]));
  return { ...m, gap, angle, centre, tips, wall, force };
}

function wallAt(m, n, theta) {
  let sum = m.gap[n];
  for (let h = 0; h < m.orders; h += 1) {
    const j = 2 * (n * m.orders + h);
    sum += m.wall[j] * Math.cos(h * theta) + m.wall[j + 1] * Math.sin(h * theta);
  }
  return sum;
}

// Places of a blade from hub to tip, rotated by `turn`: a clamped beam bent by its tip.
// Tangential displacements are drawn along circles: along tangents, an enlarged one
// would carry the tip through the casing.
function bladeOf(m, n, j, { radius, scale, turn }) {
  const theta = turn + (2 * Math.PI * j) / m.blades;
  const [c, s] = [Math.cos(theta), Math.sin(theta)];
  const k = 2 * (n * m.blades + j);
  const [radial, side] = [scale * m.tips[k], scale * m.tips[k + 1]];
  const [x, y] = centreAt(m, n, scale, turn);
  const [along, across] = [x * c + y * s, y * c - x * s];
  const hub = radius * Math.max(m.hub / m.radius, 0.16);
  return Array.from({ length: 9 }, (_, p) => {
    const z = p / 8;
    const bent = (z * z * (3 - z)) / 2;
    const place = hub + z * (radius - hub);
    const r = place + along + (radial - along) * z;
    const at = theta + (across + (side - across) * bent) / place;
    return [r * Math.cos(at), r * Math.sin(at)];
  });
}

// The centre's displacement in the drawn frame, pixels; `turn` is where blade 0 is drawn.
function centreAt(m, n, scale, turn) {
  const back = turn - m.angle[n];
  const [x, y] = [scale * m.centre[2 * n], scale * m.centre[2 * n + 1]];
  return [x * Math.cos(back) - y * Math.sin(back), x * Math.sin(back) + y * Math.cos(back)];
}

function path(pen, points, closed = false) {
  pen.beginPath();
  points.forEach(([x, y], p) => (p ? pen.lineTo(x, -y) : pen.moveTo(x, -y)));
  if (closed) pen.closePath();
  pen.stroke();
}

function drawFrame(canvas, m, n, view) {
  const pen = canvas.getContext("2d");
  const size = canvas.width;
  const style = getComputedStyle(canvas);
  const colour = (name) => style.getPropertyValue(name).trim() || "currentColor";
  const radius = RADIUS * size;
  const scale = view.scale * radius;
  const turn = view.rotating ? 0 : m.angle[n];
  const geometry = { radius, scale, turn };
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.clearRect(0, 0, size, size);
  pen.translate(size / 2, size / 2);
  pen.lineJoin = "round";
  pen.lineWidth = size / 260;
  pen.strokeStyle = colour("--quiet");
  const casing = Array.from({ length: AROUND }, (_, p) => {
    const theta = (2 * Math.PI * p) / AROUND;
    const r = radius + scale * wallAt(m, n, theta);
    const drawn = theta + turn - m.angle[n];
    return [r * Math.cos(drawn), r * Math.sin(drawn)];
  });
  path(pen, casing, true);
  const most = m.scales[3] || 1;
  for (let j = 0; j < m.blades; j += 1) {
    if (j === m.lost) continue;
    const blade = bladeOf(m, n, j, geometry);
    pen.strokeStyle = colour(j ? "--series-0" : "--series-2");
    pen.lineWidth = size / 200;
    path(pen, blade);
    const force = m.force[n * m.blades + j];
    if (force > 0) drawForce(pen, blade[8], Math.sqrt(force / most), size, colour("--touch"));
  }
  const [x, y] = centreAt(m, n, scale, turn);
  const hub = radius * Math.max(m.hub / m.radius, 0.16);
  pen.strokeStyle = colour("--series-0");
  pen.beginPath();
  pen.arc(x, -y, hub, 0, 2 * Math.PI);
  pen.stroke();
  pen.strokeStyle = colour("--series-2");
  pen.lineWidth = size / 400;
  path(pen, d3.range(Math.max(0, n - TRAIL), n + 1).map((k) => centreAt(m, k, scale, view.rotating ? 0 : m.angle[k])));
  pen.fillStyle = colour("--ink");
  pen.beginPath();
  pen.arc(x, -y, size / 110, 0, 2 * Math.PI);
  pen.fill();
}

// A contact: a dot at the tip, and an inward line whose length is the force's root.
function drawForce(pen, [x, y], share, size, colour) {
  const r = Math.hypot(x, y);
  const [c, s] = [x / r, y / r];
  pen.strokeStyle = pen.fillStyle = colour;
  pen.lineWidth = size / 170;
  path(pen, [[x, y], [x - 0.13 * size * share * c, y - 0.13 * size * share * s]]);
  pen.beginPath();
  pen.arc(x, -y, size / 85, 0, 2 * Math.PI);
  pen.fill();
}

function labelled(label, control) {
  const frame = textElement("label", `${label} `);
  frame.append(control);
  return frame;
}

function motionBox(i) {
  if (!motions[i]) return null;
  const m = framesOf(i);
  const box = document.createElement("figure");
  box.className = "motion";
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 900;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `The wheel in its casing, case ${i}, ${m.frames} frames`);
  const view = { n: 0, scale: m.scale, rotating: false, rate: 0.01, plays: false };
  const play = textElement("button", "Play");
  play.type = "button";
  play.className = "play";
  const slider = Object.assign(document.createElement("input"), { type: "range", min: 0, max: m.frames - 1, step: 1, value: 0 });
  slider.setAttribute("aria-label", "frame");
  const rate = document.createElement("select");
  for (const [value, text] of RATES) rate.append(new Option(`${text} of real time`, value, false, value === view.rate));
  const frame = document.createElement("select");
  for (const text of ["static frame", "rotating frame"]) frame.append(new Option(text));
  const larger = Object.assign(document.createElement("input"), { type: "range", min: -1, max: 1, step: 0.02, value: 0 });
  const first = view.scale;
  const note = textElement("figcaption", "");
  const [unit, factor] = unitShown("N");
  const most = `${short(factor * m.scales[3])} ${unit}`;
  const show = () => {
    drawFrame(canvas, m, view.n, view);
    slider.value = view.n;
    box.dataset.frame = view.n;
    const time = (1e3 * (m.start + view.n * m.step)).toFixed(2);
    note.textContent = `t = ${time} ms; displacements and gap × ${short(view.scale * m.radius)}; `
      + `red: contact, length by the root of the force, at most ${most}; green: blade 0 and the centre's path`;
    slider.setAttribute("aria-valuetext", `${time} ms`);
    larger.setAttribute("aria-valuetext", `× ${short(view.scale * m.radius)}`);
  };
  let last = 0;
  let part = 0;
  const tick = (now) => {
    if (!box.isConnected) view.plays = false;
    if (!view.plays) return;
    part += (view.rate * Math.min(now - last, 100)) / (1e3 * m.step);
    last = now;
    if (part >= 1) {
      view.n = (view.n + Math.floor(part)) % m.frames;
      part %= 1;
      show();
    }
    requestAnimationFrame(tick);
  };
  const set = (plays) => {
    view.plays = plays;
    play.textContent = plays ? "Pause" : "Play";
    play.setAttribute("aria-pressed", String(plays));
    last = performance.now();
    if (plays) requestAnimationFrame(tick);
  };
  play.addEventListener("click", () => set(!view.plays));
  slider.addEventListener("input", () => {
    set(false);
    view.n = Number(slider.value);
    show();
  });
  rate.addEventListener("change", () => (view.rate = Number(rate.value)));
  frame.addEventListener("change", () => {
    view.rotating = frame.selectedIndex === 1;
    show();
  });
  larger.addEventListener("input", () => {
    view.scale = first * 10 ** Number(larger.value);
    show();
  });
  const controls = document.createElement("p");
  controls.className = "controls";
  controls.append(play, slider, rate, frame, labelled("enlarged", larger));
  box.append(heading("h4", "The wheel in motion"), canvas, controls, note);
  redraw = show;
  requestAnimationFrame(() => {
    show();
    if (!still.matches) set(true);
  });
  return box;
}

// What shows a case's wheel here, of one that has none.
function motionCommand(i) {
  if (motions[i] || valueOf("status", i) !== "ok") return [];
  return [commandBlock("The wheel in motion", `hpcwhirl report DIR --animate ${i}`)];
}

// Which cases have their motion here, for the head of the page.
function motionNote() {
  const cases = Object.keys(motions);
  return cases.length ? `the wheel in motion: case ${cases.join(", ")}` : "";
}
