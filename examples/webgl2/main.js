// The endless terrain in plain WebGL2. W A S D walk, dragging looks, a click names the place that it meets.
import { load, rayThrough } from "/page/terrain_api.js";

const canvas = /** @type {HTMLCanvasElement} */ (document.querySelector("canvas"));
const told = /** @type {HTMLElement} */ (document.querySelector("p")), SPEED = 1.5; // eye heights a second
const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false });
if (!gl) throw new Error("no WebGL2 here");
const terrain = await load("/page/", { onError: (error) => (told.textContent = error.message) });
const painter = terrain.createPainter(gl), held = new Set(), asked = new URLSearchParams(location.search);
const place = { x: 0, y: 0, eye: terrain.eyeFloor, yaw: 60, pitch: -12 };
for (const key of /** @type {(keyof typeof place)[]} */ (Object.keys(place))) place[key] = Number(asked.get(key) ?? place[key]);
let stale = true, busy = false, last = 0; // something changed; an update is under way; time of the last frame

function walk(/** @type {number} */ seconds) {
  const ahead = Number(held.has("w")) - Number(held.has("s")), right = Number(held.has("d")) - Number(held.has("a"));
  const yaw = (place.yaw * Math.PI) / 180, step = SPEED * place.eye * seconds;
  place.x += step * (ahead * Math.cos(yaw) + right * Math.sin(yaw));
  place.y += step * (ahead * Math.sin(yaw) - right * Math.cos(yaw));
  return ahead !== 0 || right !== 0;
}

async function update(/** @type {boolean} */ exact) {
  [busy, stale] = [true, false];
  const { complete, gaussians, cells } = await terrain.update(terrain.camera(place, canvas.width, canvas.height), { exact });
  busy = false;
  painter.draw(terrain.camera(place, canvas.width, canvas.height));
  told.textContent = `${gaussians} Gaussians in ${cells.length} cells${exact && complete ? "" : ", more to come"}`;
  if (!complete) stale = true;
  else if (!exact && !stale && !held.size) await update(true); // at rest: this view, whole
}

function frame(/** @type {number} */ now) {
  requestAnimationFrame(frame);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height, stale] = [width, height, true];
  const walked = walk(Math.min(now - last, 100) / 1000);
  last = now;
  if (walked) stale = true;
  if (stale && !busy) update(false);
  else if (walked) painter.draw(terrain.camera(place, width, height)); // the last update, from here
}

canvas.addEventListener("pointermove", ({ buttons, movementX, movementY }) => {
  if (!buttons) return;
  place.yaw += 0.2 * movementX;
  place.pitch = Math.min(Math.max(place.pitch + 0.2 * movementY, -90), 90);
  stale = true;
});
canvas.addEventListener("click", ({ clientX, clientY }) => {
  const camera = terrain.camera(place, canvas.width, canvas.height);
  const hit = terrain.pick(camera.eye, rayThrough(camera, clientX / canvas.clientWidth, clientY / canvas.clientHeight));
  if (hit) told.textContent = `tile ${hit.tile} at ${hit.point.map((v) => v.toFixed(2))}, ${hit.distance.toFixed(2)} ${terrain.unit} away`;
});
addEventListener("keydown", ({ key }) => held.add(key.toLowerCase()));
addEventListener("keyup", ({ key }) => held.delete(key.toLowerCase()));
requestAnimationFrame(frame);
