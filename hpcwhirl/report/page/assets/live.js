// Follows the campaign: asks the server on this machine how far it is, and loads the
// page anew when cases have ended. The address keeps case and filter.

(() => {
  const EVERY = 2000; // ms
  const line = document.getElementById("live");
  const busy = () => document.activeElement?.matches("input:not([type=range]), select");

  async function ask() {
    let state;
    try {
      state = await (await fetch(`state?version=${line.dataset.version}`, { cache: "no-store" })).json();
    } catch {
      line.textContent = "The server has ended; the page shows what it showed last.";
      return;
    }
    line.textContent = state.over ? state.text : `${state.text}; this page follows the campaign.`;
    if (String(state.version) !== line.dataset.version && !busy()) {
      location.reload();
      return;
    }
    if (!state.over || String(state.version) !== line.dataset.version) setTimeout(ask, EVERY);
  }

  line.hidden = false;
  ask();
})();
