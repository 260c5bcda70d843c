// What the page says: progress while loading, where one is, how fast it draws, help, and what went wrong.

const OFTEN = 250; // milliseconds between updates of the numbers

export function createHud(document) {
  const ids = ["status", "bar", "loading", "error", "place", "speed", "help", "helpButton",
    "helpClose", "tools", "times"];
  const part = Object.fromEntries(ids.map((id) => [id, document.getElementById(id)]));
  let told = -Infinity, numbered = -Infinity;
  const due = () => { // a screen reader reads every change of the status aloud
    const now = performance.now(), yes = now - told >= OFTEN;
    if (yes) told = now;
    return yes;
  };
  const showHelp = (on) => {
    part.help.hidden = !on;
    part.helpButton.setAttribute("aria-expanded", String(on));
  };
  part.helpButton.addEventListener("click", () => showHelp(part.help.hidden));
  part.helpClose.addEventListener("click", () => {
    showHelp(false);
    remember();
  });
  part.error.addEventListener("click", () => (part.error.hidden = true));
  part.place.parentElement.hidden = part.tools.hidden = true;

  return {
    /** Bytes and tiles so far. */
    progress({ bytes, total, chunks, of }) {
      part.bar.value = total ? bytes / total : 1;
      if (!due()) return;
      const share = `${megabytes(bytes)} of ${megabytes(total)} MB`;
      part.status.textContent = `Loading the terrain: ${share}, ${chunks} of ${of} pieces ready`;
    },
    /** All is there; the first visit begins with help, unless it is to be quiet. */
    loaded(quietly) {
      part.loading.hidden = true;
      part.status.textContent = "";
      if (!quietly && !visitedBefore()) showHelp(true);
    },
    error(text) {
      part.loading.hidden = true;
      part.error.hidden = false;
      part.error.textContent = text;
      showHelp(false);
    },
    recovered() {
      part.error.hidden = true;
    },
    /** Another bundle was dropped. */
    opening() {
      part.error.hidden = true;
      part.loading.hidden = false;
      part.bar.value = 0;
      part.status.textContent = "Reading what was dropped";
    },
    started() {
      part.place.parentElement.hidden = part.tools.hidden = false;
    },
    /** Where the walker is and what it costs; a few times a second at most. */
    numbers(now, state, stats, fps, unit, force) {
      if (now - numbered < OFTEN && !force) return;
      numbered = now;
      const { x, y, eye, under, count, drawn } = state();
      const where = `${length(x)} E, ${length(y)} N, eye ${length(eye)} ${unitName(unit)}`;
      part.place.textContent = `tile ${under.tile} at (${under.i}, ${under.j}) · ${where}`;
      const rate = fps ? `${Math.round(fps)} fps, ` : "";
      const shown = `${count.toLocaleString("en")} splats in ${drawn.length} tiles`;
      part.speed.textContent = `${rate}${shown}`;
      const times = ["render", "sort", "update"].filter((name) => stats[name]).map((name) => {
        const { mean, sd } = stats[name];
        return `${name} ${mean.toFixed(1)} ± ${sd.toFixed(1)} ms`;
      });
      part.times.textContent = `${times.join(" · ")} · worker in ${Math.round(100 * stats.share)} % of frames`;
    },
  };
}

const megabytes = (bytes) => (bytes / 1e6).toFixed(1);
const length = (v) => (Math.abs(v) >= 1000 ? v.toFixed(0) : v.toPrecision(3));
const unitName = (unit) => (unit === "metre" ? "m" : `${unit}s`);

function visitedBefore() {
  try {
    return localStorage.getItem("davgswt.visited") === "yes";
  } catch {
    return false; // storage may be switched off
  }
}

function remember() {
  try {
    localStorage.setItem("davgswt.visited", "yes");
  } catch {
    // then the help is shown again next time
  }
}
