// The page: what is chosen, and everything that follows from it.

const choice = { ...firstChoice(), colour: "regime" };
const firstAxes = { ...choice };
const at = Object.fromEntries(axes.map((axis) => [axis.name, 0]));
const state = { chosen: 0, page: 0, list: "all", matches: () => true, drawn: null, shown: [],
  sort: { by: "", down: false } };

const mapPlace = element("map");

function chooser(label, id, options, value, change) {
  const frame = textElement("label", `${label} `);
  const select = document.createElement("select");
  select.id = id;
  for (const [name, text] of options) select.append(new Option(text, name, false, String(name) === String(value)));
  select.addEventListener("change", () => change(select.value));
  frame.append(select);
  return frame;
}

const numbersToColour = [...columns.values()].filter(
  (c) => !c.isWord && c.name !== "record" && !c.name.startsWith("level of "),
);

function drawChoosers() {
  const names = axes.map((axis) => [axis.name, axis.title]);
  const panels = [["", "none"], ...axes.filter((a) => a.levels.length > 1 && a.levels.length <= MOST_PANELS).map((a) => [a.name, a.title])];
  const set = (key) => (value) => {
    const before = choice[key];
    for (const other of ["x", "y", "across", "down"])
      if (other !== key && value && choice[other] === value) choice[other] = ["x", "y"].includes(other) ? before || firstFree() : "";
    choice[key] = value;
    drawAll();
    setAddress();
  };
  const colours = [["regime", "regime"], ["whirl", "whirl"], ...numbersToColour.map((c) => [c.name, withUnitShown(c.name, c.unit)])];
  element("choosers").replaceChildren(
    chooser("across", "choose-x", names, choice.x, set("x")),
    chooser("up", "choose-y", names, choice.y, set("y")),
    chooser("panels across", "choose-across", panels, choice.across, set("across")),
    chooser("panels down", "choose-down", panels, choice.down, set("down")),
    chooser("colour", "choose-colour", colours, choice.colour, set("colour")),
    ...leftOver(choice).map((axis) =>
      chooser(`at ${axis.title} =`, `at-${axis.name}`, [["all", "all"], ...axis.levels.map((v, j) => [j, cut(levelText(v, axis.factor), 30)])],
        at[axis.name], (value) => {
          at[axis.name] = value;
          drawAll();
        })),
  );
}

const firstFree = () => leftOver(choice)[0]?.name ?? "";

// Cases in the panels and at the values that the map shows.
function onMap() {
  const fixed = leftOver(choice).filter((axis) => at[axis.name] !== "all");
  return CASES.filter((i) => fixed.every((axis) => axis.level(i) === Number(at[axis.name])));
}

function drawAll() {
  drawChoosers();
  state.shown = onMap();
  const { plot, colour, refined } = drawMap(mapPlace, choice, state.shown);
  state.drawn = plot;
  state.cells = d3.group(cellsOf(plot), (cell) => Number(cell.dataset.case));
  drawLegend(colour);
  const unsure = state.shown.filter(isUnsure).length;
  const growing = state.shown.filter(isGrowing).length;
  const notes = [
    ...(refined ? [`black: boundary of ${choice.colour === "whirl" ? "whirl" : "regimes"}`, "white dots: speckle, where words are chance"] : []),
    ...(unsure ? [`pale: fewer than ${short(100 * told.sure)} % of twins have its word, ${counted(unsure)}`] : []),
    ...(growing ? [`hatched: free motion grows without contact, ${counted(growing)}`] : []),
  ];
  if (notes.length) element("legend").append(textElement("span", notes.join(" · "), "notes"));
  fade();
  mark();
  tellShown();
  drawList();
}

function drawLegend(colour) {
  const place = element("legend");
  if (!colour.counts) {
    place.replaceChildren(...[colour.legend()].filter(Boolean));
    return;
  }
  place.replaceChildren(
    ...colour.counts.map(({ name, look, count }) => {
      const button = document.createElement("button");
      button.type = "button";
      button.dataset.word = name;
      const swatch = textElement("span", look.letter, "swatch");
      swatch.style.background = look.colour;
      swatch.style.color = look.ink;
      swatch.setAttribute("aria-hidden", "true");
      button.append(swatch, `${look.told} ${count}`);
      button.title = "show these alone";
      button.addEventListener("click", () => setFilter(`${colour.isWhirl ? "whirl" : "word"} == '${name}'`));
      return button;
    }),
    textElement("span", colour.isWhirl ? "" : "▲ forward ▼ backward ● mixed"),
  );
}

