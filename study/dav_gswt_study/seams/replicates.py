"""Replicates: tile sets of one field, each cut from newly drawn places, since intervals over one set are wide.

Each is an entry of `tilings` of its own: the first replicate of `semantic` is `semantic` itself, the second
semantic-replicate-1. Read by the workflow before the first job, so it loads no numerics.
"""

from itertools import product

from dav_gswt.errors import InputError

SUFFIXES = ("-expansion",)  # of tilings that the study makes of an entry of `tilings`


def split_tiling(tiling: str) -> tuple[str, str]:
    """The entry of `tilings` that a tiling is made of, and the suffix that says how."""
    suffix = next((each for each in SUFFIXES if tiling.endswith(each)), "")
    return tiling.removesuffix(suffix), suffix


def name_replicate(tiling: str, number: int) -> str:
    """The name of a replicate; replicate 0 is the tiling itself."""
    plain, suffix = split_tiling(tiling)
    return f"{plain}-replicate-{number}{suffix}" if number else tiling


def list_replicates(tiling: str, own: str, study: dict) -> list[str]:
    """All replicates of a tiling that `study.seams` asks for of a scene whose own tiling is `own`."""
    counts = [study["replicates"]] * (tiling == own) + [study["compared_replicates"]] * (tiling in study["tilings"])
    return [name_replicate(tiling, number) for number in range(max(counts, default=0))]


def add_replicates(config: dict) -> dict:
    """The config with the tilings that `study.seams` replicates: every scene's own, and those it compares.

    config: with the study's tables beside the product's.
    Raises: InputError: the config has another entry of such a name.
    """
    if "seams" not in config:
        return config
    study, tilings = config["seams"], dict(config["tilings"])
    owned = dict.fromkeys(config["scenes"][scene]["tiling"] for scene in study["scenes"])
    for own, tiling in product(owned, [*owned, *study["tilings"]]):
        for number, replicate in enumerate(list_replicates(tiling, own, study)):
            plain, name = split_tiling(tiling)[0], split_tiling(replicate)[0]
            entry = config["tilings"][plain] | ({"replicate": number} if number else {})
            if tilings.setdefault(name, entry) != entry:
                raise InputError(
                    f"config: tilings.{name}: `study.seams` makes an entry of this name; give yours another"
                )
    return config | {"tilings": tilings}
