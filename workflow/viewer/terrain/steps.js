// Work in steps: generators, so that whoever has no time can go on later.

/** All steps at once. @template T @param {Generator<void, T>} steps @returns {T} */
export function run(steps) {
  for (;;) {
    const { done, value } = steps.next();
    if (done) return value;
  }
}
