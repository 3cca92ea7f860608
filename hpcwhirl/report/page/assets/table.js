// The list of cases, and all of them as CSV.

const PAGE = 20;

// Columns of the list: how each is sorted, {key: (case) => number or text}.
const SORTS = new Map([
  ["case", (i) => i],
  ...swept.map((s) => [s.variable, (i) => (s.numeric ? s.value(i) : levelText(s.value(i)))]),
  ["words", wordsOf],
  ["message", (i) => told.messages[i] ?? (words.own[i] === "undecided" ? nearest(i) : "")],
]);

function sorted(list, { by, down }) {
  if (!by) return list;
  const of = new Map(list.map((i) => [i, SORTS.get(by)(i)]));
  const order = (a, b) => d3.ascending(of.get(a), of.get(b)) || a - b;
  return [...list].sort(down ? (a, b) => order(b, a) : order);
}

function sortButton(key, name, { by, down }, sort) {
  const cell = document.createElement("th");
  cell.scope = "col";
  const button = textElement("button", `${name}${by === key ? (down ? " ▼" : " ▲") : ""}`, "sort");
  button.type = "button";
  button.dataset.sort = key;
  button.title = "sort by this";
  if (by === key) cell.setAttribute("aria-sort", down ? "descending" : "ascending");
  button.addEventListener("click", () => sort({ by: key, down: by === key && !down }));
  cell.append(button);
  return cell;
}

function drawTable(place, unsorted, { page, chosen, choose, turn, order, sort }) {
  const list = sorted(unsorted, order);
  const pages = Math.max(Math.ceil(list.length / PAGE), 1);
  const at = Math.min(page, pages - 1);
  const table = document.createElement("table");
  table.createCaption().textContent = `${counted(list.length)}, page ${at + 1} of ${pages}`;
  const head = table.createTHead().insertRow();
  const heads = ["case", ...swept.map((s) => withUnitShown(s.variable, s.unit)), "words", "message"];
  [...SORTS.keys()].forEach((key, j) => head.append(sortButton(key, heads[j], order, sort)));
  const body = table.createTBody();
  for (const i of list.slice(at * PAGE, (at + 1) * PAGE)) body.append(tableRow(i, chosen, choose));
  const buttons = document.createElement("p");
  for (const [text, step] of [["Previous page", -1], ["Next page", 1]]) {
    const button = textElement("button", text);
    button.type = "button";
    button.disabled = at + step < 0 || at + step >= pages;
    button.addEventListener("click", () => turn(at + step));
    buttons.append(button, " ");
  }
  place.replaceChildren(table, buttons);
}

function tableRow(i, chosen, choose) {
  const row = document.createElement("tr");
  row.dataset.case = i;
  row.setAttribute("aria-selected", String(i === chosen));
  const button = textElement("button", String(i));
  button.type = "button";
  button.setAttribute("aria-label", `show case ${i}`);
  button.addEventListener("click", () => choose(i));
  const first = document.createElement("td");
  first.append(button);
  row.append(first, ...swept.map((s) => textElement("td", cut(levelText(s.value(i), unitShown(s.unit)[1]), 40))));
  row.append(textElement("td", wordsOf(i)), textElement("td", SORTS.get("message")(i)));
  return row;
}

// A text that a spreadsheet would take for a formula gets an apostrophe before it.
function csvText(value) {
  const text = typeof value === "number" ? String(value) : String(value).replace(/^(?=[=+\-@\t\r])/, "'");
  return /[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

function csvOf(list) {
  const plain = [...columns.values()].filter(
    ({ name }) => name !== "record" && !name.startsWith("level of ") && !["outcome", "regime", "whirl"].includes(name),
  );
  const lines = [["case", "outcome", "regime", "whirl", ...plain.map((c) => c.name), "message"]];
  for (const i of list)
    lines.push([
      i, words.outcome[i], words.regime[i], words.whirl[i],
      ...plain.map((c) => c.value(i)), told.messages[i] ?? "",
    ]);
  return lines.map((line) => line.map(csvText).join(",")).join("\r\n") + "\r\n";
}

function save(name, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv;charset=utf-8" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
