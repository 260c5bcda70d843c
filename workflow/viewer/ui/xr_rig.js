// Where a headset's space lies in the world, and the cameras of its eyes.

/**
 * The part of WebXR that is used here; https://www.w3.org/TR/webxr. Spaces have x to the right, y up, z backwards, metres.
 * @typedef {{ x: number, y: number, z: number }} Point
 * @typedef {{ position: Point, matrix: Float32Array }} Transform
 * @typedef {{ projectionMatrix: Float32Array, transform: Transform,
 *   requestViewportScale?: (scale: number) => void }} View
 * @typedef {{ x: number, y: number, width: number, height: number }} Viewport
 * @typedef {import("../terrain/camera.js").Camera} Camera
 *
 * x, y: the headset's origin in the world; turn: the direction of its -z from east, radians; scale: world units a metre;
 * floor: metres from the floor up to the origin.
 * @typedef {{ x: number, y: number, turn: number, scale: number, floor: number }} Rig
 */

/** A direction of the headset's space in the world. @param {Rig} rig @param {ArrayLike<number>} v */
export function turned({ turn }, v) {
  const c = Math.cos(turn), s = Math.sin(turn);
  return [s * v[0] - c * v[2], -c * v[0] - s * v[2], v[1]];
}

/**
 * A point of the headset's space in the world; the ground there is where the headset's floor is.
 *
 * @param {Rig} rig
 * @param {Point} point
 * @param {(x: number, y: number) => number} ground
 * @param {Point} head under which the ground is asked for, so that both eyes stand on the same
 */
export function placed(rig, point, ground, head) {
  const [x, y, z] = turned(rig, [point.x, point.y, point.z]).map((v) => rig.scale * v);
  const [hx, hy] = turned(rig, [head.x, head.y, head.z]).map((v) => rig.scale * v);
  return [rig.x + x, rig.y + y, ground(rig.x + hx, rig.y + hy) + rig.scale * rig.floor + z];
}

/** Axes of a pose in the world. @param {Rig} rig @param {Transform} transform */
export function axesOf(rig, { matrix }) {
  return {
    right: turned(rig, matrix.slice(0, 3)), up: turned(rig, matrix.slice(4, 7)),
    ahead: turned(rig, matrix.slice(8, 11).map((v) => -v)),
  };
}

/** Tangents of the angles from straight ahead to the picture's sides. @param {Float32Array} p a projection */
export const tangents = (p) => ({
  left: (1 - p[8]) / p[0], right: (1 + p[8]) / p[0], down: (1 - p[9]) / p[5], up: (1 + p[9]) / p[5],
});

/**
 * The camera of an eye, and the viewport in which to draw it. Splats are drawn with what is straight ahead in the middle;
 * an eye's picture reaches farther to one side, so the viewport reaches beyond it on the other, where it is cut off.
 *
 * @param {Rig} rig
 * @param {View} view
 * @param {Viewport} viewport
 * @param {number[]} eye in the world
 * @returns {{ camera: Camera, around: Viewport }}
 */
export function eyeCamera(rig, { projectionMatrix, transform }, viewport, eye) {
  const { left, right, down, up } = tangents(projectionMatrix);
  const across = viewport.width / (left + right), along = viewport.height / (down + up); // pixels a unit of tangent
  const halfWidth = Math.ceil(Math.max(left, right) * across), halfHeight = Math.ceil(Math.max(down, up) * along);
  return {
    camera: {
      eye, ...axesOf(rig, transform), width: 2 * halfWidth, height: (2 * halfHeight * across) / along, focal: across,
    },
    around: {
      x: Math.round(viewport.x + left * across) - halfWidth, y: Math.round(viewport.y + down * along) - halfHeight,
      width: 2 * halfWidth, height: 2 * halfHeight,
    },
  };
}

/**
 * The camera of the head, that sees what both eyes see: the worker is asked for its view.
 *
 * @param {Rig} rig
 * @param {Transform} transform
 * @param {number[]} eye
 * @param {Camera[]} eyes
 * @returns {Camera}
 */
export const headCamera = (rig, transform, eye, eyes) => ({
  eye, ...axesOf(rig, transform), focal: eyes[0].focal, width: Math.max(...eyes.map(({ width }) => width)),
  height: Math.max(...eyes.map(({ height }) => height)),
});
