// The map: the tiles around with their numbers, and where one is and looks. A click takes one there.

import { tileColour } from "../draw/overlays.js";
import { tileUnder } from "../terrain/cells.js";
import { cssColour, element, listenToKeys } from "./dom.js";
import { lengthText } from "./legend.js";
import { moveTo } from "./walker.js";

const CELLS = 9; // along a side
const PAPER = "#24272a", INK = "#ffffff";

/** @param {import("./viewer.js").Viewer} viewer */
export function createMinimap(viewer) {
  const map = element("map", HTMLCanvasElement), button = element("mapButton", HTMLButtonElement);
  const pen = map.getContext("2d"), unit = map.width / CELLS;

  /** The south-west corner of the map, in tile sides. @param {import("./walker.js").Walker} walker @param {number} side */
  const corner = ({ x, y }, side) => [x / side - CELLS / 2, y / side - CELLS / 2];

  function draw() {
    const { scene } = viewer;
    button.hidden = Boolean(scene?.walker.radius); // no map of a planet
    if (button.hidden) map.hidden = true;
    if (map.hidden || !scene || !pen) return;
    const { manifest, walker, heights } = scene, side = manifest.tile_side, [west, south] = corner(walker, side);
    pen.fillStyle = PAPER;
    pen.fillRect(0, 0, map.width, map.height);
    Object.assign(pen, { font: "11px system-ui, sans-serif", textAlign: "center", textBaseline: "middle" });
    for (let j = Math.floor(south); j < south + CELLS; j++) {
      for (let i = Math.floor(west); i < west + CELLS; i++) {
        const { tile } = tileUnder(manifest, heights, (i + 0.5) * side, (j + 0.5) * side);
        const left = (i - west) * unit, top = map.height - (j + 1 - south) * unit;
        pen.fillStyle = cssColour(tileColour(tile), 140);
        pen.fillRect(left + 0.5, top + 0.5, unit - 1, unit - 1);
        pen.fillStyle = INK;
        pen.fillText(String(tile), left + unit / 2, top + unit / 2);
      }
    }
    drawWalker(pen, map.width / 2, (walker.yaw * Math.PI) / 180);
  }

  /** @param {import("../data/manifest.js").Manifest} manifest */
  const explain = (manifest) => {
    const wide = manifest.unit === "metre" ? `, ${lengthText(manifest.tile_side, manifest)} wide` : "";
    viewer.hud.say(`Each square is a place of a tile${wide}; equal numbers are the same tile. North is up.`);
  };
  const toggle = () => {
    map.hidden = !map.hidden;
    button.setAttribute("aria-pressed", String(!map.hidden));
    if (!map.hidden && viewer.scene) explain(viewer.scene.manifest);
    draw();
  };
  button.addEventListener("click", toggle);
  addEventListener("keydown", (event) => {
    if (event.code === "Escape" && !map.hidden && !event.defaultPrevented) toggle();
  });
  listenToKeys({ KeyN: toggle });
  map.addEventListener("click", ({ offsetX, offsetY }) => {
    const { scene } = viewer;
    if (!scene) return;
    const { walker, manifest: { tile_side: side } } = scene, [west, south] = corner(walker, side);
    moveTo(walker, {
      x: (west + (offsetX / map.clientWidth) * CELLS) * side, y: (south + (1 - offsetY / map.clientHeight) * CELLS) * side,
    });
    viewer.redraw();
  });
  return { draw };
}

/** @param {CanvasRenderingContext2D} pen @param {number} middle @param {number} yaw */
function drawWalker(pen, middle, yaw) {
  const arrow = new Path2D("M12 0-8 7-4 0-8-7Z");
  pen.save();
  pen.translate(middle, middle);
  pen.rotate(-yaw);
  Object.assign(pen, { fillStyle: INK, strokeStyle: "#000000", lineWidth: 1.5 });
  pen.fill(arrow);
  pen.stroke(arrow);
  pen.restore();
}
