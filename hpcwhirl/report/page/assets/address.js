// The address of what the page shows, behind #: case, filter, axes, colour, list.

const ADDRESS = {
  case: () => String(state.chosen),
  filter: () => element("filter").value.trim(),
  ...Object.fromEntries(["x", "y", "across", "down"].map((key) => [key, () => (choice[key] === firstAxes[key] ? "" : choice[key] || "none")])),
  colour: () => (choice.colour === "regime" ? "" : choice.colour),
  list: () => (state.list === "all" ? "" : state.list),
  sort: () => (state.sort.by ? `${state.sort.down ? "-" : ""}${state.sort.by}` : ""),
};

// A new case is a step back for the browser; what else changes is not.
function setAddress(isStep = false) {
  const parts = Object.entries(ADDRESS).map(([name, of]) => [name, of()]).filter(([, value]) => value !== "");
  const text = `#${parts.map(([name, value]) => `${name}=${encodeURIComponent(value)}`).join("&")}`;
  if (text === location.hash) return;
  try {
    history[isStep ? "pushState" : "replaceState"](null, "", text);
  } catch {
    location.replace(text); // where a page from disk may not write its history
  }
}

function readAddress() {
  return Object.fromEntries(location.hash.slice(1).split("&").filter(Boolean).map((part) => {
    const [name, value = ""] = part.split("=", 2);
    try {
      return [name, decodeURIComponent(value)];
    } catch {
      return [name, value];
    }
  }));
}

// Show what the address says; what it does not name is as at first. Returns the number
// of the case, null without one, and says what it names that is not here.
function followAddress() {
  const asked = readAddress();
  const wrong = Object.keys(asked).filter((name) => !Object.hasOwn(ADDRESS, name)).map((name) => `${name}`);
  for (const key of ["x", "y", "across", "down"]) {
    const name = asked[key] === "none" && key !== "x" ? "" : asked[key] ?? firstAxes[key];
    const known = name === "" || axisOf(name);
    choice[key] = known ? name : firstAxes[key];
    if (!known) wrong.push(`${key}=${name}`);
  }
  const isColour = (name) => ["regime", "whirl"].includes(name) || numbersToColour.some((c) => c.name === name);
  choice.colour = isColour(asked.colour) ? asked.colour : "regime";
  if (asked.colour && !isColour(asked.colour)) wrong.push(`colour=${asked.colour}`);
  state.list = Object.hasOwn(LISTS, asked.list ?? "") ? asked.list : "all";
  const by = (asked.sort ?? "").replace(/^-/, "");
  state.sort = { by: SORTS.has(by) ? by : "", down: (asked.sort ?? "").startsWith("-") };
  const number = Number(asked.case);
  const isCase = asked.case !== undefined && CASES.includes(number) && asked.case !== "";
  if (asked.case !== undefined && !isCase) wrong.push(`case=${asked.case}`);
  element("address-note").hidden = !wrong.length;
  element("address-note").textContent = wrong.length ? `The address names what is not on this page: ${wrong.map((w) => cut(w, 40)).join(", ")}.` : "";
  element("filter").value = asked.filter ?? "";
  return isCase ? number : null;
}

addEventListener("popstate", () => {
  const i = followAddress();
  drawAll();
  applyFilter();
  if (i !== null) choose(i, false);
});
