"""How long the terms of a view's uncertainty take: W2 of 1000 poses' latents, LPIPS of a pair, whole pools of poses.

Every figure goes to results/bench.json. LPIPS is left out where its weights were not fetched.
"""

import resource
import time

import numpy as np
from record import read_installed_lpips, report_figures

from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.poses import pose_of_camera
from dav_gswt.images import lpips
from dav_gswt.prior import interface
from dav_gswt.views import scoring, uncertainty
from dav_gswt.views.scoring import PriorConfig

REPEATS = 7
TOP = 20  # poses whose order matters: as many as a round may take
LATENTS = 1000, 5, 4, 64, 64  # poses, samples, channels, rows, columns
PAIRS = {64: 32, 512: 2}  # pairs of pictures by their side in pixels
WORLD = 10_000  # made up, not one that the prior learned from
TARGETS = {
    "w2_kernel_seconds": 0.3,
    "lpips_pair_64_seconds": 0.02,
    "lpips_pair_512_seconds": 0.23,
    "score_1000_seconds": 120,
    "score_draft_seconds": 30,
    "score_quick_seconds": 8,
    "score_quick_1000_seconds": 40,
    "score_peak_mb": 3000,
}


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
    given, rng, out = read_installed_lpips(), np.random.default_rng(0), {}
    if given is None:
        return {}
    for side, pairs in PAIRS.items():
        a, b = rng.uniform(-1, 1, (2, pairs, side, side, 3)).astype(np.float32)
        out[f"lpips_pair_{side}_seconds"] = seconds(lambda a=a, b=b: lpips.distance(a, b, given)) / len(a)
    samples = rng.uniform(-1, 1, (16, 5, 64, 64, 3)).astype(np.float32)
    return out | {"lpips_pose_seconds": seconds(lambda: lpips.pairwise_mean(samples, given)) / len(samples)}


def pools() -> dict[str, float]:
    """A field fitted from few photos and hemispheres of poses over it, from conditions to terms.

    As the config's priors `terrain` (five samples, 8 steps) and `terrain-quick` (two samples, two steps). The best 20
    are compared with those of all poses in full, by the same noise and by another.
    """
    made, rng = make_world(WORLD), np.random.default_rng(0)
    photos = examples.take_photos(made, rng)
    field = examples.fit_field(made, photos, rng)
    given = read_installed_lpips()
    model = scoring.load_prior({"model": "terrain"})
    known = interface.prepare_photos(photos, made.frame, model.size)

    def scored(count: int, samples: int = 5, steps: int = 8, seed: int = 0):
        places = camera_layouts.hemisphere(count, 30.0, FLYING_HEIGHT)
        cameras = [
            camera_layouts.orbit(*place, made.frame.exemplar.centre, 96, 96, examples.FIELD_OF_VIEW) for place in places
        ]
        pool = [(pose_of_camera(f"pose_{i:04d}", c, made.frame), c) for i, c in enumerate(cameras)]
        start = time.perf_counter()
        told = interface.build_condition(field, pool, known, FLYING_HEIGHT, model.size)
        ask = PriorConfig(model, samples, steps, 0.15, seed, given)
        everywhere = np.ones((count, model.size, model.size), np.float32)
        terms = scoring.sample_terms(ask, told, [pose.name for pose, _ in pool], everywhere)
        scales = uncertainty.Scales.from_terms({name: terms[name] for name in ("w2_sq", "lpips")})
        return time.perf_counter() - start, uncertainty.combine_terms(terms["w2_sq"], terms["lpips"], 0.1, scales)

    draft, _ = scored(250)
    seconds, whole = scored(1000)
    _, other = scored(1000, seed=1)
    quick, _ = scored(250, 2, 2)
    quick_all, rough = scored(1000, 2, 2)
    best, *others = [set(np.argsort(-u)[:TOP]) for u in (whole, other, rough)]
    names = "score_top20_overlap_other_noise", "score_quick_top20_overlap"
    return {
        "score_draft_seconds": draft,
        "score_1000_seconds": seconds,
        "score_quick_seconds": quick,
        "score_quick_1000_seconds": quick_all,
        **{name: len(best & those) / TOP for name, those in zip(names, others, strict=True)},
        "score_peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def main() -> None:
    report_figures({**w2(), **perceptual(), **pools()}, TARGETS)


if __name__ == "__main__":
    main()
