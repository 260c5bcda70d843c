// A fly path: places with the seconds at which they were passed. Recorded while walking, played, kept as a file.

import { PageError } from "./source.js";
import { put } from "./walk.js";

const EVERY = 0.1; // seconds between recorded places
const KEYS = ["x", "y", "eye", "yaw", "pitch"];

export function createFlight() {
  let path = [], mode = "rest", clock = 0;
  const now = (walker) => ({ seconds: clock, ...Object.fromEntries(KEYS.map((key) => [key, walker[key]])) });
  return {
    get mode() {
      return mode;
    },
    get path() {
      return path;
    },
    record() {
      [path, mode, clock] = [[], "record", 0];
    },
    play() {
      if (path.length) [mode, clock] = ["play", 0];
    },
    stop() {
      mode = "rest";
    },
    /** Take a path from a file. Raises: PageError: it is none. */
    load(value) {
      const sound = value?.format === "davgswt-flight" && Array.isArray(value.path) && value.path.length > 0
        && value.path.every((p, k) => ["seconds", ...KEYS].every((key) => Number.isFinite(p?.[key]))
          && (k === 0 || p.seconds >= value.path[k - 1].seconds));
      if (!sound) throw new PageError("The dropped file is not a fly path. Drop one that “Save path” has saved.");
      [path, mode] = [value.path, "rest"];
    },
    file: () => ({ format: "davgswt-flight", version: 1, path }),
    /** Go on for some seconds: note where the walker is, or put it where the path was. Returns: did the walker move? */
    step(walker, seconds) {
      if (mode === "rest") return false;
      if (mode === "record") {
        if (!path.length || clock + seconds - path[path.length - 1].seconds >= EVERY) {
          clock += path.length ? seconds : 0;
          path.push(now(walker));
        } else clock += seconds;
        return false;
      }
      clock += seconds;
      put(walker, placeAt(path, clock));
      if (clock >= path[path.length - 1].seconds) mode = "rest";
      return true;
    },
  };
}

/** The place at a moment of a path, straight between the recorded ones; a turn takes the shorter way. */
export function placeAt(path, seconds) {
  const k = path.findIndex((place) => place.seconds > seconds);
  if (k === 0) return path[0];
  if (k < 0) return path[path.length - 1];
  const a = path[k - 1], b = path[k], share = (seconds - a.seconds) / (b.seconds - a.seconds);
  const place = Object.fromEntries(KEYS.map((key) => [key, a[key] + share * (b[key] - a[key])]));
  place.yaw = a.yaw + share * ((((b.yaw - a.yaw + 540) % 360) + 360) % 360 - 180);
  return place;
}
