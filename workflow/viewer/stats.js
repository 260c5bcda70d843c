// Running means and standard deviations of the last times, for the numbers on the page.

const LAST = 120;

export function createStats() {
  const times = {}, workers = [];
  const keep = (list, value) => {
    list.push(value);
    if (list.length > LAST) list.shift();
  };
  return {
    add: (name, milliseconds) => keep((times[name] ??= []), milliseconds),
    /** A frame was drawn; had the worker answered since the last one? */
    frame: (worker) => keep(workers, Number(worker)),
    /** { name: { mean, sd, n } }, and `share`: of frames in which the worker ran. */
    summary() {
      const out = { share: mean(workers) };
      for (const [name, list] of Object.entries(times)) {
        const middle = mean(list);
        const sd = Math.sqrt(list.reduce((sum, v) => sum + (v - middle) ** 2, 0) / Math.max(1, list.length - 1));
        out[name] = { mean: middle, sd, n: list.length };
      }
      return out;
    },
  };
}

const mean = (list) => (list.length ? list.reduce((a, b) => a + b, 0) / list.length : 0);