function tellShown() {
  const fixed = leftOver(choice).filter((axis) => at[axis.name] !== "all");
  const where = fixed.map((axis) => `${axis.title} = ${levelText(axis.levels[at[axis.name]], axis.factor)}`).join(", ");
  const some = state.shown.length < CASES.length ? `${state.shown.length} of ${counted(CASES.length)}` : counted(CASES.length);
  element("shown").textContent = `${some}${where ? ` at ${where}` : ""}. Click a cell, or use the arrow keys.`;
}

// Filter

const FILTER_WORDS = {
  word: (i) => words.own[i],
  regime: (i) => words.regime[i],
  whirl: (i) => words.whirl[i],
  outcome: (i) => words.outcome[i],
  message: (i) => told.messages[i] ?? "",
};
const isVariable = (name) =>
  name === "case" || Object.hasOwn(FILTER_WORDS, name) ||
  (columns.has(name) && name !== "record" && !name.startsWith("level of "));
const filterValue = (name) =>
  name === "case" ? (i) => i : (FILTER_WORDS[name] ?? columns.get(name).value);

// An input may be named as in the file, as in the TOML, or by an ending of that.
function variableOf(name) {
  if (isVariable(name)) return name;
  const inputs = [...swept, ...told.inputs].filter(({ name: full }) => full === name || full.endsWith(`.${name}`));
  const found = [...new Set(inputs.map((input) => input.variable ?? input.name.split(".").pop()))].filter(isVariable);
  if (found.length > 1) refuse(`variable '${name}' may mean ${found.sort().join(", ")}: give one name`);
  if (!found.length) refuse(`unknown variable '${cutText(name)}'`);
  return found[0];
}

const FILTERED = {
  variable: variableOf,
  isText: (name) => Object.hasOwn(FILTER_WORDS, name) || Boolean(columns.get(name)?.isWord),
  words: told.words,
  units: Object.fromEntries([...columns.values()].map(({ name, unit }) => [name, unit || "1"])),
  factors: told.factors,
};

// What a filter that no case passes would select, were its plain numbers in the units
// that the page shows.
function unitRemark({ tree, plain }) {
  const numbers = [...plain].filter(([number, unit]) => told.shown[unit] && number[1]);
  if (!numbers.length) return "";
  for (const [number, unit] of numbers) number[1] /= told.shown[unit][1];
  const count = CASES.filter((i) => compile(tree, filterValue)(i) === true).length;
  if (!count) return "";
  const units = [...new Set(numbers.map(([, unit]) => unit))].join(" and ");
  const written = numbers.map(([number, unit]) => `${number.text} ${told.shown[unit][0]}`).join(" and ");
  return `; plain numbers are in SI, here in ${units}; with ${written} it selects ${counted(count)}`;
}

function setFilter(text) {
  element("filter").value = text;
  applyFilter();
}

function applyFilter() {
  const text = element("filter").value.trim();
  try {
    const found = text ? checked(parse(text), FILTERED, "truth") : null;
    const holds = found ? compile(found.tree, filterValue) : () => true;
    state.matches = (i) => holds(i) === true; // missing is not true
    const count = CASES.filter(state.matches).length;
    const remark = found && !count ? unitRemark(found) : "";
    element("filter-note").textContent = text ? `${count} of ${counted(CASES.length)}${remark}` : "";
    element("filter").removeAttribute("aria-invalid");
  } catch (failed) {
    element("filter-note").textContent = failed.message;
    element("filter").setAttribute("aria-invalid", "true");
    return;
  }
  state.page = 0;
  fade();
  drawList();
  setAddress();
}

function fade() {
  for (const [i, parts] of state.cells)
    for (const cell of parts) cell.classList.toggle("faded", !state.matches(i));
}

