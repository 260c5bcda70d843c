// The page: load the terrain beside it, draw it, let people walk. `?still` draws only when asked (tests, screenshots);
// `?still=N`: the first picture has N Gaussians at most.

import { firstChunks, readChunks, readHeights, readManifest } from "./bundle.js";
import { listenToDrops } from "./drop.js";
import { createFlight } from "./flight.js";
import { context } from "./gl.js";
import { createHeights } from "./heights.js";
import { createHud } from "./hud.js";
import { OVERLAYS } from "./overlay.js";
import { BUDGET, createPace } from "./pace.js";
import { createPictures } from "./pictures.js";
import { createRest } from "./rest.js";
import { createSky } from "./sky.js";
import { fromWeb, PageError } from "./source.js";
import { createSplats } from "./splats.js";
import { createStats } from "./stats.js";
import { REACH, tileUnder } from "./terrain.js";
import { listenToTools, save } from "./tools.js";
import { cameraOf, createWalker, fromHash, listen, put, step, toHash } from "./walk.js";

const SHARPEST = 1.5; // device pixels a CSS pixel at most: splats are soft, pixels cost
const LONGEST_STEP = 250; // milliseconds of walking a frame makes up for at most
const PREVIEW_SHARE = 5; // while loading, this many times a picture's own time passes before the next
const LINK_EVERY = 500; // milliseconds between updates of the address
const PATIENCE = 50; // milliseconds until a lost graphics context is asked for again
const FEWEST_DOWN = 1e-4; // sine: the far ground pales within no less

document.documentElement.classList.add("running"); // takes the hint away that nothing happens
const asked = new URLSearchParams(location.search).get("still"), still = asked !== null;
const canvas = document.getElementById("picture");
const hud = createHud(document);
const page = {
  loaded: false, opened: 0, error: null, dirty: true, stale: true, fresh: false, overlay: 0, milliseconds: 0,
};
page.pace = createPace();
page.stats = createStats();
page.flight = createFlight();

/** Make what draws; again after the graphics context was lost. */
function raise() {
  page.sky = createSky(page.gl, page.manifest);
  page.splats = createSplats(page.gl, page.manifest, page.heights);
  page.rest = createRest(page.gl);
  page.preview = { fence: null, start: 0, next: 0, due: false };
}

function cameraNow() {
  const ratio = Math.min(devicePixelRatio, SHARPEST);
  const pixels = (size) => Math.max(1, Math.round(size * ratio));
  return cameraOf(page.walker, pixels(canvas.clientWidth), pixels(canvas.clientHeight), page.heights);
}

/** Ask the worker what to draw for where the walker is now. */
function ask(budget, patient) {
  page.stale = false;
  page.pictures.ask(cameraNow(), budget, patient);
}

/** Draw the picture now, of what the worker made last. */
function frame() {
  if (!page.splats) return;
  const start = performance.now(), { gl, seen, manifest, heights } = page, camera = cameraNow();
  const { width, height } = camera;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  gl.viewport(0, 0, width, height);
  const end = seen?.reach ?? REACH * manifest.tile_side;
  const low = Math.max(FEWEST_DOWN, (camera.eye[2] - heights.low) / (REACH * manifest.tile_side));
  const behind = { end, low, overlay: page.overlay };
  page.sky.draw(camera, behind);
  page.splats.draw(camera, behind);
  if (page.preview.due) page.preview.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  page.preview.due = page.dirty = false;
  page.milliseconds = performance.now() - start;
  page.stats.add("render", page.milliseconds);
  page.stats.frame(page.fresh);
  page.fresh = false;
  hud.numbers(start, state, page.stats.summary(), page.pace.fps, manifest.unit, still);
}

/** The picture of this place exactly, however long the worker takes: for pictures that are kept and compared. */
async function settle(budget = BUDGET.most) {
  await page.lost;
  const { splats } = page;
  ask(budget, true);
  await page.pictures.answered();
  frame();
  // the context may be lost without a word having been said of it yet, or have come back with nothing in it
  if (page.gl.isContextLost() || splats !== page.splats) {
    await new Promise((done) => setTimeout(done, PATIENCE));
    return settle(budget);
  }
}

