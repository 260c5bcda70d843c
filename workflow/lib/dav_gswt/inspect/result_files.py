"""Files that belong to an artefact, found by where the workflow puts them (results/README.md)."""

import re
from contextlib import contextmanager
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.files import read_json
from dav_gswt.geometry.cameras import Camera, camera_from_json

ROUND = re.compile(r"iter(0|[1-9]\d{0,5})")
ACTIVE = re.compile(r"active_[a-z0-9-]+_([a-z0-9_-]+)_pdrop([0-9.]+)_lam([0-9.]+)_k\d.*")
SCORED = re.compile(r"scores_([a-z0-9_-]+)_pdrop([0-9.]+)")


@contextmanager
def blaming(path: Path):
    """Values of a file from outside: what is not there, or not of its kind, is the file's fault."""
    try:
        yield
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{path}: not as the workflow writes it ({type(error).__name__}: {error}); make it again"
        ) from error


def find_photos(path: Path) -> Path | None:
    """The folder photos/ of the scene that a file belongs to."""
    found = (folder / "photos" for folder in path.resolve().parents)
    return next((folder for folder in found if (folder / "ground.json").is_file()), None)


def read_shots(path: Path) -> list[tuple[str, Camera]]:
    """The cameras of a capture.json, by name."""
    told = read_json(path)
    with blaming(path):
        return [(str(shot["name"]), camera_from_json(shot["got"])) for shot in told["shots"]]


def parse_round(path: Path) -> int | None:
    """Which round's folder a file lies in."""
    found = ROUND.fullmatch(path.resolve().parent.name)
    return int(found[1]) if found else None


def parse_lam(path: Path) -> float:
    """lam of the branch that a file lies in; 0 where it lies in none."""
    found = next((m for p in path.resolve().parents if (m := ACTIVE.fullmatch(p.name))), None)
    with blaming(path):
        return float(found[3]) if found else 0.0


def find_poses(scores: Path) -> list[Path]:
    """The poses.json of the rounds that chose by some scores: one of a round's, any number of the coarse field's."""
    scores = scores.resolve()
    if (number := parse_round(scores)) is not None:
        found = scores.parents[1] / f"iter{number + 1}" / "poses.json"
        return [found] if found.is_file() else []
    name = SCORED.fullmatch(scores.parent.name)
    if name is None:
        return []
    branches = scores.parents[2].glob(f"active_*_{name[1]}_pdrop{name[2]}_lam*_k*/iter1/poses.json")
    return sorted(path for path in branches if ACTIVE.fullmatch(path.parents[1].name))


def find_scores(poses: Path) -> Path:
    """The scores that a round's poses were chosen by. Raises: InputError: not where the workflow puts them."""
    poses = poses.resolve()
    number, branch = parse_round(poses), ACTIVE.fullmatch(poses.parents[1].name)
    if number is None or branch is None:
        raise InputError(f"{poses}: lies in no round of the result tree; give scores.csv and --poses {poses}")
    found = poses.parents[1] / f"iter{number - 1}" / "scores.csv"
    if number == 1:
        found = poses.parents[2] / "coarse" / f"scores_{branch[1]}_pdrop{branch[2]}" / "scores.csv"
    if not found.is_file():
        raise InputError(f"{poses}: the scores that it was chosen by are not there ({found}); make them again")
    return found
