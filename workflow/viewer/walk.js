// Where the walker is and how keys, mouse and fingers move them. Angles in degrees: yaw from east, counter-clockwise;
// pitch above the horizon.

const WIDE = 60; // field of view of the picture's longer side, degrees
const PACE = 1.2; // eye heights a second
const RUN = 4; // with Shift
const TURN = 70; // degrees a second with the arrow keys
const RISE = 1.2; // powers of e a second with Q and E
const CEILING = 16; // highest eye, in tile sides
const KEYS = {
  KeyW: "forward", ArrowUp: "forward", KeyS: "back", ArrowDown: "back", KeyA: "left", KeyD: "right",
  ArrowLeft: "turnLeft", ArrowRight: "turnRight", KeyQ: "lower", KeyE: "higher", ShiftLeft: "run", ShiftRight: "run",
};

/** A walker on a terrain: position in world units, kept within what makes sense. */
export function createWalker({ tile_side: side, eye_floor: floor }, place = {}) {
  const walker = {
    x: side / 2, y: side / 2, eye: floor, yaw: 60, pitch: -12,
    floor, ceiling: Math.max(CEILING * side, 4 * floor), held: new Set(),
  };
  put(walker, place);
  return walker;
}

/** Change any of x, y, eye, yaw and pitch; what is not a number stays as it was. */
export function put(walker, place) {
  for (const key of ["x", "y", "eye", "yaw", "pitch"]) {
    if (Number.isFinite(place[key])) walker[key] = place[key];
  }
  walker.eye = Math.min(Math.max(walker.eye, walker.floor), walker.ceiling);
  walker.pitch = Math.min(Math.max(walker.pitch, -90), 90);
  walker.yaw = ((walker.yaw % 360) + 360) % 360;
}

/** Go on for some seconds with the keys that are held. Returns: did anything change? */
export function step(walker, seconds) {
  const on = (name) => Number(walker.held.has(name));
  const forward = on("forward") - on("back"), right = on("right") - on("left");
  const turn = on("turnLeft") - on("turnRight"), rise = on("higher") - on("lower");
  if (!forward && !right && !turn && !rise) return false;
  const yaw = (walker.yaw * Math.PI) / 180;
  const stride = (PACE * walker.eye * seconds * (on("run") ? RUN : 1)) / Math.max(1, Math.hypot(forward, right));
  put(walker, {
    x: walker.x + stride * (forward * Math.cos(yaw) + right * Math.sin(yaw)),
    y: walker.y + stride * (forward * Math.sin(yaw) - right * Math.cos(yaw)),
    yaw: walker.yaw + turn * TURN * seconds,
    eye: walker.eye * Math.exp(rise * RISE * seconds),
  });
  return true;
}

/** The camera of a walker, so high above the surface, for a picture of so many pixels. */
export function cameraOf(walker, width, height, heights) {
  const yaw = (walker.yaw * Math.PI) / 180, pitch = (walker.pitch * Math.PI) / 180;
  const [c, s, p, q] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  return {
    eye: [walker.x, walker.y, walker.eye + (heights ? heights.at(walker.x, walker.y)[0] : 0)],
    right: [s, -c, 0], up: [-q * c, -q * s, p], ahead: [p * c, p * s, q],
    width, height, focal: Math.max(width, height) / 2 / Math.tan((WIDE * Math.PI) / 360),
  };
}

/** A place as the part of a link after '#', to a thousandth of the eye floor and of a degree. */
export function toHash(walker) {
  const digits = Math.min(12, Math.max(0, Math.ceil(3 - Math.log10(walker.floor))));
  const lengths = [walker.x, walker.y, walker.eye].map((v) => v.toFixed(digits));
  return `#${[...lengths, walker.yaw.toFixed(3), walker.pitch.toFixed(3)].join(",")}`;
}

/** The place that a link names; parts that are missing or no numbers are left out. */
export function fromHash(hash) {
  const values = decodeURIComponent(hash.replace(/^#/, "")).split(",").map((v) => (v.trim() === "" ? NaN : Number(v)));
  const place = {};
  ["x", "y", "eye", "yaw", "pitch"].forEach((key, k) => {
    if (Number.isFinite(values[k])) place[key] = values[k];
  });
  return place;
}

/** Let keys, mouse, wheel and fingers move the walker; `changed` is called after each change that needs a picture. */
export function listen(walker, canvas, pad, changed) {
  addEventListener("keydown", (event) => {
    const name = KEYS[event.code];
    if (!name || event.ctrlKey || event.metaKey || event.altKey) return;
    if (name !== "run") event.preventDefault();
    walker.held.add(name);
    changed();
  });
  addEventListener("keyup", (event) => walker.held.delete(KEYS[event.code]));
  addEventListener("blur", () => walker.held.clear());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const pixels = event.deltaY * [1, 16, 400][event.deltaMode];
    put(walker, { eye: walker.eye * Math.exp(Math.min(Math.max(pixels, -200), 200) / 500) });
    changed();
  }, { passive: false });
  listenToPointers(walker, canvas, changed);
  pad.addEventListener("pointerdown", (event) => {
    pad.setPointerCapture(event.pointerId);
    walker.held.add("forward");
    changed();
  });
  for (const end of ["pointerup", "pointercancel"]) pad.addEventListener(end, () => walker.held.delete("forward"));
}

/** One pointer turns the view, as if the picture were held; two fingers walk (drag) and change height (pinch). */
function listenToPointers(walker, canvas, changed) {
  const down = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (event) => down.delete(event.pointerId));
  }
  canvas.addEventListener("pointermove", (event) => {
    const from = down.get(event.pointerId);
    if (!from) return;
    const to = [event.clientX, event.clientY], size = Math.max(canvas.clientWidth, canvas.clientHeight);
    const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
    down.set(event.pointerId, to);
    if (other) twoFingers(walker, from, to, other, size);
    else {
      const degrees = WIDE / size;
      put(walker, { yaw: walker.yaw + degrees * (to[0] - from[0]), pitch: walker.pitch + degrees * (to[1] - from[1]) });
    }
    changed();
  });
}

function twoFingers(walker, from, to, other, size) {
  const apart = (a) => Math.max(20, Math.hypot(a[0] - other[0], a[1] - other[1]));
  const yaw = (walker.yaw * Math.PI) / 180, scale = (4 * walker.eye) / size;
  const forward = scale * (to[1] - from[1]), left = scale * (to[0] - from[0]);
  put(walker, {
    x: walker.x + forward * Math.cos(yaw) - left * Math.sin(yaw),
    y: walker.y + forward * Math.sin(yaw) + left * Math.cos(yaw),
    eye: (walker.eye * apart(from)) / apart(to),
  });
}
