// What others pass in, checked before it reaches the worker: a NaN there would draw nothing and say nothing.

/**
 * A list of `many` finite numbers. Throws a TypeError.
 *
 * @param {string} name
 * @param {ArrayLike<number>} values
 * @param {number} many
 * @returns {number[]}
 */
export function checkNumbers(name, values, many) {
  const list = values == null ? [] : Array.from(values);
  if (list.length !== many || !list.every(Number.isFinite)) throw new TypeError(`${name}: not ${many} finite numbers`);
  return list;
}

/**
 * A camera as the worker takes it. Throws a TypeError.
 *
 * @param {import("../terrain/camera.js").Camera} camera
 */
export function checkCamera({ eye, right, up, ahead, width, height, focal }) {
  if (!(Math.min(width, height, focal) > 0)) throw new TypeError("camera: width, height and focal are not above 0");
  checkNumbers("camera: width, height, focal", [width, height, focal], 3);
  return {
    eye: checkNumbers("camera.eye", eye, 3), right: checkNumbers("camera.right", right, 3),
    up: checkNumbers("camera.up", up, 3), ahead: checkNumbers("camera.ahead", ahead, 3), width, height, focal,
  };
}

/**
 * An index below `end`. Throws a RangeError.
 *
 * @param {string} name
 * @param {number} value
 * @param {number} end
 */
export function checkIndex(name, value, end) {
  if (!Number.isInteger(value) || value < 0 || value >= end) throw new RangeError(`${name}: ${value} is not 0 to ${end - 1}`);
}