// The chosen case

function mark() {
  for (const cell of state.drawn.querySelectorAll(".chosen")) cell.classList.remove("chosen");
  for (const cell of state.cells.get(state.chosen) ?? []) {
    cell.classList.add("chosen");
    cell.parentNode.append(cell); // above its neighbours
  }
}

function choose(i, isStep = true) {
  state.chosen = i;
  setAddress(isStep);
  mark();
  showCase(element("case-body"), i);
  element("spoken").textContent = `${caseTitle(i)}: ${wordsOf(i)}`;
  document.documentElement.dataset.case = i;
  for (const row of document.querySelectorAll("#list-body tr[data-case]"))
    row.setAttribute("aria-selected", String(Number(row.dataset.case) === i));
}

function step(by) {
  const list = CASES.filter(state.matches);
  if (!list.length) return;
  const next = list.findIndex((i) => i >= state.chosen);
  const here = next < 0 ? list.length : next;
  const exact = list[here] === state.chosen;
  const to = by > 0 && !exact ? here : here + by;
  choose(list[(to + list.length) % list.length]);
}

// The nearest case that way; within the panel where it has one, else in the next panel.
function go(dx, dy) {
  const [x, y] = [axisOf(choice.x), axisOf(choice.y) ?? ONE];
  const [across, down] = [axisOf(choice.across) ?? ONE, axisOf(choice.down) ?? ONE];
  const from = [x, y, across, down].map((axis) => axis.level(state.chosen));
  const rank = (i) => {
    const [a, b, c, d] = [x, y, across, down].map((axis, j) => axis.level(i) - from[j]);
    const panel = dx ? c * dx : -d * dy;
    const [forth, aside] = dx ? [a * dx, Math.abs(b)] : [b * dy, Math.abs(a)];
    if ((dx ? d : c) !== 0 || panel < 0 || (panel === 0 && forth <= 0)) return Infinity;
    return 1e6 * panel + forth + 1e3 * aside;
  };
  const best = d3.least(state.shown.filter((i) => i !== state.chosen), rank);
  if (best !== undefined && rank(best) < Infinity) choose(best);
}

const KEYS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

mapPlace.addEventListener("keydown", (event) => {
  const way = KEYS[event.key];
  if (!way || event.altKey || event.ctrlKey || event.metaKey) return;
  event.preventDefault();
  go(...way);
});
const caseAt = (event) => event.target.dataset?.case;
mapPlace.addEventListener("click", (event) => {
  if (caseAt(event) !== undefined) choose(Number(caseAt(event)));
});
mapPlace.addEventListener("pointermove", (event) => {
  const tip = element("tip");
  tip.hidden = caseAt(event) === undefined;
  if (tip.hidden) return;
  const i = Number(caseAt(event));
  const column = columns.get(choice.colour);
  const number = column && !column.isWord ? `\n${withUnitShown(choice.colour, column.unit)}: ${short(unitShown(column.unit)[1] * column.value(i))}` : "";
  tip.textContent = `case ${i}: ${wordsOf(i)}\n${inputsOf(i).map((t) => cut(t, 60)).join("\n")}${number}`;
  const right = event.clientX > innerWidth - 320;
  tip.style.left = `${event.clientX + (right ? -tip.offsetWidth - 12 : 14)}px`;
  tip.style.top = `${Math.min(event.clientY + 14, innerHeight - tip.offsetHeight - 4)}px`;
});
mapPlace.addEventListener("pointerleave", () => (element("tip").hidden = true));
element("before").addEventListener("click", () => step(-1));
element("after").addEventListener("click", () => step(1));
element("filter").addEventListener("input", applyFilter);
element("choosers").addEventListener("submit", (event) => event.preventDefault());
element("clear").addEventListener("click", () => setFilter(""));

// The list

const LISTS = {
  all: ["all", () => true],
  failed: ["without a regime", (i) => ["failed", "missing", ...NO_REGIME].includes(words.own[i])],
  undecided: ["undecided", (i) => words.own[i] === "undecided"],
  unsure: ["unsure by twins", isUnsure],
};

