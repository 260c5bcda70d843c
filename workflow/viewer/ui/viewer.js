// The viewer: an open bundle, the walker in it, and what the worker and the GPU make of both.

import { sizeOf } from "../data/bundle.js";
import { PageError } from "../data/checks.js";
import { chunkKey } from "../data/layout.js";
import { OVERLAYS } from "../draw/overlays.js";
import { BUDGET, createFramePacing, createFrameStats } from "../draw/pacing.js";
import { createRenderer } from "../draw/renderer.js";
import { backdropOptions, listDrawnCells, openTerrain, readTerrain } from "../scene/open_terrain.js";
import { cameraAt } from "../terrain/camera.js";
import { tileUnder } from "../terrain/cells.js";
import { formatAddress, parseOverlay, parsePlace, parseSun, parseWind } from "./address.js";
import { element } from "./dom.js";
import { createResting } from "./frame_loop.js";
import { createPainting } from "./painting.js";
import { createTour } from "./tour.js";
import { createWalker, moveTo } from "./walker.js";
import { createWind, showDaylight, showWindButton } from "./weather.js";

/**
 * @typedef {import("../data/source.js").Source} Source
 * @typedef {import("./walker.js").Walker} Walker
 * @typedef {import("../draw/renderer.js").SlicedPicture} SlicedPicture
 *
 * An open bundle. renderer: null while the graphics context is lost; frame: the worker's last; coarse: chunks of the
 * coarsest level that have arrived.
 * @typedef {import("../scene/open_terrain.js").OpenTerrain & { walker: Walker,
 *   renderer: import("../draw/renderer.js").Renderer | null,
 *   frame: import("../worker/frame_builder.js").FrameAnswer | null, coarse: number,
 *   painting: import("./painting.js").Painting }} Scene
 *
 * still: draw only when asked, for tests and screenshots; firstBudget: of the first picture then; onFirstScene: called
 * when the first bundle's manifest is read; onScene: called, and awaited, when any is, `first` or not; onSize: called,
 * and awaited, before the page's own parts are read, with their bytes; onPaint: something
 * was painted or set; onPicture: a picture was drawn; onWhole: one of all Gaussians.
 * @typedef {{ still: boolean, firstBudget: number, onFirstScene: (walker: Walker) => void,
 *   onScene: (scene: Scene, first: boolean) => Promise<void>, onSize: (bytes: number) => Promise<void>, onPaint: () => void, onPicture: () => void,
 *   onWhole: () => void }} Options
 */

const MAX_PIXEL_RATIO = 1.5; // device pixels a CSS pixel: splats are soft, pixels cost
const RETRY = 50; // milliseconds until a lost graphics context is asked for again

export class Viewer {
  /** @type {Scene | null} */
  scene = null;
  loaded = false;
  opened = 0; // bundles that were loaded
  /** @type {string | null} */
  error = null;
  overlay = 0;
  dirty = true; // the picture must be drawn again
  stale = true; // the worker must be asked again
  shaded = true; // the shadows fit the place
  pacing = createFramePacing();
  stats = createFrameStats();
  tour = createTour();
  wind = createWind();
  resting = createResting(this);
  /** @type {Walker | null} */
  #walker = null; // the one that the controls move, through all bundles
  #fresh = false; // the worker has answered since the last picture
  #restored = Promise.resolve(); // pending while the graphics context is lost

  /**
   * @param {HTMLCanvasElement} canvas @param {import("../draw/gl.js").GL} gl
   * @param {import("./hud.js").Hud} hud @param {Options} options
   */
  constructor(canvas, gl, hud, options) {
    this.canvas = canvas;
    this.gl = gl;
    this.hud = hud;
    this.options = options;
    this.#watchContext();
  }

