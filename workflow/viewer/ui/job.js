// Work that takes a while: what is under way, how far it is, and a button that gives it up. One at a time.

import { element } from "./dom.js";

/**
 * How far the work is, 0 to 1.
 * @typedef {(share: number) => void} Tell
 * @typedef {ReturnType<typeof createJobs>} Jobs
 */

const SOON = 5; // seconds after which, and of which, one is told

/**
 * How long work takes on, in words; nothing where that is not known yet, or soon over.
 *
 * @param {number} seconds that it took so far
 * @param {number} share that is done
 */
export function describeLeft(seconds, share) {
  const left = (seconds / share) * (1 - share);
  if (seconds < SOON || !(left > SOON) || left === Infinity) return "";
  if (left < 90) return `, ${SOON * Math.ceil(left / SOON)} s left`;
  return left < 5400 ? `, ${Math.round(left / 60)} min left` : `, ${Math.round(left / 3600)} h left`;
}

/** @param {{ say: (text: string) => void, onError: (error: unknown) => void }} handlers */
export function createJobs({ say, onError }) {
  const box = element("job", HTMLElement), text = element("jobText", HTMLElement);
  const bar = element("jobBar", HTMLProgressElement), cancel = element("jobCancel", HTMLButtonElement);
  /** @type {AbortController | null} */
  let running = null;
  const giveUp = () => running?.abort(new DOMException("given up", "AbortError"));
  cancel.addEventListener("click", giveUp);
  addEventListener("keydown", (event) => {
    if (event.code === "Escape") giveUp();
  });
  return {
    get busy() {
      return running !== null;
    },
    /**
     * Do something long unless something is being done. The signal says that nobody wants it any more.
     *
     * @param {string} name what it is, as in "Drawing the photo"
     * @param {(signal: AbortSignal, tell: Tell) => Promise<void>} work
     */
    async run(name, work) {
      if (running) return;
      running = new AbortController();
      const start = performance.now();
      const before = document.activeElement;
      /** @param {number} share */
      const tell = (share) => {
        bar.value = share;
        text.textContent = `${name}: ${Math.round(100 * share)} %${describeLeft((performance.now() - start) / 1000, share)}`;
      };
      tell(0);
      box.hidden = false;
      cancel.focus();
      try {
        await work(running.signal, tell);
      } catch (error) {
        if (running.signal.aborted || (error instanceof DOMException && error.name === "AbortError")) say(`${name}: given up.`);
        else onError(error);
      } finally {
        running = null;
        const inside = box.contains(document.activeElement);
        box.hidden = true;
        if (inside && before instanceof HTMLElement) before.focus();
      }
    },
  };
}
