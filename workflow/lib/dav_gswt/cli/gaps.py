"""`dav-gswt gaps INPUT`: which ground a set of photos misses, before anybody leaves the field.

Photos are placed by structure from motion, and their footprints laid on the surface that they show; nothing is fitted.
Writes a map, outlines of the gaps (GeoJSON), and a mission for QGroundControl that fills them. Ground counts as missed
where fewer than three photos see it, all from one side, or too coarsely; the margin beyond the outermost photos is not
asked for. The exit status is 0 if nothing is missing, 1 if something is or the photos cannot be used.
"""

import argparse
import logging
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dav_gswt.capture.drone import plan_flight
from dav_gswt.cli import at_least
from dav_gswt.errors import InputError
from dav_gswt.files import write_json
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import figures
from dav_gswt.logs import PROGRESS
from dav_gswt.photos.colmap_model import ColmapModel
from dav_gswt.photos.gaps import CAMERA_HEIGHT, Gaps, describe_gaps, describe_ground, draw_gaps, find_gaps, plan_photos
from dav_gswt.photos.ground_frame import fit_ground_frame
from dav_gswt.photos.importers import import_model
from dav_gswt.photos.photo_files import find_blurred
from dav_gswt.photos.photo_listing import locate_source
from dav_gswt.photos.recognition import recognize_input
from dav_gswt.photos.sfm.registration import SfmOptions, register_photos
from dav_gswt.threads import default_threads

MAP, OUTLINES, MISSION = "gaps.png", "gaps.geojson", "mission.plan"
SIDE, FEATURES = 768, 2048  # pixels and features of a photo: less exact than a fit needs, and several times as fast
SAFE = 0.25  # flying heights: error of a mission's altitudes above which none is written


@dataclass(frozen=True)
class PlacedPhotos:
    """Photos in their ground frame. model: images are named as the photos' files. blurred: names of placed photos."""

    model: ColmapModel
    frame: SceneFrame
    left_out: tuple[tuple[str, str], ...]
    blurred: tuple[str, ...]


def add_command(commands) -> None:
    """Add the command to a parser's commands."""
    about = "which ground the photos miss: a map, outlines, and a mission that fills the gaps"
    parser = commands.add_parser("gaps", help=about, description=__doc__)
    parser.add_argument("input", nargs="+", type=Path, help="photos or folders of them, or a project with its cameras")
    parser.add_argument("-o", "--out", type=Path, metavar="FOLDER", help="where it is written (default: NAME-gaps)")
    parser.add_argument("--model", type=Path, help="known cameras: COLMAP, nerfstudio or OpenSfM")
    parser.add_argument("--focal", type=float, metavar="MM", help="focal length (35 mm equivalent) where EXIF has none")
    parser.add_argument("--cores", type=at_least(1), default=default_threads())
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    logging.basicConfig(level=logging.WARNING, format="  %(message)s")
    logging.getLogger(PROGRESS).setLevel(logging.INFO)
    recognised = recognize_input(options.input, options.model)
    if "folder" not in recognised.entry or recognised.about == "a video":
        raise InputError(f"{options.input[0]}: {recognised.about}; gaps are found from photos, so name their folder")
    out = options.out or Path(f"{recognised.name}-gaps")
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is a file; name a folder with -o FOLDER")
    print(f"{', '.join(map(str, options.input))}: {recognised.about}", flush=True)
    sfm = SfmOptions(focal=options.focal, size=SIDE, features=FEATURES, threads=options.cores)
    placed = place_photos(locate_source(recognised.entry["folder"]), sfm, recognised.entry.get("model"))
    found = find_gaps(placed.model, placed.frame, placed.blurred)
    ground = "\n".join(describe_ground(found, placed.frame))
    print(f"\n{describe_photos(placed, found)}\n\n{ground}\n")
    for line in write_gaps(out, placed, found):
        print(line)
    return 1 if found.gaps else 0


def place_photos(source: list[Path], options: SfmOptions, given: Path | str | None) -> PlacedPhotos:
    """Register photos, and find those that are blurred. given: a camera model of another program.

    Raises: InputError: see `register_photos`, `import_model` and `fit_ground_frame`.
    """
    found = import_model(given, source, options) if given else register_photos(source, options)
    about = found.positions.about if found.positions else None
    model, frame = fit_ground_frame(found.model, np.random.default_rng(options.seed), about)
    names = tuple(path.name for path in found.sources)
    blurred = np.array(names)[find_blurred(found.sources, options.threads)]
    return PlacedPhotos(replace(model, names=names), frame, found.left_out, tuple(sorted(blurred.tolist())))


def write_gaps(out: Path, placed: PlacedPhotos, found: Gaps) -> list[str]:
    """Write map, outlines and, if there are gaps, a mission; an earlier one goes. Returns what was written where."""
    out.mkdir(parents=True, exist_ok=True)
    unused = {*placed.blurred, *found.horizon}
    figures.save_figure(draw_gaps(found, placed.model, placed.frame, unused), out / MAP)
    write_json(out / OUTLINES, describe_gaps(found, placed.frame))
    lines = [f"  map       {out / MAP}", f"  outlines  {out / OUTLINES}"]
    (out / MISSION).unlink(missing_ok=True)
    if found.gaps:
        lines.append(f"  mission   {plan_mission(out / MISSION, placed, found)}")
    return lines


def plan_mission(path: Path, placed: PlacedPhotos, found: Gaps) -> str:
    """Write the mission that fills the gaps. Returns its path and length, or why there is none.

    The drone takes off below the photo nearest to the largest gap. As in missions of the agent `plan`, altitudes are
    relative to the takeoff point, so they are wrong where the ground slopes as a whole.
    """
    place, model, surface = placed.frame.georeference, placed.model, found.surface
    if place is None:
        return "none: the photos carry no GPS positions that agree with each other; the map shows where to go"
    views = plan_photos(found, placed.frame, model.cameras[0])
    at = np.stack([camera.centre for camera in views])
    starts = np.stack([camera.centre[:2] for camera in model.cameras])
    home = starts[np.linalg.norm(starts - found.gaps[0].middle[:2], axis=1).argmin()]
    off = float(np.linalg.norm(at[:, :2] - home, axis=1).max() * np.tan(np.radians(place.slope)))
    if off > SAFE * placed.frame.flying_height:
        wrong = f"altitudes would be wrong by up to {off * place.metres_per_unit:.0f} m"
        return f"none: the ground slopes by {place.slope:.0f} degrees, and {wrong}; plan it with a terrain model"
    ground = float(surface.find_heights(home[None])[0])
    lowered = [replace(view, translation=view.translation + view.rotation @ [0, 0, ground]) for view in views]
    clearance = surface.heights.max() - ground + placed.frame.flying_height / 2
    plan, about = plan_flight(lowered, place, home, float(clearance) * place.metres_per_unit)
    write_json(path, plan)
    return f"{path}: {len(views)} photos in {about}. Look at it in QGroundControl before you fly it."


def describe_photos(placed: PlacedPhotos, found: Gaps) -> str:
    """How many photos were placed, and which do not count, in words."""
    total, frame = len(placed.model.names) + len(placed.left_out), placed.frame
    lines = [f"{len(placed.model.names)} of {total} photos could be placed."]
    lines += [f"  {name} could not be placed: {reason}" for name, reason in placed.left_out]
    lines += [f"  {name} is blurred and does not count" for name in placed.blurred]
    lines += [f"  {name} shows the horizon more than the ground and does not count" for name in found.horizon]
    if frame.georeference is None:
        lines.append(f"  {CAMERA_HEIGHT}")
    return "\n".join(lines)
