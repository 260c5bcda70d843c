// The legend of an overlay: what its colours mean, and the values under the pointer. And the map: the tiles around with
// their numbers, and where one is and looks. A click takes one there.

import { NO_ORDER, uncertaintyRange } from "../data/layout.js";
import {
  levelColour, materialColour, OBJECTS, OVERLAYS, SORTED, tileColour, uncertaintyColour,
} from "../draw/overlays.js";
import { hitGround, pointAt, rayThrough } from "../terrain/camera.js";
import { REACH, tileUnder } from "../terrain/cells.js";
import { cssColour, element, listenToKeys, swatch } from "./dom.js";
import { moveTo } from "./walker.js";

/**
 * @typedef {import("../data/manifest.js").Manifest} Manifest
 * @typedef {{ tile: number, level: number | null, order: number | null }} Under what is under the pointer
 */

const STEPS = 7; // swatches of a scale
const HINT = "Point at the ground for its values", LOADING = "Finer levels are still loading";

/** A unit after a number. @param {string} unit */
export const unitName = (unit) => (unit === "metre" ? "m" : `${unit}s`);

/** A length to two digits, in metres or else tiles. @param {number} v @param {Manifest} manifest */
export const lengthText = (v, { unit, tile_side: side }) => (
  unit === "metre" ? `${Number(v.toPrecision(2))} m` : `${Number((v / side).toPrecision(2))} tiles`);

export function createLegend() {
  const box = element("legend", HTMLElement), value = document.createElement("p");
  const loading = Object.assign(document.createElement("p"), { textContent: LOADING });
  /** @type {Manifest | null} */
  let shown = null;
  /** @param {string} text */
  const say = (text) => {
    if (value.textContent !== text) value.textContent = text;
  };
  return {
    /** Show a legend; the plain picture has none. @param {number} overlay @param {Manifest | null} manifest */
    show(overlay, manifest) {
      const name = OVERLAYS[overlay];
      shown = name === "picture" ? null : manifest;
      box.hidden = !shown;
      if (!shown) return;
      const list = document.createElement("ul");
      list.append(...entriesOf(name, shown).map(([colour, text]) => {
        const item = document.createElement("li");
        item.append(...colour ? [swatch(cssColour(colour))] : [], text);
        return item;
      }));
      say(HINT);
      box.replaceChildren(list, ...name === "level" ? [loading] : [], value);
    },
    /** Does the picture lack levels that the legend names? @param {boolean} lacking */
    setLoading(lacking) {
      loading.hidden = !lacking;
    },
    /** Tell what is under the pointer; null: no ground. @param {Under | null} under */
    tell(under) {
      if (!shown) return;
      if (!under) return say("No tile here");
      const { tile, level, order } = under, uncertainty = shown.tiles[tile]?.uncertainty ?? 0;
      const parts = [`tile ${tile}`, `uncertainty ${uncertainty.toPrecision(2)}`];
      if (level !== null) parts.push(`level ${level}`);
      if (order !== null) parts.push(`order ${order}`);
      say(`Here: ${parts.join(", ")}`);
    },
  };
}

/**
 * Colours of an overlay and what they stand for.
 *
 * @param {string} name @param {Manifest} manifest
 * @returns {[number[] | null, string][]}
 */
function entriesOf(name, manifest) {
  const { tiles, levels, directions, materials, objects } = manifest;
  if (name === "tile") return [[null, `A colour for each of ${tiles.length} tiles`]];
  if (name === "level") {
    return levels.map(({ level, distance }) => {
      const end = level ? level === levels.length - 1 ? ", coarsest" : "" : ", finest";
      const text = distance !== null ? `: up to ${lengthText(distance, manifest)} away` : level ? ": beyond" : "";
      return [levelColour(level), `level ${level}${end}${text}`];
    });
  }
  if (name === "order") {
    const others = `else one of ${directions.length} orders that were sorted beforehand, a colour each`;
    return [[SORTED, "sorted as seen from here"], [null, others]];
  }
  if (name === "uncertainty") {
    const [low, high] = uncertaintyRange(tiles);
    if (low === high) return [[uncertaintyColour(0.5), `${low.toPrecision(2)}, all tiles alike`]];
    return Array.from({ length: STEPS }, (_, k) => {
      const text = k === 0 ? `${low.toPrecision(2)}, sure` : k === STEPS - 1 ? `${high.toPrecision(2)}, unsure` : "";
      return [uncertaintyColour(k / (STEPS - 1)), text];
    });
  }
  /** @type {[number[], string][]} */
  const named = materials.map((material, m) => [materialColour(m), material.name]);
  return objects?.length ? [...named, [materialColour(OBJECTS), "objects"]] : named;
}

/** Tell the values under the pointer while an overlay is shown. @param {import("./viewer.js").Viewer} viewer */
export function tellValues(viewer) {
  const { canvas } = viewer;
  /** @type {{ clientX: number, clientY: number } | null} */
  let pointer = null;
  const tell = () => {
    const { scene } = viewer, { shrink = 0, missing = [] } = scene?.frame ?? {};
    viewer.hud.legend.setLoading(!viewer.resting.whole && (shrink < 1 || missing.length > 0));
    if (viewer.overlay === 0 || !scene || !pointer) return;
    const across = pointer.clientX / canvas.clientWidth, down = pointer.clientY / canvas.clientHeight;
    viewer.hud.legend.tell(valuesAt(scene, viewer.camera(scene), across, down));
  };
  for (const name of /** @type {const} */ (["pointermove", "pointerdown"])) {
    canvas.addEventListener(name, (event) => {
      pointer = event;
      tell();
    });
  }
  canvas.addEventListener("pointerleave", () => (pointer = null));
  setInterval(tell, 250); // the ground moves on and is refined under a pointer at rest
}

/**
 * Tile, finest level and order that are drawn at a point of the picture; null: there is no ground.
 *
 * @param {import("./viewer.js").Scene} scene @param {import("../terrain/camera.js").Camera} camera
 * @param {number} across @param {number} down
 * @returns {Under | null}
 */
function valuesAt({ manifest, heights, lift, frame }, camera, across, down) {
  const farthest = REACH * manifest.tile_side;
  const place = hitGround(camera.eye, rayThrough(camera, across, down), heights, { lift, farthest });
  if (!place) return null;
  const { i, j, tile } = tileUnder(manifest, heights, place[0], place[1]), point = pointAt(heights, place[0], place[1]);
  const distance = Math.hypot(...point.map((v, k) => v - camera.eye[k]));
  for (let k = 0; frame && k < frame.drawn.length; k += 6) {
    const [di, dj, , lo, hi, order] = frame.drawn.subarray(k, k + 6);
    if (frame.i0 + di !== i || frame.j0 + dj !== j) continue;
    let level = lo;
    while (level < hi && distance > frame.switches[level]) level += 1;
    return { tile, level, order: order === NO_ORDER ? null : order };
  }
  return { tile, level: null, order: null };
}

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
