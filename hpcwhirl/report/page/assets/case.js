// One case: its words and why, its figures, its numbers, its command.

function textElement(kind, text, name = "") {
  const element = document.createElement(kind);
  element.textContent = text;
  if (name) element.className = name;
  return element;
}

function inputsOf(i) {
  const names = swept.length ? swept.map((s) => s.variable) : ["speed", "gap"];
  return names.map((name) => {
    const { unit, value } = columns.get(name);
    const level = swept.find((s) => s.variable === name)?.value ?? value;
    const [shown, factor] = unitShown(unit);
    if (name === "speed" && runUpOf(i)) return `speed ${rangeOf(runUpOf(i))} ${shown}`;
    return `${name.replaceAll("_", " ")} ${cut(levelText(level(i), factor), 60)}${UNITLESS.has(unit) ? "" : ` ${shown}`}`;
  });
}

function wordsOf(i) {
  const [word, whirl] = [told.looks[words.own[i]].told, words.whirl[i]];
  const own = whirl === "none" ? word : `${word}, ${whirl}`;
  const shares = sharesOf(i);
  return shares ? `${own}; ${shares}` : own;
}

// "16 twins: sustained 0.88, damped 0.12", the most frequent first; "" without twins.
function sharesOf(i) {
  const count = columns.get("twin_count")?.value(i) ?? 0;
  if (!(count > 0)) return "";
  const known = Object.keys(told.looks)
    .filter((word) => columns.has(`share_${word}`))
    .map((word) => [word, valueOf(`share_${word}`, i)])
    .filter(([, share]) => share > 0);
  const rest = 1 - d3.sum(known, ([, share]) => share);
  if (rest > 0.5 / count) known.push(["", rest]);
  const named = (word) => told.looks[word]?.told ?? "overloaded or unstable";
  const texts = known.sort((a, b) => b[1] - a[1]).map(([word, share]) => `${named(word)} ${share.toFixed(2)}`);
  return `${count} twins: ${texts.join(", ")}`;
}

const caseTitle = (i) => [`Case ${i}`, ...inputsOf(i)].join(" · ");

function showCase(place, i) {
  place.replaceChildren(textElement("h3", caseTitle(i)), chips(i), why(i));
  if (told.messages[i]) place.append(textElement("p", told.messages[i], "message"));
  const record = recordOf(i);
  if (record) place.append(figures(record, i), earlyBox(i));
  else if (runUpOf(i)) place.append(speedFigure(i));
  if (!record) place.append(textElement("p", noTraces(i), "note"));
  place.append(...[loadFigures(i), motionBox(i)].filter(Boolean));
  place.append(...commandBlocks(i), ...motionCommand(i), numbers(i));
}

function noTraces(i) {
  if (valueOf("status", i) !== "ok") return "No result, hence no orbit.";
  if (told.traces.kept)
    return "No orbit in this page: this case kept none, or there are so many that only some have theirs here.";
  return "No orbits were kept: the command below integrates it again and draws them.";
}

function chips(i) {
  const line = document.createElement("p");
  line.append("regime ", chipOf(words.own[i]));
  if (valueOf("status", i) === "ok") line.append(" whirl ", textElement("b", words.whirl[i]));
  const shares = sharesOf(i);
  if (!shares) return line;
  const twins = textElement("span", ` · ${shares}; with the case itself most are `, "shares");
  line.append(twins, chipOf(byMajority(words.own[i], i, false)));
  return line;
}

function chipOf(word) {
  const look = told.looks[word];
  const chip = textElement("span", look.told, "chip");
  chip.style.background = look.colour;
  chip.style.color = look.ink;
  return chip;
}

// The rules that named it, with its numbers; below, what keeps it from other words.
function why(i) {
  const block = document.createElement("div");
  block.className = "why";
  if (valueOf("status", i) !== "ok") {
    block.append(textElement("p", `status: ${valueOf("status", i)}`));
    return block;
  }
  const outcome = ruleOf("outcome", i);
  const table = NO_REGIME.includes(outcome.word) ? "outcome" : "regime";
  const rule = ruleOf(table, i);
  const found = rule.needs.flatMap(({ tree }) => reasons(tree, i));
  const open = rule.word === "undecided" ? nearest(i) : "";
  const against = open ? `It is ${open}.` : "";
  block.append(textElement("p", story(i, rule.word, against), "because"));
  if (found.length) block.append(textElement("p", `The rule: ${texts(found)} → ${rule.word}`, "note"));
  if (table === "regime") {
    const whirl = ruleOf("whirl", i);
    const seen = whirl.needs.flatMap(({ tree }) => reasons(tree, i));
    block.append(textElement("p", `${texts(seen) || "neither direction prevails"} → whirl ${whirl.word}`));
  }
  const lacking = document.createElement("details");
  lacking.append(textElement("summary", "what keeps it from other words"), lackingList(table, rule, i));
  block.append(lacking);
  return block;
}

