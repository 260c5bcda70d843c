// Moving in a headset: the left stick walks, the right one turns in steps, the trigger takes one where it points.

import { hitGround } from "../terrain/ray.js";
import { placed, turned } from "./xr_rig.js";

/**
 * @typedef {import("./xr_rig.js").Rig} Rig
 * @typedef {import("./xr_rig.js").Transform} Transform
 * @typedef {{ handedness: "none" | "left" | "right", targetRaySpace: unknown,
 *   gamepad?: { axes: readonly number[] } | null }} InputSource
 * @typedef {{ getPose: (space: unknown, base: unknown) => { transform: Transform } | null | undefined }} PoseFrame
 * @typedef {{ heights: import("../terrain/heights.js").HeightField, lift: number, farthest: number,
 *   ground: (x: number, y: number) => number }} Land
 */

const SPEED = 1.5; // metres a second
const DEAD = 0.2; // of a stick's way, in which it rests
const PUSHED = 0.7, RELEASED = 0.3; // of the way of a stick that turns
const TURN = Math.PI / 6; // of a step
const FARTHEST = 24; // tile sides that one is taken at most

/**
 * @param {Rig} rig is moved
 * @param {boolean} calm no gliding: the trigger alone moves
 */
export function createXrControls(rig, calm) {
  let turning = false;
  /** @type {InputSource | null} */
  let aiming = null;
  /** @type {[number, number] | null} */
  let goal = null;

  /** Turn about the head. @param {number} angle @param {Transform} head */
  function turn(angle, { position: { x, y, z } }) {
    const before = turned(rig, [x, y, z]);
    rig.turn += angle;
    const after = turned(rig, [x, y, z]);
    rig.x += rig.scale * (before[0] - after[0]);
    rig.y += rig.scale * (before[1] - after[1]);
  }

  /** @param {number} forward @param {number} right @param {Transform} head @param {number} seconds */
  function walk(forward, right, { matrix }, seconds) {
    const ahead = turned(rig, [-matrix[8], 0, -matrix[10]]), long = Math.hypot(ahead[0], ahead[1]);
    if (long < 1e-6) return; // straight up or down
    const step = (rig.scale * SPEED * seconds) / long;
    rig.x += step * (forward * ahead[0] + right * ahead[1]);
    rig.y += step * (forward * ahead[1] - right * ahead[0]);
  }

  return {
    /** Where the trigger would take one; null: nowhere. */
    get goal() {
      return goal;
    },
    /** The trigger is pressed. @param {InputSource} source */
    aim(source) {
      aiming = source;
    },
    /** The trigger is let go: stand at the goal. @param {Transform | null} head */
    go(head) {
      if (goal && head) {
        const [x, y] = placed(rig, head.position, () => 0, head.position);
        rig.x += goal[0] - x;
        rig.y += goal[1] - y;
      }
      aiming = goal = null;
    },
    /**
     * Move as the sticks want, and find where the trigger points.
     *
     * @param {Iterable<InputSource>} sources
     * @param {PoseFrame} frame
     * @param {unknown} space
     * @param {Transform} head
     * @param {Land} land
     * @param {number} seconds
     */
    step(sources, frame, space, head, land, seconds) {
      for (const { handedness, gamepad } of sources) {
        if (!gamepad) continue;
        const [x, y] = gamepad.axes.slice(-2).map((v) => (Math.abs(v) < DEAD ? 0 : v));
        if (handedness === "left") {
          if (!calm && (x || y)) walk(-y, x, head, seconds);
        } else if (Math.abs(x) > PUSHED && !turning) {
          turning = true;
          turn(-Math.sign(x) * TURN, head);
        } else if (Math.abs(x) < RELEASED) turning = false;
      }
      goal = aiming && findGoal(frame.getPose(aiming.targetRaySpace, space)?.transform, head, land);
    },
  };

  /** @param {Transform | undefined} ray @param {Transform} head @param {Land} land */
  function findGoal(ray, head, { heights, lift, farthest, ground }) {
    if (!ray) return null;
    const from = placed(rig, ray.position, ground, head.position), way = turned(rig, ray.matrix.slice(8, 11).map((v) => -v));
    return hitGround(from, way, heights, { lift, farthest: FARTHEST * farthest });
  }
}
