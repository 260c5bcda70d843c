// A WebXR device for tests: draws into the page's canvas, the left eye on its left half; frames come when a test asks.

{
  const canvas = () => document.getElementById("picture");
  const rigid = (x, y, z, yaw) => { // a rigid transform: yaw about y, radians
    const c = Math.cos(yaw), s = Math.sin(yaw);
    return { position: { x, y, z }, matrix: Float32Array.of(c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, x, y, z, 1) };
  };
  const projection = ({ left, right, down, up }) => {
    const p = new Float32Array(16);
    p[0] = 2 / (left + right);
    p[5] = 2 / (down + up);
    p[8] = (right - left) / (left + right);
    p[9] = (up - down) / (down + up);
    return p;
  };
  class Session extends EventTarget {
    renderState = {};
    inputSources = [];
    updateRenderState(state) {
      Object.assign(this.renderState, state);
    }
    async requestReferenceSpace(kind) {
      return { kind };
    }
    requestAnimationFrame(draw) {
      this.due = draw;
      return 1;
    }
    async end() {
      this.due = null;
      this.dispatchEvent(new Event("end"));
    }
  }
  const mock = window.xrMock = {
    time: 0,
    head: [0, 1.6, 0, 0], // x, y, z, yaw
    apart: 0.064, // eyes
    fields: [{ left: 1.2, right: 0.7, down: 1, up: 0.8 }, { left: 0.7, right: 1.2, down: 1, up: 0.8 }],
    /** Let the session draw a frame and return the canvas: width, height, RGBA from below. */
    frame(milliseconds = 14) {
      const { session, head: [x, y, z, yaw], apart, fields } = mock, draw = session.due;
      const eyes = [-apart / 2, apart / 2].map((dx) => rigid(x + dx * Math.cos(yaw), y, z - dx * Math.sin(yaw), yaw));
      mock.time += milliseconds;
      draw(1000 + mock.time, {
        getViewerPose: () => ({ transform: rigid(x, y, z, yaw), views: eyes.map((transform, eye) => ({
          eye: ["left", "right"][eye], transform, projectionMatrix: projection(fields[eye]),
        })) }),
      });
      const gl = canvas().getContext("webgl2"), { drawingBufferWidth: w, drawingBufferHeight: h } = gl;
      const bytes = new Uint8Array(4 * w * h);
      gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
      let text = "";
      for (let k = 0; k < bytes.length; k += 4096) text += String.fromCharCode(...bytes.subarray(k, k + 4096));
      return [w, h, btoa(text)];
    },
  };
  Object.defineProperty(navigator, "xr", { value: {
    isSessionSupported: async (mode) => mode === "immersive-vr",
    requestSession: async () => (mock.session = new Session()),
  } });
  window.XRWebGLLayer = class {
    framebuffer = null;
    constructor() {
      const { clientWidth: width, clientHeight: height } = canvas();
      Object.assign(canvas(), { width, height });
    }
    getViewport({ eye }) {
      const { width, height } = canvas();
      return { x: eye === "left" ? 0 : width / 2, y: 0, width: width / 2, height };
    }
  };
  WebGL2RenderingContext.prototype.makeXRCompatible = async () => {};
}
