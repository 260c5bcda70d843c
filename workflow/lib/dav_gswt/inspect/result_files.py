"""Files that belong to an artefact, found by its place in the result tree (results/README.md)."""

from contextlib import contextmanager
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.files import read_json
from dav_gswt.geometry.cameras import Camera, camera_from_json
from dav_gswt.paths import decode_path, related_folder
from dav_gswt.views.selection import read_pose_selection


@contextmanager
def wrap_errors(path: Path):
    """Turn errors about the content of a file, such as a missing key, into an InputError that names the file."""
    try:
        yield
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{path}: not as the workflow writes it ({type(error).__name__}: {error}); make it again"
        ) from error


def find_photos(path: Path) -> Path:
    """The folder photos/ of the scene that a file belongs to. Raises: InputError: there is none."""
    frame = find_above(path, "photos/ground.json")
    if frame is None:
        raise InputError(
            f"{path}: its scene's photos/ground.json is in no folder above it; leave it in its result tree"
        )
    return frame.parent


def find_above(path: Path, name: str, folders: int | None = None) -> Path | None:
    """A file of this name in the nearest folder above a path; at most so many folders are searched.

    The files of a fit are in the folder of its scores or in the one above: `folders` is 2 for them.
    """
    files = (folder / name for folder in path.resolve().parents[:folders])
    return next((file for file in files if file.is_file()), None)


def read_shots(path: Path) -> list[tuple[str, Camera]]:
    """The file names and cameras of a capture.json. Raises: InputError: damaged, or a name leads out of its folder."""
    content = read_json(path)
    with wrap_errors(path):
        shots = [(str(shot["name"]), camera_from_json(shot["got"])) for shot in content["shots"]]
    for name, _ in shots:
        if Path(name).name != name:
            raise InputError(f"{path}: {name!r} is no file's name; take the photos again")
    return shots


def decode_round(path: Path) -> int | None:
    """The number of the round whose folder a file lies in; None outside of rounds."""
    number = decode_path(path.resolve()).get("t")
    return None if number is None else int(number)


def decode_lam(path: Path) -> float:
    """lam of the branch that a file lies in; 0 where it lies in none."""
    return float(decode_path(path.resolve()).get("lam", 0.0))


def find_poses(scores: Path) -> list[Path]:
    """The poses.json of the rounds that chose by some scores: one of a round's, any number of the coarse fit's."""
    scores = scores.resolve()
    number, wildcards = decode_round(scores), decode_path(scores)
    if number is not None:
        poses = [related_folder(scores, "round", t=number + 1) / "poses.json"]
    elif "p_drop" in wildcards:
        rounds = related_folder(scores, "fit").glob("active_*/iter1/poses.json")
        poses = sorted(path for path in rounds if wildcards.items() <= decode_path(path).items())
    else:
        poses = []
    return [path for path in poses if path.is_file()]


def find_scores(poses: Path) -> Path:
    """The scores that a round's poses were chosen by, of another preset where that chose them.

    Raises: InputError: not where the workflow puts them.
    """
    poses = poses.resolve()
    number = decode_round(poses)
    if not number:
        raise InputError(f"{poses}: lies in no round of the result tree; give scores.csv and --poses {poses}")
    by = read_pose_selection(poses).chosen_with
    of = {"preset": by} if by else {}
    folder = (
        related_folder(poses, "scored", **of) if number == 1 else related_folder(poses, "round", t=number - 1, **of)
    )
    scores = folder / "scores.csv"
    if not scores.is_file():
        raise InputError(f"{poses}: the scores that it was chosen by are not there ({scores}); make them again")
    return scores


def find_captures(path: Path) -> list[Path]:
    """The capture folders of all rounds up to that of a file; none for a file of the coarse fit."""
    path = path.resolve()
    return [related_folder(path, "round", t=t) / "capture" for t in range(1, (decode_round(path) or 0) + 1)]
