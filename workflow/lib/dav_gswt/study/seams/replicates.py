"""Tile sets of one field that are drawn anew: there are four strips in a set, and intervals over so few are wide.

Each is an entry of `seams` of its own: the first draw of `semantic` is `semantic` itself, the second semantic-draw-1.
Read by the workflow before the first job, so it loads no numerics.
"""

from itertools import product

from dav_gswt.config import REFINED
from dav_gswt.errors import InputError


def name(seam: str, draw: int) -> str:
    """What an entry of `seams` is called in a draw; draw 0 is the entry itself."""
    own = seam.removesuffix(REFINED)
    return f"{own}-draw-{draw}{seam[len(own) :]}" if draw else seam


def asked(seam: str, own: str, study: dict) -> list[str]:
    """All draws of an entry that the config's `seam_study` asks for of a scene whose own entry is `own`."""
    times = [study.get("draws", 1)] * (seam == own) + [study.get("compared_draws", 1)] * (seam in study["seams"])
    return [name(seam, draw) for draw in range(max(times, default=0))]


def entries(config: dict) -> dict:
    """The config with the entries of `seams` that its `seam_study` draws: every scene's own, and those it compares.

    Raises: InputError: the config has another entry of such a name.
    """
    study, made = config.get("seam_study", {"scenes": [], "seams": []}), dict(config["seams"])
    owned = dict.fromkeys(config["scenes"][scene]["seam"] for scene in study["scenes"])
    for own, seam in product(owned, [*owned, *study["seams"]]):
        for draw, entry in enumerate(asked(seam, own, study)):
            plain, entry = seam.removesuffix(REFINED), entry.removesuffix(REFINED)
            found = config["seams"][plain] | ({"draw": draw} if draw else {})
            if made.setdefault(entry, found) != found:
                raise InputError(f"config: seams.{entry}: `seam_study` makes an entry of this name; give yours another")
    return config | {"seams": made}
