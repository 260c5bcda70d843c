// How much of each level is drawn at a distance, and how opaque a Gaussian is that is drawn in part.
// The same numbers as dav_gswt/terrain/weights.py; tests/golden/weights.json holds both to it. shader.js has them too.

const MOST_OPAQUE = 1 - 1e-6; // or an opaque Gaussian of weight 0 would be 0 * -infinity

/** Share of the finer of two levels at a distance. */
export function finer(distance, change, band, smooth = false) {
  if (change === Infinity) return 1;
  let share = distance < change ? 1 : distance > change ? 0 : 0.5;
  if (band > 0) share = Math.min(Math.max(0.5 - (distance - change) / (2 * band), 0), 1);
  return smooth ? share * share * (3 - 2 * share) : share;
}

/** Weight of each level: the first takes its share, each next one its share of what is left; they sum to 1. */
export function ofLevels(distance, changes, bands, smooth = false) {
  let left = 1;
  const weights = [];
  for (let l = 0; l < changes.length - 1; l++) {
    const share = finer(distance, changes[l], bands[l], smooth);
    weights.push(left * share);
    left *= 1 - share;
  }
  return [...weights, left];
}

/** 1 - (1 - opacity)^weight: two equal Gaussians of weights w and 1 - w hide as much as one. */
export function crossfaded(opacity, weight) {
  if (weight === 1) return opacity;
  if (weight === 0) return 0;
  return -Math.expm1(weight * Math.log1p(-Math.min(opacity, MOST_OPAQUE)));
}
