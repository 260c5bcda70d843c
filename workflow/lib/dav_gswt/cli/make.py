"""`dav-gswt make INPUT`: photos, a video, a splat or another program's project become a terrain, in one command.

The terrain lies in a folder of its own, `NAME-terrain`: the page, a still, the field, a report, `scene.yaml`, which can
be edited and run again, and `results`, the files of all stages.
"""

import argparse
import html
import os
import shlex
import shutil
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

import yaml

from dav_gswt.cli import at_least, run
from dav_gswt.cli.judgement import judge_terrain
from dav_gswt.config.load import add_scene_files, check_config, read_config
from dav_gswt.errors import InputError
from dav_gswt.files import REPOSITORY, atomic_file, atomic_folder
from dav_gswt.paths import encode_branch, stage_folder
from dav_gswt.photos.recognition import Recognised, name_scene, recognize_input

SCENE_FILE, STILL = "scene.yaml", "walker.png"
AGENTS = {"drone": "plan", "handheld": "handheld", "rig": "serial"}  # --capture, and the scene's agent
START, USUAL_ROUND = 8, 4  # photos of the first fit and of a round where a budget is given
HEAD = """\
# A terrain of {about}.
# Change what you like and run `dav-gswt make {folder}` again.
# Every key: workflow/schemas/config.schema.json (`dav-gswt --help` says where that is).
"""


@dataclass(frozen=True)
class Made:
    """What `make` wrote. page: a folder to serve or publish. scene: the file to edit and run again."""

    page: Path
    still: Path
    field: Path
    report: Path | None
    scene: Path
    judgement: tuple[str, ...] = ()


def add_command(commands) -> None:
    """Add the command to a parser's commands."""
    about = "photos, a video, a splat or another program's project become a terrain"
    _add_options(commands.add_parser("make", help=about, description=__doc__))


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("input", nargs="+", type=Path, help="photos or folders of them, a video, a splat, a project")
    parser.add_argument("-o", "--out", type=Path, metavar="FOLDER", help="where it is written (default: NAME-terrain)")
    parser.add_argument("--preset", help="draft, standard or reference: speed against accuracy (default: standard)")
    parser.add_argument("--model", type=Path, help="known cameras: COLMAP, nerfstudio or OpenSfM")
    parser.add_argument("--masks", type=Path, metavar="FOLDER", help="masks named as the photos: black is no ground")
    parser.add_argument("--focal", type=float, metavar="MM", help="focal length (35 mm equivalent) where EXIF has none")
    parser.add_argument("--test", type=at_least(0), metavar="N", help="photos set aside to judge the result")
    parser.add_argument("--budget", type=at_least(2), metavar="N", help="use N photos, chosen where they matter most")
    parser.add_argument("--capture", choices=AGENTS, help="who takes photos that do not exist yet")
    parser.add_argument("--cores", type=at_least(1), default=os.cpu_count() or 2)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    out, settings = prepare_scene(options)
    return run_scene(out, settings, options.cores)


def make_terrain(source: Path, out: Path | None = None, **given: Any) -> Made:
    """`dav-gswt make` for Python. given: options of the command line. Raises: InputError: no terrain was made."""
    parser = argparse.ArgumentParser()
    _add_options(parser)
    options = parser.parse_args([str(source.expanduser())])
    if unknown := sorted(given.keys() - vars(options).keys()):
        raise InputError(f"{unknown[0]}: no option of `dav-gswt make`")
    vars(options).update(given, out=out)
    folder, settings = prepare_scene(options)
    if run_scene(folder, settings, options.cores):
        raise InputError(f"{source}: no terrain was made; what was printed says why")
    return collect_results(folder, settings)


