// Virtual reality: a session of WebXR in which both eyes are drawn. Its button is there where a headset is.

import { createFramePacing } from "../draw/frame_pacing.js";
import { createMarker } from "../draw/marker.js";
import { element } from "./dom.js";
import { moveTo } from "./walker.js";
import { createXrControls } from "./xr_controls.js";
import { eyeCamera, headCamera, placed } from "./xr_rig.js";

/**
 * @typedef {import("./viewer.js").Viewer} Viewer
 * @typedef {import("./viewer.js").Scene} Scene
 * @typedef {import("./xr_rig.js").Transform} Transform
 * @typedef {import("./xr_rig.js").Viewport} Viewport
 * @typedef {import("./xr_rig.js").View} View
 * @typedef {import("./xr_rig.js").Rig} Rig
 * @typedef {{ framebuffer: WebGLFramebuffer | null, getViewport: (view: View) => Viewport }} Layer
 * @typedef {import("./xr_controls.js").PoseFrame
 *   & { getViewerPose: (space: unknown) => { transform: Transform, views: View[] } | null | undefined }} Frame
 * @typedef {EventTarget & { inputSources: Iterable<import("./xr_controls.js").InputSource>, frameRate?: number,
 *   renderState: { baseLayer?: Layer }, end: () => Promise<void>, updateRenderState: (state: object) => void,
 *   requestReferenceSpace: (kind: string) => Promise<unknown>,
 *   requestAnimationFrame: (draw: (time: number, frame: Frame) => void) => number }} Session
 * @typedef {{ isSessionSupported: (mode: string) => Promise<boolean>,
 *   requestSession: (mode: string, options: object) => Promise<Session> }} System
 */

const STANDING = 1.6; // metres from the floor to the eyes
const RATE = 72; // frames a second, where the session does not say
const RING = 0.35; // metres: radius of the mark of a teleport
const LONGEST = 0.25; // seconds that one frame makes up for
const MODE = "immersive-vr";

/** @param {Viewer} viewer */
export function listenToXr(viewer) {
  const button = element("xr", HTMLButtonElement), { hud } = viewer;
  const { xr } = /** @type {{ xr?: System }} */ (/** @type {unknown} */ (navigator));
  if (!xr) return;
  xr.isSessionSupported(MODE).then((there) => (button.hidden = !there), () => {}); // a page may be forbidden to ask
  /** @type {Session | null} */
  let session = null;

  async function enter() {
    if (!xr || !viewer.scene || viewer.suspended) return;
    if (viewer.scene.walker.radius) return hud.say("Virtual reality is not for planets yet.");
    const entered = await xr.requestSession(MODE, { optionalFeatures: ["local-floor"] });
    session = entered;
    viewer.tour.stop();
    viewer.flyPath.stop();
    entered.addEventListener("end", () => {
      session = null;
      viewer.suspended = false;
      button.textContent = "Enter VR";
      viewer.redraw();
    });
    button.textContent = "Leave VR";
    viewer.suspended = true;
    try {
      await runSession(viewer, entered);
    } catch (error) {
      await entered.end();
      throw error;
    }
  }
  button.addEventListener("click", () => {
    if (session) session.end();
    else enter().catch((error) => hud.showError(`Virtual reality does not start: ${error.message}.`));
  });
}

/** @param {Scene} scene @param {number} floor @returns {Rig} */
function rigAt({ walker, manifest }, floor) {
  const scale = manifest.unit === "metre" ? Math.max(1, walker.floor / STANDING) : walker.eye / STANDING;
  return { x: walker.x, y: walker.y, turn: (walker.yaw * Math.PI) / 180, scale, floor };
}