function lackingList(table, rule, i) {
  const list = document.createElement("ul");
  for (const other of tables[table]) {
    if (other.word === rule.word || other.word === "undecided" || !other.needs.length) continue;
    const missing = other.needs.flatMap(({ tree }) => reasons(tree, i)).filter(([, holds]) => !holds);
    if (!missing.length) continue;
    const item = textElement("li", `${other.word}: `);
    item.append(textElement("span", texts(missing)));
    list.append(item);
  }
  return list;
}

const isMeasured = ({ tree }) => !namesIn(tree).includes("stop");

// One line: the conditions that a case misses for the word nearest to it.
function nearest(i) {
  const open = tables.regime
    .filter(({ word, needs }) => word !== words.regime[i] && needs.length && needs.every(isMeasured))
    .map(({ word, needs }) => {
      const all = needs.flatMap(({ tree }) => reasons(tree, i));
      const missing = all.filter(([, holds]) => !holds);
      return { word, missing, share: missing.length / all.length };
    })
    .filter(({ missing }) => missing.length);
  const best = d3.least(open, ({ share }) => share);
  return best ? `not ${best.word}: ${texts(best.missing)}` : "";
}

const early = { wanted: false }; // whether orbits show what came before the window

function earlyBox(i) {
  const label = textElement("label", " orbits with what came before the window of the words", "early");
  const box = document.createElement("input");
  Object.assign(box, { type: "checkbox", id: "early", checked: early.wanted });
  box.addEventListener("change", () => {
    early.wanted = box.checked;
    choose(i, false);
    element("early").focus();
  });
  label.prepend(box);
  return label;
}

function figures(record, i) {
  const block = document.createElement("div");
  block.className = "figures";
  const orbit = (frame) => orbitFigure(record, i, frame, early.wanted);
  const drawn = runUpOf(i)
    ? [speedFigure(i), waterfallFigure(i), orbit("static"), radiusFigure(record, i)]
    : [orbit("static"), orbit("rotating"), radiusFigure(record, i), spectrumFigure(record, i)];
  block.append(...drawn.filter(Boolean), energyFigure(record, i), powerFigure(record, i));
  return block;
}

// By the campaign's file, and all inputs by themselves where the file is not at hand.
function commandBlocks(i) {
  const [short_, whole] = [commandByFile(i), commandOf(i)];
  if (!short_) return [commandBlock("Integrate it again", whole)];
  const details = document.createElement("details");
  details.append(textElement("summary", "without the campaign's file"), commandBlock("All inputs", whole));
  return [commandBlock("Integrate it again", short_), details];
}

function commandBlock(title, command) {
  const block = document.createElement("div");
  block.className = "command";
  const button = textElement("button", "Copy");
  button.type = "button";
  const code = textElement("code", command);
  code.tabIndex = 0;
  button.setAttribute("aria-label", `copy the command: ${title}`);
  button.addEventListener("click", () => copy(command, code, button));
  block.append(textElement("h4", title), button, code);
  return block;
}

async function copy(text, code, button) {
  try {
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
  } catch {
    getSelection().selectAllChildren(code); // the clipboard is refused: Ctrl-C does it
    button.textContent = "Selected";
  }
}

function numbers(i) {
  const block = document.createElement("details");
  const table = document.createElement("table");
  block.append(textElement("summary", "All numbers"), table);
  block.addEventListener("toggle", () => {
    if (table.rows.length) return;
    for (const column of columns.values()) {
      if (column.name === "record" || column.name.startsWith("level of ")) continue;
      const row = table.insertRow();
      const name = textElement("th", column.name);
      name.scope = "row";
      row.append(name, textElement("td", String(column.value(i))),
        textElement("td", UNITLESS.has(column.unit) ? "" : column.unit),
        textElement("td", column.meaning ?? ""));
    }
  });
  return block;
}