def prepare_scene(options: argparse.Namespace) -> tuple[Path, dict[str, Any]]:
    """The folder of the terrain, with its scene.yaml, and the config that it stands for.

    Raises: InputError: the input is not understood, or the folder is in the way.
    """
    if earlier := find_earlier(options.input):
        out = earlier
        given = read_config([out / SCENE_FILE])
        print(f"Goes on with {out / SCENE_FILE}")
        recognised = None
    else:
        recognised = recognize_input(options.input, options.model)
        out = options.out or name_terrain(options.input[0])
        print(f"{', '.join(map(str, options.input))}: {recognised.about}")
        given = read_earlier(out, recognised)
    changed, path = apply_options(given, options), out / SCENE_FILE
    settings = load_settings(changed)  # before they are written: a wrong option is not kept
    if not path.is_file() and recognised:
        write_scene(path, changed, HEAD.format(about=recognised.about, folder=out))
    elif changed != given:
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
        write_scene(path, changed, "".join(takewhile(lambda line: line.startswith("#"), lines)))
    return out, settings


def name_terrain(source: Path) -> Path:
    """The folder here that a terrain of an input is written to."""
    return Path(f"{name_scene(source)}-terrain")


def find_earlier(inputs: list[Path]) -> Path | None:
    """The folder of a terrain, if the input is one, or its scene.yaml."""
    if len(inputs) > 1:
        return None
    path = inputs[0]
    if path.is_file() and path.suffix in (".yaml", ".yml"):
        if path.name != SCENE_FILE:
            raise InputError(f"{path}: a scene is run again by its {SCENE_FILE}; config files go to Snakemake")
        return path.parent
    return path if path.is_dir() and (path / SCENE_FILE).is_file() else None


def read_earlier(out: Path, recognised: Recognised) -> dict[str, Any]:
    """The settings of a folder that an earlier run of this input left, or those of a new one.

    Raises: InputError: the folder is not empty, or has the terrain of another input.
    """
    fresh = {"scene": recognised.name, "scenes": {recognised.name: recognised.entry}}
    if not out.exists() or out.is_dir() and not any(out.iterdir()):
        return fresh
    if not out.is_dir() or not (out / SCENE_FILE).is_file():
        raise InputError(f"{out}: is in the way and no terrain (it has no {SCENE_FILE}); name another with -o FOLDER")
    earlier = read_config([out / SCENE_FILE])
    entry = (earlier.get("scenes") or {}).get(earlier.get("scene"), {})
    keys = ("folder", "field")
    if any(entry.get(key) != recognised.entry.get(key) for key in keys):
        raise InputError(f"{out}: has the terrain of another input; name another folder with -o FOLDER")
    return earlier


def apply_options(given: Mapping[str, Any], options: argparse.Namespace) -> dict[str, Any]:
    """The settings with those of the command line."""
    name = given["scene"]
    entry = dict(given["scenes"][name])
    for key in ("preset", "focal", "test"):
        if getattr(options, key) is not None:
            entry[key] = getattr(options, key)
    for key in ("model", "masks"):
        if (path := getattr(options, key)) is not None:
            if not path.exists():
                raise InputError(f"--{key} {path}: there is no such file or folder")
            entry[key] = str(path.resolve())
    settings = dict(given)
    if options.budget is not None:
        entry["start"], settings["rounds"], settings["k"] = split_budget(options.budget)
    if options.capture:
        entry["agent"] = AGENTS[options.capture]
    settings["scenes"] = dict(given["scenes"]) | {name: entry}
    return settings


def split_budget(photos: int) -> tuple[int, int, int]:
    """The photos to start from, rounds, and photos a round: the paper's loop for so many photos in all."""
    if photos < START:
        return photos, 0, 1
    rounds = max(1, round((photos - START) / USUAL_ROUND)) if photos > START else 0
    per_round = (photos - START) // rounds if rounds else 1
    return photos - rounds * per_round, rounds, per_round


def write_scene(path: Path, settings: Mapping[str, Any], head: str) -> None:
    """Write a scene.yaml whole or not at all."""
    with atomic_file(path) as part:
        part.write_text(head + yaml.safe_dump(dict(settings), sort_keys=False, width=100), encoding="utf-8")