/** What is on the screen, in plain values. */
function state() {
  const { walker, seen, manifest, loaded, opened, error, overlay, pace: { budget } } = page;
  const place = walker && { x: walker.x, y: walker.y, eye: walker.eye, yaw: walker.yaw, pitch: walker.pitch };
  const drawn = [];
  for (let k = 0; seen && k < seen.drawn.length; k += 6) {
    const [di, dj, tile, level, last, order] = seen.drawn.subarray(k, k + 6);
    drawn.push({ i: seen.i0 + di, j: seen.j0 + dj, tile, level, last, order });
  }
  const under = walker && tileUnder(manifest, walker.x, walker.y);
  const { count = 0, reach, shrink, bytes = 0 } = seen ?? {};
  const shown = { under, drawn, count, reach, shrink, bytes, overlay: OVERLAYS[overlay] };
  return { ...place, ...shown, budget, loaded, opened, error };
}

/** Keep drawing while something changes; hold the frame rate by drawing fewer Gaussians, never fewer frames. */
function loop() {
  let last = performance.now(), drew = false;
  const next = (now) => {
    requestAnimationFrame(next);
    const gap = now - last;
    last = now;
    const flown = page.flight.step(page.walker, gap / 1000);
    if (step(page.walker, Math.min(gap, LONGEST_STEP) / 1000) || flown) page.dirty = page.stale = true;
    const may = page.loaded || mayPreview(now);
    if (page.stale) page.rest.moved(now, page.pace.budget);
    if (page.stale && may && page.pictures.idle) ask(page.loaded ? page.pace.budget : BUDGET.least, false);
    else if (page.loaded && !page.dirty && page.pictures.idle) {
      const more = page.rest.next(now, page.seen?.shrink === 1);
      if (more) ask(more, true);
    }
    const draw = page.dirty && may;
    if (!draw || !drew) page.pace.rest();
    else if (page.pace.frame(gap, page.seen?.count ?? 0)) page.stale = true;
    if (draw) {
      page.preview.due = !page.loaded;
      frame();
      page.rest.drawn(now);
    }
    drew = draw && !page.seen?.patient; // a picture at rest may take its time
  };
  requestAnimationFrame(next);
}

/**
 * While pieces arrive: a picture when the coarsest level is there, and another when the one before is finished and the
 * loading has had most of the time since. On a slow machine pictures would hold up the pieces that they wait for.
 */
function mayPreview(now) {
  const { gl, preview, coarse, manifest } = page;
  if (preview.fence) {
    if (gl.getSyncParameter(preview.fence, gl.SYNC_STATUS) !== gl.SIGNALED) return false;
    gl.deleteSync(preview.fence);
    preview.fence = null;
    preview.next = now + PREVIEW_SHARE * (now - preview.start);
  }
  if (now < preview.next || coarse < manifest.tiles.length) return false;
  preview.start = now;
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

/** A picture is due: at the next frame of the loop, or now and again when the worker has answered. */
function redraw() {
  page.dirty = page.stale = true;
  if (still) settle().catch(fail);
}

function surviveLoss() {
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    page.splats = null;
    page.lost = new Promise((done) => (page.regained = done));
    hud.error("The graphics driver took the picture away; it comes back as soon as the driver does.");
  });
  canvas.addEventListener("webglcontextrestored", () => {
    raise();
    page.pictures.restore();
    page.regained();
    hud.recovered();
    redraw();
  });
}

/** What the worker says. */
const told = {
  records(chunk) {
    page.splats?.add(chunk);
    if (chunk.level === page.manifest.levels.length - 1) page.coarse += 1;
    page.dirty = page.stale = true;
  },
  refused: () => {},
  frame(seen) {
    page.splats?.take(seen);
    page.stats.add("update", seen.milliseconds.update);
    page.stats.add("sort", seen.milliseconds.sort);
    Object.assign(page, { seen, dirty: true, fresh: true });
    if (seen.wanting) page.stale = true;
    if (page.loaded) fetchMissing(seen.missing);
  },
  failed: fail,
};

