// The page: the viewer, wired to the document. `?still` draws only when asked (tests, screenshots); `?still=N`: the
// first picture has N Gaussians at most.

import { webSource } from "./data/source.js";
import { createContext } from "./draw/gl.js";
import { BUDGET } from "./draw/pacing.js";
import { parsePaint, syncAddress } from "./ui/address.js";
import { createOrbit, listenToControls } from "./ui/controls.js";
import { createPanel, element } from "./ui/dom.js";
import { listenToDrops } from "./ui/drop.js";
import { createFirstView } from "./ui/first_view.js";
import { runFrameLoop } from "./ui/frame_loop.js";
import { createHud } from "./ui/hud.js";
import { createMinimap } from "./ui/legend.js";
import { createPaintPanel } from "./ui/paint_panel.js";
import { createStoryPanel } from "./ui/story.js";
import { listenToTools } from "./ui/tools.js";
import { listenToTour } from "./ui/tour.js";
import { explainError, Viewer } from "./ui/viewer.js";
import { listenToDaylight, listenToWind } from "./ui/weather.js";

document.documentElement.classList.add("running"); // hides the hint that nothing happens
const hud = createHud(), menu = createPanel("menu");
const story = createStoryPanel(() => viewer.scene?.manifest.light, (error) => hud.showError(explainError(error)));
const firstView = createFirstView({ onStep: closePanels });

/** @type {Viewer} */
export let viewer;
/** @type {ReturnType<typeof createPaintPanel>} */
export let paint;

/** @type {ReturnType<typeof createMinimap> | null} */
let map = null;

/** Resolves when the page's own bundle is loaded. */
export const ready = start().catch((error) => {
  if (viewer) viewer.fail(error);
  else hud.showError(explainError(error));
  firstView.showTerrain();
  throw error;
});
ready.catch(() => {}); // shown above; whoever waits for `ready` still learns of it

function closePanels() {
  menu.show(false);
  story.show(false);
}

async function start() {
  const canvas = element("picture", HTMLCanvasElement);
  const asked = new URLSearchParams(location.search).get("still"), still = asked !== null;
  const redraw = () => viewer.redraw();
  canvas.addEventListener("pointerdown", closePanels);
  viewer = new Viewer(canvas, createContext(canvas), hud, {
    still,
    firstBudget: Number(asked) || BUDGET.most,
    onFirstScene(walker) {
      listenToControls(walker, createOrbit(viewer), canvas, element("pad", HTMLElement), paint.brush, redraw);
      new ResizeObserver(redraw).observe(canvas);
      listenToTools(viewer, paint.keep, walker);
      listenToDaylight(viewer);
      listenToWind(viewer);
      map = createMinimap(viewer);
      if (still) return;
      runFrameLoop(viewer);
      syncAddress(viewer, paint.keep);
    },
    async onScene(scene, first) {
      paint.showScene(scene);
      firstView.showScene(scene.walker, first);
      if (!first) element("storyButton", HTMLButtonElement).hidden = true; // it is of the page's own terrain
      if (first) await paint.keep.follow(parsePaint(location.hash), false).catch((error) => viewer.fail(error));
    },
    onSize: (bytes) => hud.askToLoad(bytes),
    onPaint() {
      paint.note();
      firstView.showTerrain();
    },
    onPicture() {
      paint.brush.draw();
      paint.drawObjects();
      map?.draw();
      const { scene, overlay } = viewer;
      if (scene) firstView.note(scene.walker, overlay > 0 || (scene.light?.chosen ?? null) !== null);
    },
    onWhole: firstView.showTerrain,
  });
  paint = createPaintPanel(viewer);
  for (const id of ["paintButton", "storyButton"]) {
    element(id, HTMLButtonElement).addEventListener("click", () => menu.show(false));
  }
  listenToDrops({
    async openSource(source) {
      hud.showOpening();
      await viewer.open(source);
    },
    loadJson: (json) => paint.keep.load(json),
    onError: (error) => viewer.fail(error),
  });
  await viewer.open(webSource(new URL(".", location.href)));
  if (still) return;
  firstView.showHint();
  listenToTour(viewer, closePanels);
}