  /**
   * Open a bundle: the page's own, or one that was dropped. The picture stays until the manifest is read.
   *
   * @param {Source} source
   */
  async open(source) {
    const files = await readTerrain(source), { manifest } = files;
    const before = this.scene;
    before?.end();
    before?.renderer?.end();
    this.scene = null; // until the new one stands
    const first = !this.#walker, begin = createWalker(manifest, first ? parsePlace(location.hash) : {});
    const terrain = openTerrain(files, {
      onRecords: (records) => this.#addRecords(records),
      onFrame: (frame) => this.#setFrame(frame),
      onError: (error) => this.fail(error),
    });
    this.loaded = false;
    this.error = null;
    let renderer;
    try {
      renderer = createRenderer(this.gl, manifest, terrain.heights);
    } catch (error) {
      terrain.end();
      throw error;
    }
    const walker = Object.assign(this.#walker ?? begin, begin, { mode: this.#walker?.mode ?? begin.mode });
    this.#walker = walker;
    const painting = createPainting(manifest, terrain.client, () => {
      this.options.onPaint();
      this.redraw();
    });
    const scene = { ...terrain, walker, renderer, frame: null, coarse: 0, painting };
    this.scene = scene;
    if (first) {
      this.overlay = parseOverlay(location.hash);
      terrain.light?.choose(parseSun(location.hash));
      this.wind.switch(parseWind(location.hash));
      this.options.onFirstScene(walker);
    }
    element("tools", HTMLElement).hidden = false;
    this.#showLegend();
    showDaylight(terrain.light);
    showWindButton(this.wind, manifest);
    this.drawFrame(); // sky and far ground at once
    await this.options.onScene(this.scene, first);
    if (first) await this.options.onSize(sizeOf(manifest));
    if (this.scene !== scene || !await terrain.readAll((progress) => this.hud.showProgress(progress))) return; // another one was opened
    this.loaded = true;
    if (this.options.still) await this.settle(this.options.firstBudget);
    else {
      this.askWorker(this.pacing.budget, false);
      await terrain.client.answered();
    }
    this.opened += 1;
    this.hud.showLoaded();
  }

  /** The camera of the walker's eye. @param {Scene} scene @param {number} [scale] of the resolution */
  camera({ walker, heights }, scale = 1) {
    const ratio = scale * Math.min(devicePixelRatio, MAX_PIXEL_RATIO);
    /** @param {number} size */
    const pixels = (size) => Math.max(1, Math.round(size * ratio));
    return cameraAt(walker, pixels(this.canvas.clientWidth), pixels(this.canvas.clientHeight), heights);
  }

  /**
   * Ask the worker for a frame of the walker's place.
   *
   * @param {number} budget
   * @param {boolean} patient wait for every batch of it
   */
  askWorker(budget, patient) {
    if (!this.scene) return;
    this.stale = false;
    this.scene.client.ask(this.camera(this.scene), budget, patient);
  }

  /**
   * Draw the picture now, of the worker's last frame.
   *
   * @param {number} [scale] of the resolution @param {import("../draw/wind.js").Wind | null} [wind]
   */
  drawFrame(scale = 1, wind = null) {
    const { scene } = this;
    if (!scene?.renderer) return;
    const start = performance.now(), camera = this.camera(scene, scale);
    this.#fit(camera);
    this.gl.viewport(0, 0, camera.width, camera.height);
    scene.renderer.draw(camera, { ...this.drawOptions(scene, camera), wind });
    this.dirty = false;
    this.stats.addTime("render", performance.now() - start);
    this.stats.addFrame(this.#fresh);
    this.#fresh = false;
    this.#tellNumbers(scene, start);
  }

  /** Begin the picture of the worker's last frame in slices. @param {SlicedPicture} picture */
  begin(picture) {
    const { scene } = this;
    if (!scene) return;
    const camera = this.camera(scene);
    picture.begin(camera, this.drawOptions(scene, camera));
    this.dirty = false;
  }

  /** Show a picture that was drawn in slices. @param {SlicedPicture} picture */
  show(picture) {
    const { scene } = this;
    if (!scene) return;
    this.#fit(this.camera(scene));
    picture.show();
    this.#tellNumbers(scene, performance.now());
  }

  /** @param {import("../terrain/camera.js").Camera} camera */
  #fit({ width, height }) {
    const { canvas } = this;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  }

  /** @param {Scene} scene @param {import("../terrain/camera.js").Camera} camera */
  drawOptions(scene, camera) {
    return { ...backdropOptions(scene, scene.frame, camera), overlay: this.overlay };
  }

  /** @param {Scene} scene @param {number} now */
  #tellNumbers(scene, now) {
    this.hud.numbers.show({
      now, state: () => describeScene(scene), stats: () => this.stats.summary(), fps: this.pacing.fps,
      unit: scene.manifest.unit, force: this.options.still,
    });
    this.options.onPicture();
  }

  /**
   * Draw the picture of this place exactly, however long the worker takes: for pictures that are kept or compared.
   *
   * @param {number} [budget]
   * @returns {Promise<void>}
   */
  async settle(budget = BUDGET.most) {
    await this.#restored;
    const renderer = this.scene?.renderer;
    this.askWorker(budget, true);
    await this.scene?.client.answered();
    if (this.scene) await this.scene.light?.finish([this.scene.walker.x, this.scene.walker.y]);
    this.drawFrame();
    // the context may be lost without an event yet, or be back and empty
    if (this.gl.isContextLost() || renderer !== this.scene?.renderer) {
      await new Promise((done) => setTimeout(done, RETRY));
      return this.settle(budget);
    }
  }

  /** A picture is due: at the next turn of the frame loop, or now if there is none. */
  redraw() {
    this.dirty = this.stale = true;
    if (this.options.still) this.settle().catch((error) => this.fail(error));
  }