function drawList() {
  const lists = Object.entries(LISTS).filter(([name]) => name !== "unsure" || told.sure);
  const counts = lists.map(([name, [text, keep]]) => {
    const button = textElement("button", `${text} (${CASES.filter((i) => keep(i) && state.matches(i)).length})`);
    button.type = "button";
    button.dataset.list = name;
    button.setAttribute("aria-pressed", String(state.list === name));
    button.addEventListener("click", () => {
      state.list = name;
      state.page = 0;
      drawList();
      setAddress();
    });
    return button;
  });
  const list = CASES.filter((i) => state.matches(i) && LISTS[state.list][1](i));
  if (state.list === "unsure") list.sort((a, b) => valueOf("word_share", a) - valueOf("word_share", b));
  const csv = textElement("button", "Save these as CSV");
  csv.type = "button";
  csv.id = "csv";
  csv.addEventListener("click", () => save("cases.csv", csvOf(sorted(list, state.sort))));
  element("list-buttons").replaceChildren(...counts.flatMap((b) => [b, " "]), csv);
  drawTable(element("list-body"), list, {
    page: state.page,
    chosen: state.chosen,
    choose,
    order: state.sort,
    sort: (order) => {
      Object.assign(state, { sort: order, page: 0 });
      drawList();
      setAddress();
      document.querySelector(`[data-sort="${CSS.escape(order.by)}"]`).focus();
    },
    turn: (page) => {
      state.page = page;
      drawList();
    },
  });
}

// Thresholds

const DECADES = 2; // that a slider goes either way

function limitRow(threshold) {
  const row = document.createElement("div");
  row.className = "limit";
  const label = textElement("label", threshold.name.replaceAll("_", " "));
  const slider = document.createElement("input");
  const number = document.createElement("input");
  label.htmlFor = slider.id = `limit-${threshold.name}`;
  const middle = Math.log10(threshold.default);
  Object.assign(slider, { type: "range", min: middle - DECADES, max: middle + DECADES, step: 0.01 });
  Object.assign(number, { type: "number", min: 0, step: "any", id: `value-${threshold.name}` });
  number.setAttribute("aria-label", `${threshold.name}, value`);
  const show = () => {
    number.value = String(Number(limits[threshold.name].toPrecision(6)));
    slider.value = String(Math.log10(limits[threshold.name] || 1e-300));
    slider.setAttribute("aria-valuetext", number.value);
  };
  const set = (value) => {
    if (!(value >= 0 && Number.isFinite(value))) return;
    limits[threshold.name] = value;
    slider.setAttribute("aria-valuetext", String(value));
    rename();
  };
  slider.addEventListener("input", () => {
    set(Number((10 ** Number(slider.value)).toPrecision(3)));
    number.value = String(limits[threshold.name]);
  });
  number.addEventListener("input", () => {
    if (number.value !== "") set(Number(number.value));
    slider.value = String(Math.log10(limits[threshold.name] || 1e-300));
  });
  row.append(label, slider, number, textElement("small", threshold.meaning.replaceAll("`", "")));
  show();
  return { row, show };
}

function drawLimits() {
  const rows = told.thresholds.map(limitRow);
  const note = document.createElement("div");
  note.id = "limits-note";
  note.setAttribute("role", "status");
  const back = textElement("button", "As in the file");
  back.type = "button";
  back.id = "limits-back";
  back.addEventListener("click", () => {
    Object.assign(limits, given);
    for (const { show } of rows) show();
    rename();
  });
  element("limits-body").replaceChildren(...rows.map(({ row }) => row), back, note);
}

let waiting = 0;
function rename() {
  cancelAnimationFrame(waiting);
  waiting = requestAnimationFrame(() => {
    const changed = nameAll();
    const moved = told.thresholds.filter((t) => limits[t.name] !== given[t.name]);
    const note = element("limits-note");
    note.replaceChildren(textElement("p", moved.length ? `${changed} of ${counted(CASES.length)} have other words than in the file.` : ""));
    if (moved.length) {
      const away = told.thresholds.filter((t) => limits[t.name] !== t.default);
      note.append(commandBlock("Store these words in the results", `hpcwhirl classify DIR${away.map((t) => ` --set ${t.name}=${limits[t.name]}`).join("")}`));
    }
    drawAll();
    applyFilter();
    choose(state.chosen);
    document.documentElement.dataset.changed = changed;
  });
}

