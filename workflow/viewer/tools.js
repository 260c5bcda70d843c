// The row of tools: overlays, the fly path, a picture to keep.

import { OVERLAYS } from "./overlay.js";

/** Let a person keep a blob as a file. */
export function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

export function listenToTools(document, page, { redraw, picture, cycle }) {
  const part = (id) => document.getElementById(id), { flight } = page;
  const overlay = part("overlay");
  for (const name of OVERLAYS) overlay.add(new Option(name[0].toUpperCase() + name.slice(1), name));
  overlay.addEventListener("change", () => cycle(overlay.selectedIndex));
  const say = () => {
    part("record").textContent = flight.mode === "record" ? "Stop" : "Record";
    part("play").textContent = flight.mode === "play" ? "Stop" : "Play";
    part("play").disabled = part("save").disabled = !flight.path.length;
  };
  const toggle = (name) => {
    if (flight.mode === name) flight.stop();
    else flight[name]();
    redraw();
    say();
  };
  part("record").addEventListener("click", () => toggle("record"));
  part("play").addEventListener("click", () => toggle("play"));
  part("save").addEventListener("click", () => {
    save(new Blob([JSON.stringify(flight.file(), null, 1)], { type: "application/json" }), "flight.json");
  });
  part("keep").addEventListener("click", picture);
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target === overlay) return;
    if (event.code === "KeyR") toggle("record");
    if (event.code === "KeyP") toggle("play");
    if (event.code === "KeyC") picture();
    if (event.code === "KeyO") {
      cycle();
      overlay.selectedIndex = page.overlay;
    }
  });
  setInterval(say, 250);
  say();
}
