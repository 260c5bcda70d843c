// The sphere: a planet of tiles, six faces of n x n cells each, and how the plane of a tile bends onto it.
// The same numbers as dav_gswt/terrain/planet.py, which explains them; tests/golden/sphere.json holds both to it.

export const FACES = [ // east, north and out of each face
  [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
  [[-1, 0, 0], [0, 0, 1], [0, 1, 0]],
  [[-1, 0, 0], [0, -1, 0], [0, 0, 1]],
  [[0, 0, -1], [0, -1, 0], [-1, 0, 0]],
  [[0, 0, -1], [1, 0, 0], [0, -1, 0]],
  [[0, 1, 0], [1, 0, 0], [0, 0, -1]],
];
export const QUARTER = Math.PI / 2;

/**
 * A manifest's `heights` entry of a planet; cells: along the side of a face.
 * @typedef {{ kind: "sphere", radius: number, cells: number }} SphereEntry
 *
 * A sphere about the world's origin, as a height field that is 0 above it.
 * @typedef {import("./heights.js").Bounds & { kind: "sphere", radius: number, cells: number }} Sphere
 */

/** @param {SphereEntry} entry @returns {Sphere} */
export const createSphere = ({ radius, cells }) => (
  { kind: "sphere", radius, cells, low: 0, high: 0, steepest: 0, at: () => [0, 0, 0] });

/** Angle of a world unit on a tile. @param {{ cells: number }} sphere @param {number} side */
export const rateOf = ({ cells }, side) => QUARTER / (cells * side);

/** Tangent of the angle at a place along a face, in cells from its edge. @param {number} a @param {number} cells */
export const tangentAt = (a, cells) => Math.tan((a / cells - 0.5) * QUARTER);

/**
 * The unit vector to a place of a face, from the planet's middle.
 *
 * @param {number} face
 * @param {number} s tangent to the east
 * @param {number} t tangent to the north
 * @param {number[]} out
 */
export function directionOf(face, s, t, out) {
  const [east, north, ahead] = FACES[face], long = Math.sqrt(s * s + t * t + 1);
  for (let k = 0; k < 3; k++) out[k] = (s * east[k] + t * north[k] + ahead[k]) / long;
  return out;
}

/**
 * The face under a point, and the place on it in cells from its south-western corner.
 *
 * @param {{ cells: number }} sphere @param {number[]} point
 */
export function locate({ cells }, point) {
  const outs = FACES.map(([, , out]) => dot(out, point)), face = outs.indexOf(Math.max(...outs));
  const [a, b] = FACES[face].map((axis) => (Math.atan2(dot(axis, point), outs[face]) / QUARTER + 0.5) * cells);
  return { face, a, b };
}

/**
 * Where a point of a tile goes on the sphere, in the face's axes, from the place of the tile's middle on the ground.
 *
 * @param {number} x from the tile's middle
 * @param {number} y
 * @param {number} z above the ground
 * @param {number} s tangent of the tile's middle to the east
 * @param {number} t to the north
 * @param {number} radius @param {number} rate
 * @param {number[]} out the point, and from 3 on the derivative, column by column
 */
export function bend(x, y, z, s, t, radius, rate, out) {
  const alongX = Math.tan(x * rate), alongY = Math.tan(y * rate);
  const dx = ((1 + s * s) * alongX) / (1 - s * alongX), dy = ((1 + t * t) * alongY) / (1 - t * alongY);
  const sx = s + dx, ty = t + dy, first = Math.sqrt(1 + s * s + t * t), long = Math.sqrt(1 + sx * sx + ty * ty);
  const less = (dx * (2 * s + dx) + dy * (2 * t + dy)) / (long + first) / first;
  const ux = sx / long, uy = ty / long, uz = 1 / long, scale = radius / long;
  out[0] = scale * (dx - s * less) + z * ux;
  out[1] = scale * (dy - t * less) + z * uy;
  out[2] = -scale * less + z * uz;
  const grow = (radius * rate + rate * z) / long, east = grow * (1 + sx * sx), north = grow * (1 + ty * ty);
  out[3] = east * (1 - ux * ux);
  out[4] = -east * uy * ux;
  out[5] = -east * uz * ux;
  out[6] = -north * ux * uy;
  out[7] = north * (1 - uy * uy);
  out[8] = -north * uz * uy;
  out[9] = ux;
  out[10] = uy;
  out[11] = uz;
  return out;
}

/**
 * East, north and up at a place, in degrees; at the poles those of the longitude.
 *
 * @param {number} longitude @param {number} latitude
 */
export function frameAt(longitude, latitude) {
  const east = (longitude * Math.PI) / 180, north = (latitude * Math.PI) / 180;
  const [s, c, p, q] = [Math.sin(east), Math.cos(east), Math.sin(north), Math.cos(north)];
  return [[-s, c, 0], [-p * c, -p * s, q], [q * c, q * s, p]];
}

/**
 * Where one comes who walks straight on, and where one looks then: longitude, latitude and yaw in degrees.
 *
 * @param {{ x: number, y: number, yaw: number }} place
 * @param {number} east world units
 * @param {number} north @param {number} radius
 */
export function walkOn({ x, y, yaw }, east, north, radius) {
  const long = Math.hypot(east, north), angle = long / radius;
  if (!angle) return { x, y, yaw };
  const [right, up, out] = frameAt(x, y), turn = (yaw * Math.PI) / 180, [c, s] = [Math.cos(angle), Math.sin(angle)];
  const way = right.map((v, k) => (east * v + north * up[k]) / long);
  const there = out.map((v, k) => c * v + s * way[k]), ahead = way.map((v, k) => c * v - s * out[k]);
  const left = right.map((v, k) => (east * up[k] - north * v) / long);
  const along = (east * Math.cos(turn) + north * Math.sin(turn)) / long; // of where one looks, ahead and to the left
  const aside = (east * Math.sin(turn) - north * Math.cos(turn)) / long;
  const look = ahead.map((v, k) => along * v + aside * left[k]);
  const latitude = (Math.atan2(there[2], Math.hypot(there[0], there[1])) * 180) / Math.PI;
  let longitude = (Math.atan2(there[1], there[0]) * 180) / Math.PI;
  longitude += 360 * Math.round((x - longitude) / 360); // the nearest to the old one, so that paths have no jumps
  const [e, n] = frameAt(longitude, latitude);
  return { x: longitude, y: latitude, yaw: (Math.atan2(dot(look, n), dot(look, e)) * 180) / Math.PI };
}

/** @param {number[]} a @param {number[]} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
