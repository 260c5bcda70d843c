"""How long the terms of a view's uncertainty take: W2 of 1000 poses' latents, LPIPS of a pair of pictures.

Every figure goes to results/bench.json. LPIPS is left out where its weights were not fetched.
"""

import time

import numpy as np
from record import record

from dav_gswt.active import uncertainty
from dav_gswt.perceptual import lpips, weights

REPEATS = 7
LATENTS = 1000, 5, 4, 64, 64  # poses, samples, channels, rows, columns
PAIRS = {64: 32, 512: 2}  # pairs of pictures by their side in pixels
TARGETS = {"w2_kernel_seconds": 0.3, "lpips_pair_64_seconds": 0.02, "lpips_pair_512_seconds": 0.23}


def seconds(call) -> float:
    """The shortest of some calls: what it takes when nobody disturbs."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def w2() -> dict[str, float]:
    """Scores and maps, from latents in memory."""
    latents = np.random.default_rng(0).standard_normal(LATENTS, dtype=np.float32)
    return {"w2_kernel_seconds": seconds(lambda: uncertainty.w2_sq(latents))}


def perceptual() -> dict[str, float]:
    """Seconds a pair of pictures, and a pose of five samples (ten pairs) at the smaller size."""
    if not (path := weights.found()):
        print(f"lpips: skipped, its weights are not there (snakemake {weights.PATH} fetches them)")
        return {}
    given, rng, out = weights.read(path), np.random.default_rng(0), {}
    for side, pairs in PAIRS.items():
        a, b = rng.uniform(-1, 1, (2, pairs, side, side, 3)).astype(np.float32)
        out[f"lpips_pair_{side}_seconds"] = seconds(lambda a=a, b=b: lpips.distance(a, b, given)) / len(a)
    samples = rng.uniform(-1, 1, (16, 5, 64, 64, 3)).astype(np.float32)
    return out | {"lpips_pose_seconds": seconds(lambda: lpips.pairwise_mean(samples, given)) / len(samples)}


def main() -> None:
    values = w2() | perceptual()
    for name, value in values.items():
        print(f"{name}: {value:.3g}" + (f" (target {TARGETS[name]:g})" if name in TARGETS else ""))
    record(values)


if __name__ == "__main__":
    main()
