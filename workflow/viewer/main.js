// The page: load the terrain beside it, draw it, let people walk. `?still` draws only when asked (tests, screenshots).

import { PageError, readChunks, readManifest } from "./bundle.js";
import { context } from "./gl.js";
import { createHud } from "./hud.js";
import { BUDGET, createPace } from "./pace.js";
import { createSky } from "./sky.js";
import { createSplats } from "./splats.js";
import { createTerrain, tileUnder, visible } from "./terrain.js";
import { cameraOf, createWalker, fromHash, listen, put, step, toHash } from "./walk.js";

const SHARPEST = 1.5; // device pixels a CSS pixel at most: splats are soft, pixels cost
const LONGEST_STEP = 250; // milliseconds of walking a frame makes up for at most
const PREVIEW_SHARE = 5; // while loading, this many times a picture's own time passes before the next
const LINK_EVERY = 500; // milliseconds between updates of the address

document.documentElement.classList.add("running"); // takes the hint away that nothing happens
const still = new URLSearchParams(location.search).has("still");
const canvas = document.getElementById("picture");
const hud = createHud(document);
const page = { loaded: false, error: null, dirty: true, chunks: [], milliseconds: 0 };
page.pace = createPace();
if (still) page.pace.budget = BUDGET.still;

/** Make what draws; again after the graphics context was lost. */
function raise() {
  page.sky = createSky(page.gl, page.manifest);
  page.splats = createSplats(page.gl, page.manifest.encoding);
  for (const chunk of page.chunks) page.splats.add(chunk);
  page.preview = { fence: null, start: 0, next: 0, due: false };
}

/** Draw the picture now. */
function frame() {
  if (!page.splats) return;
  const start = performance.now(), { gl, terrain, walker } = page;
  const ratio = Math.min(devicePixelRatio, SHARPEST);
  const pixels = (size) => Math.max(1, Math.round(size * ratio));
  const width = pixels(canvas.clientWidth), height = pixels(canvas.clientHeight);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  gl.viewport(0, 0, width, height);
  const camera = cameraOf(walker, width, height);
  const seen = visible(terrain, camera, page.loaded ? page.pace.budget : BUDGET.least);
  page.sky.draw(camera, seen.reach);
  page.splats.draw(camera, seen.tiles, seen);
  if (page.preview.due) page.preview.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  Object.assign(page, { seen, dirty: false, milliseconds: performance.now() - start });
  page.preview.due = false;
  hud.numbers(start, state, { fps: page.pace.fps, milliseconds: page.milliseconds }, page.manifest.unit, still);
}

/** What is on the screen, in plain values. */
function state() {
  const { walker, terrain, seen } = page;
  const drawn = seen?.tiles.map(({ i, j, tile, level, order }) => ({ i, j, tile, level, order })) ?? [];
  const place = walker && { x: walker.x, y: walker.y, eye: walker.eye, yaw: walker.yaw, pitch: walker.pitch };
  const under = walker && tileUnder(terrain, walker.x, walker.y);
  const { loaded, error, pace: { budget } } = page;
  return { ...place, under, drawn, count: seen?.count ?? 0, reach: seen?.reach, budget, loaded, error };
}

/** Keep drawing while something changes; hold the frame rate by drawing fewer Gaussians, never fewer frames. */
function loop() {
  let last = performance.now(), drew = false;
  const next = (now) => {
    requestAnimationFrame(next);
    const gap = now - last;
    last = now;
    const walked = step(page.walker, Math.min(gap, LONGEST_STEP) / 1000);
    const draw = (walked || page.dirty) && (page.loaded || mayPreview(now));
    if (!draw || !drew) page.pace.rest();
    else if (page.pace.frame(gap, page.seen.count)) page.dirty = true;
    if (draw) frame();
    drew = draw;
  };
  requestAnimationFrame(next);
}

/**
 * While pieces arrive: a picture when the coarsest level is there, and another when the one before is finished and the
 * loading has had most of the time since. On a slow machine pictures would hold up the pieces that they wait for.
 */
function mayPreview(now) {
  const { gl, manifest, terrain, preview } = page;
  if (preview.fence) {
    if (gl.getSyncParameter(preview.fence, gl.SYNC_STATUS) !== gl.SIGNALED) return false;
    gl.deleteSync(preview.fence);
    preview.fence = null;
    preview.next = now + PREVIEW_SHARE * (now - preview.start);
  }
  if (now < preview.next || !terrain.arrived.every((levels) => levels.has(manifest.levels.length - 1))) return false;
  preview.start = now;
  preview.due = true;
  return true;
}

function keepLink() {
  let told = location.hash;
  const tell = () => {
    const hash = toHash(page.walker);
    if (hash !== told) history.replaceState(null, "", (told = hash));
  };
  setInterval(tell, LINK_EVERY);
  addEventListener("pagehide", tell);
  addEventListener("hashchange", () => {
    if (location.hash === told) return;
    put(page.walker, fromHash((told = location.hash)));
    redraw();
  });
}

/** A picture is due: at the next frame of the loop, or at once where there is none. */
function redraw() {
  page.dirty = true;
  if (still) frame();
}

function surviveLoss() {
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    page.splats = null;
    hud.error("The graphics driver took the picture away; it comes back as soon as the driver does.");
  });
  canvas.addEventListener("webglcontextrestored", () => {
    raise();
    hud.recovered();
    redraw();
  });
}

async function start() {
  page.gl = context(canvas);
  const base = new URL(".", location.href);
  page.manifest = await readManifest(new URL("davgswt.json", base));
  page.terrain = createTerrain(page.manifest);
  page.walker = createWalker(page.manifest, fromHash(location.hash));
  raise();
  surviveLoss();
  listen(page.walker, canvas, document.getElementById("pad"), redraw);
  new ResizeObserver(redraw).observe(canvas);
  hud.started();
  frame(); // sky and far ground at once
  if (!still) {
    loop();
    keepLink();
  }
  await readChunks(page.manifest, base, {
    take(chunk) {
      page.chunks.push(chunk);
      page.splats?.add(chunk);
      page.terrain.arrived[chunk.tile].add(chunk.level);
      page.dirty = true;
    },
    onProgress: hud.progress,
  });
  page.loaded = true;
  hud.loaded(still);
  frame();
  return state();
}

/** One sentence for the person at the screen. */
function explain(error) {
  if (error instanceof PageError) return error.message;
  if (error instanceof RangeError) {
    return "The terrain does not fit into this browser's memory. Close other pages, or open it on a larger machine.";
  }
  return `Something unexpected went wrong: ${error?.message ?? error}. Reload the page; if it stays, please report it.`;
}

const ready = start().catch((error) => {
  page.error = explain(error);
  hud.error(page.error);
  console.error(error);
  throw error;
});
ready.catch(() => {}); // shown above; whoever waits for `ready` still learns of it

/** For tests and screenshots: window.davgswt. */
window.davgswt = {
  ready,
  get state() {
    return state();
  },
  set(place) {
    put(page.walker, place);
    redraw();
  },
  frame,
};
