// What tests see of a page: window.davgswt. Served beside the page by fixtures/page_visit.py; no user's page loads it.

import { OVERLAYS } from "./draw/overlays.js";
import { paint, ready, viewer } from "./main.js";

Object.assign(window, {
  davgswt: {
    ready,
    get state() {
      return viewer.state();
    },
    /** Is the tour under way? */
    get tour() {
      return viewer.tour.on;
    },
    get walker() {
      return viewer.scene?.walker;
    },
    get painting() {
      return viewer.scene?.painting;
    },
    get paint() {
      return paint;
    },
    /** @param {Partial<import("./terrain/camera.js").Place>} place */
    set: (place) => viewer.setPlace(place),
    /** @param {string} name */
    overlay: (name) => viewer.showOverlay(OVERLAYS.indexOf(name)),
    /** The finest picture of the place as PIXELS of fixtures/page_visit.py returns it, when it is shown. */
    grab: () => new Promise((done) => viewer.resting.whenWhole(({ width, height }) => {
      const { gl } = viewer, bytes = new Uint8Array(4 * width * height);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
      done([width, height, btoa(Array.from(bytes, (v) => String.fromCharCode(v)).join(""))]);
    })),
    /** @param {number} [budget] */
    settle: (budget) => viewer.settle(budget),
  },
});