/** Chunks that a set larger than the cache lacks here. */
function fetchMissing(missing) {
  const entries = missing.filter((key) => !page.coming.has(key)).map((key) => {
    page.coming.add(key);
    const tile = key >> 4, entry = page.manifest.tiles[tile].chunks.find(({ level }) => level === (key & 15));
    return { tile, entry };
  });
  if (!entries.length) return;
  readChunks(entries, page.source, { take: (chunk) => page.pictures.add(chunk) }).catch(fail).finally(() => {
    for (const { tile, entry } of entries) page.coming.delete(16 * tile + entry.level);
  });
}

/** Open a bundle: the page's own, or one that was dropped onto it. What is shown stays until the manifest is read. */
async function open(source) {
  const manifest = await readManifest(source), pixels = await readHeights(manifest, source);
  page.stop?.abort();
  page.pictures?.end();
  page.splats?.end();
  const stop = (page.stop = new AbortController());
  const walker = createWalker(manifest, page.walker ? {} : fromHash(location.hash));
  Object.assign(page, { manifest, source, loaded: false, error: null, seen: null, coarse: 0, coming: new Set() });
  page.walker = Object.assign(page.walker ?? walker, walker);
  page.heights = createHeights(manifest.heights, pixels);
  page.pictures = createPictures(manifest, pixels, told);
  raise();
  page.begin?.();
  page.begin = null;
  hud.started();
  frame(); // sky and far ground at once
  const take = (chunk) => page.pictures.add(chunk);
  try {
    await readChunks(firstChunks(manifest), source, { take, onProgress: hud.progress, signal: stop.signal });
  } catch (error) {
    if (stop.signal.aborted) return; // another bundle was dropped meanwhile
    throw error;
  }
  page.loaded = true;
  await settle(still ? Number(asked) || BUDGET.most : page.pace.budget);
  page.opened += 1;
  hud.loaded(still);
}

async function start() {
  page.gl = context(canvas);
  page.begin = () => {
    listen(page.walker, canvas, document.getElementById("pad"), redraw);
    new ResizeObserver(redraw).observe(canvas);
    listenToTools(document, page, { redraw, picture, cycle });
    if (still) return;
    loop();
    keepLink();
  };
  surviveLoss();
  listenToDrops(document, { open: reopen, flight: (value) => page.flight.load(value), fail });
  await open(fromWeb(new URL(".", location.href)));
  return state();
}

function reopen(source) {
  hud.opening();
  return open(source);
}

/** Keep what is on the screen as a file. */
async function picture() {
  await settle();
  canvas.toBlob((blob) => save(blob, "terrain.png"));
}

function cycle(overlay = (page.overlay + 1) % OVERLAYS.length) {
  page.overlay = overlay;
  redraw();
}

/** One sentence for the person at the screen. */
function explain(error) {
  if (error instanceof PageError) return error.message;
  if (error instanceof RangeError || error?.name === "RangeError" || error?.name === "NotReadableError") {
    return "The terrain does not fit into this browser's memory. Close other pages, or open it on a larger machine.";
  }
  return `Something unexpected went wrong: ${error?.message ?? error}. Reload the page; if it stays, please report it.`;
}

function fail(error) {
  page.error = explain(error);
  hud.error(page.error);
  console.error(error);
}

const ready = start().catch((error) => {
  fail(error);
  throw error;
});
ready.catch(() => {}); // shown above; whoever waits for `ready` still learns of it

/** For tests, screenshots and measurements: window.davgswt. */
window.davgswt = {
  ready,
  get state() {
    return state();
  },
  get stats() {
    return page.stats.summary();
  },
  flight: page.flight,
  set(place) {
    put(page.walker, place);
    page.dirty = page.stale = true;
  },
  overlay: (name) => cycle(OVERLAYS.indexOf(name)),
  settle,
  frame,
  /** As the loop asks: unless the worker is still busy with the last place. */
  ask: (budget) => page.pictures.idle && ask(budget, false),
  /** What the worker said last. */
  get answer() {
    return page.seen;
  },
};
