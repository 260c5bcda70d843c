// Work that takes a while: what is under way, how far it is, and a button that gives it up. One at a time.

import { element } from "./dom.js";

/**
 * How far the work is, 0 to 1.
 * @typedef {(share: number) => void} Tell
 * @typedef {ReturnType<typeof createJobs>} Jobs
 */

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
      const before = document.activeElement;
      /** @param {number} share */
      const tell = (share) => {
        bar.value = share;
        text.textContent = `${name}: ${Math.round(100 * share)} %`;
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