  /** @param {Partial<import("../terrain/camera.js").Place>} place */
  setPlace(place) {
    if (this.scene) moveTo(this.scene.walker, place);
    this.dirty = this.stale = true;
  }

  /** @param {number} overlay */
  showOverlay(overlay) {
    this.overlay = overlay;
    this.#showLegend();
    this.redraw();
  }

  /** @param {import("../terrain/light.js").ChosenSun} sun */
  showSun(sun) {
    const light = this.scene?.light;
    if (!light || light.chosen === sun) return;
    light.choose(sun);
    showDaylight(light);
    this.redraw();
  }

  /** @param {boolean} on */
  showWind(on) {
    this.wind.switch(on);
    if (this.scene) showWindButton(this.wind, this.scene.manifest);
  }

  #showLegend() {
    this.hud.legend.show(this.overlay, this.scene?.manifest ?? null);
    element("overlay", HTMLSelectElement).selectedIndex = this.overlay;
  }

  /** The address of this place. @param {string} paint of what is painted */
  address(paint) {
    return this.scene ? formatAddress(this.scene.walker, this.overlay, paint, this.scene.light?.chosen, this.wind.on) : "";
  }

  /** The finest picture of this place as a PNG file, when it is drawn. @returns {Promise<Blob>} */
  async takePicture() {
    if (this.options.still) await this.settle();
    return new Promise((done, refuse) => {
      const take = () => this.canvas.toBlob((blob) => (blob ? done(blob) : refuse(new Error("the picture cannot be saved"))));
      if (this.options.still) take();
      else this.resting.whenWhole(take);
    });
  }

  /** What is on the screen, in plain values. */
  state() {
    const { loaded, opened, error, overlay, pacing: { budget } } = this;
    const view = this.scene ? describeScene(this.scene) : { drawn: [], count: 0, work: null, missing: 0 };
    return { ...view, overlay: OVERLAYS[overlay], budget, loaded, opened, error, whole: this.resting.whole, mode: this.scene?.walker.mode };
  }

  /** Tell the person what went wrong. @param {unknown} error */
  fail(error) {
    this.error = explainError(error);
    this.hud.showError(this.error);
    console.error(error);
  }

  /** @param {import("../worker/worker.js").Records} records */
  #addRecords(records) {
    const { scene } = this;
    if (!scene) return;
    scene.renderer?.splats.addRecords(records);
    if (records.level === scene.manifest.levels.length - 1) scene.coarse += 1;
    const isMissing = scene.frame?.missing.includes(chunkKey(records.tile, records.level));
    if (!this.loaded || isMissing) this.dirty = this.stale = true; // else it may be needed later
  }

  /** @param {import("../worker/frame_builder.js").FrameAnswer} frame */
  #setFrame(frame) {
    const { scene } = this;
    if (!scene) return;
    scene.renderer?.splats.setFrame(frame);
    this.stats.addTime("update", frame.milliseconds.update);
    this.stats.addTime("sort", frame.milliseconds.sort);
    scene.frame = frame;
    this.dirty = this.#fresh = true;
    if (frame.incomplete) this.stale = true;
  }

  #watchContext() {
    let restored = () => {};
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      if (this.scene) this.scene.renderer = null;
      this.#restored = new Promise((done) => (restored = done));
      this.hud.showError("The graphics driver took the picture away; it comes back as soon as the driver does.");
    });
    this.canvas.addEventListener("webglcontextrestored", () => {
      const { scene } = this;
      if (scene) {
        scene.renderer = createRenderer(this.gl, scene.manifest, scene.heights);
        scene.client.restore();
      }
      restored();
      this.hud.hideError();
      this.redraw();
    });
  }
}

/** Place and picture of a scene, in plain values. @param {Scene} scene */
function describeScene({ manifest, walker, frame, heights }) {
  const { x, y, eye, yaw, pitch } = walker, drawn = frame ? listDrawnCells(frame) : [];
  const { count = 0, reach, shrink, work = null, missing = [] } = frame ?? {};
  const under = tileUnder(manifest, heights, x, y);
  return { x, y, eye, yaw, pitch, under, drawn, count, reach, shrink, work, missing: missing.length };
}

/** One sentence for the person at the screen. @param {unknown} error */
export function explainError(error) {
  if (error instanceof PageError) return error.message;
  const { name = "", message = String(error) } = /** @type {Partial<Error>} */ (error ?? {});
  if (error instanceof RangeError || name === "RangeError" || name === "NotReadableError") {
    return "The terrain does not fit into this browser's memory. Close other pages, or open it on a larger machine.";
  }
  return `Something unexpected went wrong: ${message}. Reload the page; if it stays, please report it.`;
}