def load_settings(given: Mapping[str, Any]) -> dict[str, Any]:
    """The config with the settings of a scene.yaml, and all defaults. Raises: InputError."""
    files = [REPOSITORY / run.CONFIG, *run.select_overlays(REPOSITORY)]
    return check_config(add_scene_files(read_config(files, given), REPOSITORY / run.SCENES))


def run_scene(out: Path, settings: dict[str, Any], cores: int) -> int:
    """Run the workflow in the folder, and put its results where they are found. Returns the exit status."""
    overlays = [*run.select_overlays(REPOSITORY), (out / SCENE_FILE).resolve()]
    status, done = run.run_workflow(settings["scene"], cores, overlays, REPOSITORY, out.resolve())
    if status == 0:
        print(f"\n{done}.")
        report_made(collect_results(out, settings))
    return status


def collect_results(out: Path, settings: dict[str, Any]) -> Made:
    """Link the page, a still, the field and the report into the folder; they replace those of an earlier run."""
    branch = encode_branch(settings, settings["scene"]) | {"seed": settings["seeds"][0]}
    terrain, round_folder = (out / stage_folder(stage, branch) for stage in ("terrain", "round"))
    photos = out / stage_folder("photos", branch)
    link_folder(terrain / "page", out / "page")
    link_file(terrain / STILL, out / "terrain.png")
    link_file(round_folder / "field.ply", out / "field.ply")
    report = out / "report.html" if (photos / "report.html").is_file() else None
    materials = out / stage_folder("materials", branch) / "materials.json"
    if materials.is_file():
        link_file(materials.with_name("materials.png"), out / "materials.png")
    read = (materials, round_folder / "metrics.json", round_folder / "windows/windows.json")
    bundle, tiles = (out / stage_folder(stage, branch) for stage in ("bundle", "tiles"))
    read = (*read, bundle / "davgswt.json", tiles / "seams.json")
    said = judge_terrain(photos / "ground.json", *(each if each.is_file() else None for each in read))
    if report:
        add_to_report(photos / "report.html", said, report)
    return Made(out / "page", out / "terrain.png", out / "field.ply", report, out / SCENE_FILE, tuple(said))


def add_to_report(page: Path, sentences: list[str], target: Path) -> None:
    """The page on the photos with what was made of them at its end."""
    said = "".join(f"<li>{html.escape(sentence)}</li>\n" for sentence in sentences)
    body, end = page.read_text(encoding="utf-8").rsplit("</body>", 1)
    with atomic_file(target) as part:
        part.write_text(f"{body}<h2>What was made of them</h2>\n<ul>\n{said}</ul>\n</body>{end}", encoding="utf-8")


def link_file(source: Path | str, target: Path | str) -> None:
    """A second name of a file, or a copy where the disk has no such names. It takes the target's place at once."""
    with atomic_file(target) as part:
        part.unlink(missing_ok=True)
        try:
            part.hardlink_to(source)
        except OSError:
            shutil.copyfile(source, part)


def link_folder(source: Path, target: Path) -> None:
    """A folder whose files are second names of another folder's."""
    with atomic_folder(target) as part:
        shutil.copytree(source, part, copy_function=link_file, dirs_exist_ok=True)


def report_made(made: Made) -> None:
    """Print where the results are, and what to type next."""
    size, folder = sum(path.stat().st_size for path in made.page.rglob("*") if path.is_file()), made.page.parent
    program = shlex.quote(os.path.relpath(sys.argv[0]) if shutil.which("dav-gswt") is None else "dav-gswt")
    lines = [*(f"  {sentence}" for sentence in made.judgement), ""] if made.judgement else []
    lines += [
        f"  page     {made.page} ({size / 1e6:.0f} MB; any web host can serve it)",
        f"  still    {made.still}",
        f"  field    {made.field} (for any splat viewer; for engines: {program} export {folder} -o FOLDER)",
    ]
    lines += [f"  report   {made.report}"] if made.report else []
    lines += [
        f"  scene    {made.scene} (edit it, then run `{program} make {folder}`)",
        f"Walk over it: {program} view {folder}",
    ]
    print("\n".join(lines), flush=True)
