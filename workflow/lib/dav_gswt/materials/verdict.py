"""Verdict on each material and on the set: is there enough of it for a terrain, can it be cut, what would help."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

GOOD, MARGINAL = 4.0, 2.0  # tile areas that were photographed
ROUNDING = 1e-6  # of areas: tiles are made so large that the scarcest material has MARGINAL of them


@dataclass(frozen=True)
class MaterialVerdict:
    """good, marginal or no; the reason, and what to do, as a sentence for people."""

    grade: str
    reason: str


def judge_material(name: str, areas: float, filled: float, pattern: float | None = None) -> MaterialVerdict:
    """The verdict on a material: by its area, and at most marginal where it has a pattern that cuts may break.

    Args:
        areas: how many tiles' areas of it were photographed.
        filled: share of its exemplar that is made of patches.
        pattern: its correlation, see `texture.measure_pattern`.
    """
    judged = _judge_area(name, areas, filled)
    if pattern is None:
        return judged
    broken = f"it has a pattern (correlation {pattern:.2f}): rows and lines may break where patches meet"
    grade = "marginal" if judged.grade == "good" else judged.grade
    return replace(judged, grade=grade, reason=f"{judged.reason}; {broken}")


def _judge_area(name: str, areas: float, filled: float) -> MaterialVerdict:
    areas *= 1 + ROUNDING
    seen = f"{name} was photographed on {_format_areas(areas)} tile areas"
    if areas >= GOOD:
        return MaterialVerdict("good", seen)
    times = math.ceil(10 * GOOD / max(areas, 0.1)) / 10  # up, for "1.0 times" asks for nothing
    more = f"photograph {times:.1f} times as much of it"
    if areas >= MARGINAL:
        return MaterialVerdict("marginal", f"{seen}: repeats may be seen; {more}")
    made = f", and {filled:.0%} of what its tiles are cut from is made of patches" if filled > 0.05 else ""
    return MaterialVerdict("no", f"{seen}{made}: repeats will be seen; {more}, or leave it out")


def _format_areas(areas: float) -> str:
    """To a tenth, but never up to a bound that is not reached."""
    near = round(areas, 1)
    return f"{near - 0.1 if any(areas < bound <= near for bound in (GOOD, MARGINAL)) else near:.1f}"


def judge_set(
    verdicts: dict[str, MaterialVerdict],
    shares: dict[str, float],
    excluded: float,
    strips: int,
    patterned: Sequence[str] = (),
) -> MaterialVerdict:
    """The verdict on all: that of the material that covers most. Those of which there is too little are named.

    Args:
        verdicts, shares: by the materials' names.
        patterned: names of those that have a pattern.
        excluded: share of ground that is shown nowhere.
        strips: paths, roads and the like, among it.
    """
    grade = verdicts[max(shares, key=lambda name: shares[name])].grade
    if excluded > 0.5 and grade == "good":
        reason = f"{excluded:.0%} of the ground is shade, rare or cut off, and shown nowhere"
        return MaterialVerdict("marginal", reason)
    several = "a path, road or the like" if strips == 1 else f"{strips} paths, roads or the like"
    crossing = f", {several} among it" if strips else ""
    many = "1 material" if len(verdicts) == 1 else f"{len(verdicts)} materials"
    scarce = [name for name, verdict in verdicts.items() if verdict.grade == "no"]
    lacking = f"; of {' and '.join(scarce)} there is too little" if scarce else ""
    rows = f"; rows and lines of {' and '.join(patterned)} may break where patches meet" if patterned else ""
    return MaterialVerdict(grade, f"{many}, {excluded:.0%} of the ground is shown nowhere{crossing}{lacking}{rows}")
