// The sun and the clear sky: their light in three bands, and the sun's path over a day. Angles are in degrees: elevation
// above the horizon, azimuth clockwise from the terrain's +y; `north` is the azimuth of +y, clockwise from true north.
// The same numbers as dav_gswt/terrain/light.py; tests/golden/light.json holds both to it.

const RAYLEIGH = [0.0496, 0.0987, 0.2267]; // optical depths of air at 0.65, 0.55 and 0.45 micrometres
const AEROSOL = [0.0805, 0.1, 0.1298]; // of clear, dry haze
const FORWARD = 0.756; // share of the light scattered by haze that reaches the ground
const LUMINANCE = [0.2126, 0.7152, 0.0722];
export const LOWEST = 3; // elevation below which the light no longer changes, and which the day leaves out
export const SUNRISE = 6, SUNSET = 18; // hours
const DEGREE = Math.PI / 180;

/**
 * A position of the sun; direction: unit vector towards it.
 * @typedef {{ elevation: number, azimuth: number, direction: [number, number, number] }} Sun
 */

/** @param {number} elevation @param {number} azimuth @returns {Sun} */
export function placeSun(elevation, azimuth) {
  const [e, a] = [elevation * DEGREE, azimuth * DEGREE];
  return { elevation, azimuth, direction: [Math.cos(e) * Math.sin(a), Math.cos(e) * Math.cos(a), Math.sin(e)] };
}

/**
 * Irradiance across the sun's beam, of level ground by the sky, and by both, over that outside the atmosphere: red,
 * green, blue. A clear sky after Bird and Hulstrom (1981), with the air mass of Kasten and Young (1989).
 *
 * @param {number} elevation
 */
export function measureLight(elevation) {
  const e = Math.max(elevation, LOWEST), rise = Math.sin(e * DEGREE);
  const mass = 1 / (rise + 0.50572 * (e + 6.07995) ** -1.6364);
  const air = RAYLEIGH.map((depth) => Math.exp(-mass * depth)), haze = AEROSOL.map((depth) => Math.exp(-mass * depth));
  const direct = air.map((v, k) => v * haze[k]);
  const sky = air.map((v, k) => rise * (0.5 * (1 - v) + FORWARD * (1 - haze[k])));
  return { direct, sky, level: direct.map((v, k) => v * rise + sky[k]) };
}

/** @param {number[]} colour in linear light */
export const luminance = (colour) => colour.reduce((sum, v, k) => sum + LUMINANCE[k] * v, 0);

/** Solar time of the captured sun on the path of `sunAt`. @param {Sun} captured @param {number} north */
export function findHour({ elevation, azimuth }, north) {
  const [x, y, z] = placeSun(elevation, azimuth + north).direction;
  return SUNRISE + (Math.atan2(Math.hypot(y, z), x) / Math.PI) * (SUNSET - SUNRISE);
}

/**
 * The sun at a solar time, on the path of an equinox: through the captured sun, from due east to due west. Hours at which it would be lower than LOWEST give the nearest one at which it is not.
 *
 * @param {Sun} captured @param {number} hour @param {number} north
 * @returns {Sun & { hour: number }}
 */
export function sunAt(captured, hour, north) {
  const [, y, z] = placeSun(captured.elevation, captured.azimuth + north).direction;
  const far = Math.hypot(y, z), first = Math.asin(Math.min(Math.sin(LOWEST * DEGREE) / (z / far), 1));
  const asked = ((hour - SUNRISE) / (SUNSET - SUNRISE)) * Math.PI;
  const angle = Math.min(Math.max(asked, first), Math.PI - first);
  const east = Math.cos(angle), ahead = (Math.sin(angle) * y) / far, up = (Math.sin(angle) * z) / far;
  const azimuth = (Math.atan2(east, ahead) / DEGREE - north + 720) % 360;
  const hourOf = SUNRISE + (angle / Math.PI) * (SUNSET - SUNRISE);
  return { hour: hourOf, ...placeSun(Math.atan2(up, Math.hypot(east, ahead)) / DEGREE, azimuth) };
}