// Head

function tableOf(rows) {
  const table = document.createElement("table");
  for (const [name, ...cells] of rows) {
    const row = table.insertRow();
    const head = textElement("th", name);
    head.scope = "row";
    row.append(head, ...cells.map((c) => textElement("td", c)));
  }
  return table;
}

function drawHead() {
  element("title").textContent = `${told.engine}: ${counted(COUNT)}`;
  const over = swept.filter((s) => s.levels.length > 1).map((s) => `${s.levels.length} × ${s.name}`).join(", ");
  element("lead").textContent = [
    over || "nothing is swept", told.fixed.join(", "), `results of ${told.facts.created ?? "unknown time"}`,
    `hpcwhirl ${told.facts.version ?? "?"}`, thinned(), motionNote(),
    ...(superseded.size ? [`${superseded.size} of the cases were computed again by a finer preset, which counts`] : []),
    ...(told.twins ? [`coloured by most of twins and case; ${told.twins}`] : []),
  ].filter(Boolean).join(" · ");
  element("preset").hidden = !told.facts.preset;
  if (told.facts.preset) tellPreset(told.facts.preset, told.facts.preset_loses);
  tellTables();
  const others = otherwiseNamed().length;
  element("warning").hidden = !others;
  element("warning").textContent = `${others} cases have other words in the file than this version gives them: hpcwhirl classify DIR determines them again.`;
  element("about-body").replaceChildren(
    heading("h4", "Campaign"), tableOf([...Object.entries(told.facts), ["digest", told.digest.slice(0, 12)]]),
    heading("h4", "Inputs that all cases share"),
    tableOf(told.inputs.map((s) => [s.name, JSON.stringify(s.value), s.meaning])),
  );
}

// Tables of coexisting motions, each below its title.
function tellTables() {
  element("tables").replaceChildren(...told.tables.map((one) => {
    const table = tableOf(one.rows);
    const head = table.createTHead().insertRow();
    for (const name of one.head) {
      const cell = textElement("th", name);
      cell.scope = "col";
      head.append(cell);
    }
    const details = document.createElement("details");
    details.append(textElement("summary", one.title), table, textElement("pre", one.command));
    return details;
  }));
}

// What a preset loses: its first clause, and the rest when asked for.
function tellPreset(name, loses) {
  const [first, ...rest] = loses.split("; ");
  element("preset").replaceChildren(
    textElement("summary", `preset ${name}: ${first}${rest.length ? " (more)" : ""}`),
    textElement("p", loses),
  );
}

const INTERESTING = ["divergent", "overloaded", "sustained", "undecided", "unstable", "damped"];

// The case shown first: one with an orbit, of the word that most needs attention.
function firstCase() {
  for (const word of INTERESTING) {
    const own = state.shown.filter((i) => words.shown[i] === word);
    const drawn = own.filter((i) => valueOf("record", i) >= 0);
    const list = drawn.length ? drawn : own;
    if (list.length) return list[Math.floor((list.length - 1) / 2)];
  }
  return 0;
}

function thinned() {
  const { kept, orbit } = told.traces;
  if (!kept) return "no traces were kept";
  const some = kept < COUNT ? ` of ${kept} cases` : "";
  return `traces${some} are thinned: at most ${orbit} places of an orbit; results.h5 has all`;
}

nameAll();
drawHead();
drawLimits();
const asked = followAddress();
drawAll();
state.chosen = asked ?? firstCase();
applyFilter();
choose(state.chosen, false);
element("spoken").textContent = "";

let width = innerWidth;
addEventListener("resize", () => {
  if (width === innerWidth) return;
  width = innerWidth;
  drawAll();
});

// Time at which the first picture is complete, ms since the page was requested.
requestAnimationFrame(() =>
  requestAnimationFrame(() => {
    document.documentElement.dataset.drawn = Math.round(performance.now());
  }),
);
