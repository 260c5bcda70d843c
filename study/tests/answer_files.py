"""A made-up kit of the perceptual study, and scripted answers to it: nobody took part."""

import tempfile
from pathlib import Path

import numpy as np

from dav_gswt.images import image_files
from dav_gswt_study.forced_choice import kit
from dav_gswt_study.forced_choice.kit import StoredPair
from dav_gswt_study.forced_choice.pairs import CHECK, PLAIN

PARTS = Path(__file__).parents[1] / "forced_choice"
SCHEMA = Path(__file__).parents[1] / "answers.schema.json"
PAIRS = (("semantic", "colour"), ("semantic", "floor"))


def drawn(crops=4, checks=1, scenes=("desert", "grass")) -> list[StoredPair]:
    """Pairs of noise."""
    rng, found = np.random.default_rng(3), []
    for scene in scenes:
        for a, b in [pair for pair in PAIRS for _ in range(crops)] + [(PLAIN, CHECK)] * checks:
            about = {"scene": scene, "a": a, "b": b, "view": "top", "ground": "flat", "cluster": "t0:1:1"}
            found.append(StoredPair(about, (_png(rng), _png(rng))))
    return found


def _png(rng: np.random.Generator) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        image_files.write_png(path := Path(folder, "noise.png"), rng.random((40, 40, 3)))
        return path.read_bytes()


def written(folder: Path, some: list[StoredPair] | None = None, seconds=kit.SECONDS) -> tuple[Path, Path]:
    """A kit in a folder: its page and its key."""
    page, key = folder / "page", folder / "key.json"
    kit.write_kit(page, key, PARTS, some or drawn(), 0, seconds)
    return page, key


def answers(key: dict, number: int, first, upto: int | None = None) -> dict:
    """What the page saves of somebody who answers by a rule. first: of a pair, whether its first crop is chosen."""
    told = []
    for name, left, right in key["lists"][number % kit.LISTS][:upto]:
        item = key["items"][name]
        chosen = item["pictures"][0 if first(item) else 1]
        choice = "left" if chosen == left else "right"
        told.append(
            {"item": name, "left": left, "right": right, "choice": choice, "ms": 1200, "gone": False, "seen": 1}
        )
    screen = {"width": 1920, "height": 1080, "pixel_ratio": 1, "picture": 512}
    about = {"format": "davgswt-2afc", "version": 1, "study": key["study"], "participant": f"{number:032x}"}
    return about | {"list": number % kit.LISTS, "consent": True, "screen": screen, "answers": told}