/** Draw a session until it ends. @param {Viewer} viewer @param {Session} session */
async function runSession(viewer, session) {
  const { gl, scene } = viewer;
  await /** @type {any} */ (gl).makeXRCompatible();
  session.updateRenderState({ baseLayer: new /** @type {any} */ (globalThis).XRWebGLLayer(session, gl, {
    alpha: false, antialias: false, depth: false, stencil: false,
  }) });
  let floor = 0;
  const space = await session.requestReferenceSpace("local-floor").catch(() => {
    floor = STANDING; // this one begins at the head
    return session.requestReferenceSpace("local");
  });
  if (!scene) return;
  const rig = rigAt(scene, floor), pacing = createFramePacing(1000 / (session.frameRate ?? RATE)), marker = createMarker(gl);
  const controls = createXrControls(rig, matchMedia("(prefers-reduced-motion: reduce)").matches);
  const draw = createEyes(viewer, rig, pacing, marker);
  /** @type {Transform | null} */
  let head = null;
  let last = 0;
  /** @param {Event} event */
  const sourceOf = (event) => /** @type {any} */ (event).inputSource;
  session.addEventListener("selectstart", (event) => controls.aim(sourceOf(event)));
  session.addEventListener("selectend", () => controls.go(head));
  session.addEventListener("end", marker.end);
  /** @param {number} time @param {Frame} frame */
  const next = (time, frame) => {
    session.requestAnimationFrame(next);
    const gap = last ? time - last : 0, pose = frame.getViewerPose(space), now = viewer.scene;
    last = time;
    if (!pose || !now?.renderer) return pacing.reset(); // tracking is lost, or the graphics context
    head = pose.transform;
    const { heights, lift, manifest: { tile_side: farthest } } = now;
    /** @param {number} x @param {number} y */
    const ground = (x, y) => heights.at(x, y)[0] + lift;
    controls.step(session.inputSources, frame, space, head, { heights, lift, farthest, ground },
      Math.min(gap / 1000, LONGEST));
    if (gap) pacing.addFrame(gap, now.frame?.count ?? 0);
    draw(pose, session.renderState.baseLayer, ground, controls.goal);
  };
  session.requestAnimationFrame(next);
}

/**
 * What draws a pose: both eyes of the worker's last frame; the walker goes along, and the worker is asked for the next.
 *
 * @param {Viewer} viewer
 * @param {Rig} rig
 * @param {import("../draw/frame_pacing.js").FramePacing} pacing
 * @param {ReturnType<typeof createMarker>} marker
 */
function createEyes(viewer, rig, pacing, marker) {
  const { gl } = viewer;
  /**
   * @param {{ transform: Transform, views: View[] }} pose
   * @param {Layer | undefined} layer
   * @param {(x: number, y: number) => number} ground
   * @param {[number, number] | null} goal
   */
  return ({ transform, views }, layer, ground, goal) => {
    const { scene } = viewer, renderer = scene?.renderer;
    if (!scene || !renderer || !layer || !views.length) return;
    gl.bindFramebuffer(gl.FRAMEBUFFER, layer.framebuffer);
    gl.enable(gl.SCISSOR_TEST);
    const cameras = views.map((view) => {
      view.requestViewportScale?.(pacing.scale);
      const viewport = layer.getViewport(view), eye = placed(rig, view.transform.position, ground, transform.position);
      const { camera, around } = eyeCamera(rig, view, viewport, eye);
      gl.viewport(around.x, around.y, around.width, around.height);
      gl.scissor(viewport.x, viewport.y, viewport.width, viewport.height);
      renderer.draw(camera, { ...viewer.drawOptions(scene, camera), split: 0 });
      if (goal) marker.draw(camera, goal, rig.scale * RING, ground);
      return camera;
    });
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const head = headCamera(rig, transform, placed(rig, transform.position, ground, transform.position), cameras);
    if (scene.client.idle) scene.client.ask(head, pacing.budget, false);
    follow(scene, head);
  };
}

/** Take the walker along, so that the page shows where one was. @param {Scene} scene @param {import("../terrain/camera.js").Camera} head */
function follow({ walker, heights }, { eye: [x, y, z], ahead }) {
  const degrees = 180 / Math.PI;
  moveTo(walker, {
    x, y, eye: z - heights.at(x, y)[0], yaw: degrees * Math.atan2(ahead[1], ahead[0]),
    pitch: degrees * Math.asin(Math.min(Math.max(ahead[2], -1), 1)),
  });
}
