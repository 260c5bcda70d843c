"""What `make run` and `make view` do: run the workflow, say what was made and where, serve the page."""

import argparse
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from dav_gswt.cli.estimate import describe_estimate
from dav_gswt.cli.interruption import receive_signals
from dav_gswt.cli.machine_speed import measure_speed
from dav_gswt.cli.working_folder import find_running_processes, hold_folder, redate_files
from dav_gswt.config.load import add_scene_files, check_config, read_config
from dav_gswt.errors import InputError
from dav_gswt.logs import describe_os_error
from dav_gswt.paths import encode_branch, stage_folder
from dav_gswt.raster import backends

CONFIG = Path("config/config.yaml")
SCENES = Path("config/scenes")
SMALLER = Path("config/without_compiler.yaml")
LOGGER = Path("workflow/logger")  # a plugin of Snakemake, found by PYTHONPATH
PROFILE_NOTE = "Using workflow specific profile"  # printed by Snakemake before its loggers begin
PLAN = "plan: "  # begins the line that the short log prints for this program: a JSON table of jobs by rule
JOB = re.compile(r"\[\d+ of \d+\] \w+$")  # a line of the log at which a job begins


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m dav_gswt.cli.run", description=__doc__)
    parser.add_argument("--scene", help="a scene of config/scenes or config/config.yaml (default: its `scene`)")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--configfile", nargs="+", type=Path, default=[], help="override config/config.yaml, in order")
    parser.add_argument("--view", action="store_true", help="serve the scene's page on this machine")
    parser.add_argument("--port", type=int, default=8000)
    options = parser.parse_args(arguments)
    try:
        overlays = select_overlays(options.view) + options.configfile
        given = load_config(overlays, {"scene": options.scene} if options.scene else {})
        if options.view:
            return view(given, options.port)
        with hold_folder(Path.cwd()):
            return run(given, options.cores, overlays)
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    except OSError as error:
        print(describe_os_error(error), file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def load_config(overlays: list[Path], changes: dict | None = None) -> dict:
    """The config of this folder with all defaults, as the workflow reads it."""
    return check_config(add_scene_files(read_config([CONFIG, *overlays], changes), SCENES))


def list_presets(overlays: list[Path]) -> list[str]:
    """Presets for terrains: those of the config."""
    return list(read_config([CONFIG, *overlays])["presets"])


def select_overlays(quietly: bool) -> list[Path]:
    """Config files to read before the user's own: a smaller size where PyTorch renders; printed unless quietly."""
    if backends.select_backend() != "torch":
        return []
    if not quietly:
        why = backends.explain_unavailable("cpu") or f"{backends.VARIABLE} asks for it"
        print(f"PyTorch renders, many times slower, so at a smaller size ({SMALLER}): {why}", flush=True)
    return [SMALLER]


def run(given: dict, cores: int, overlays: list[Path]) -> int:
    """Run the workflow for the config's scene; a lock that a killed run left behind is taken away first.

    Snakemake finds profiles/default beside the Snakefile: by it, what a killed run left half made is made again.
    """
    snakemake = [sys.executable, "-m", "snakemake", "--config", f"scene={given['scene']}"]
    if overlays:
        snakemake += ["--configfile", *map(str, [CONFIG, *overlays])]
    locks = Path(".snakemake/locks")
    if locks.is_dir() and any(locks.iterdir()):
        if others := find_running_processes():
            raise InputError(f"another run works in this folder (process {others[0]}): wait for it or stop it")
        print("The last run was cut short; going on where it stopped.")
        subprocess.run([*snakemake, "--unlock"], check=False, capture_output=True)
    if count := redate_files(Path("results")):
        print(f"The clock was set back since the last run: {count} files of results/ are now dated as of today.")
    speed = measure_speed(cores)  # before jobs keep the machine busy
    start = time.monotonic()
    code, jobs = follow(
        [*snakemake, "--cores", str(cores), "--logger", "davgswt"],
        lambda planned: describe_estimate(given, planned, speed, list_presets(overlays)),
    )
    if code < 0 or code == 130:
        print("\nStopped. The same command goes on where this ended.", file=sys.stderr)
        return 130
    if code:
        print("\nNot finished. What stands above says why; the same command goes on from here.", file=sys.stderr)
        return code
    seconds = time.monotonic() - start
    report_result(given, f"{jobs} jobs done in {seconds:.0f} s" if jobs else "Up to date, nothing to do", overlays)
    return 0


def short_log(root: Path) -> dict[str, str]:
    """The environment in which Snakemake finds the plugin `--logger davgswt` of a checkout."""
    places = [str(root / LOGGER), *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(places)}


def follow(command: list[str], describe_plan: Callable[[dict[str, int]], str]) -> tuple[int, int]:
    """Run Snakemake with the short log. Returns its exit status (130 after a signal) and the jobs that began.

    describe_plan: makes a line, printed before the first job, of the number of jobs of each rule.
    """
    begun = 0
    with (
        receive_signals() as received,
        subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            env=short_log(Path.cwd()) | {"DAV_GSWT_PLAN": "1"},
        ) as job,
    ):
        received.watch(job)
        for line in job.stdout or ():
            begun += bool(JOB.match(line))
            if line.startswith(PLAN):
                line = describe_plan(json.loads(line.removeprefix(PLAN))) + "\n"
            if not received.signals and not line.startswith(
                PROFILE_NOTE
            ):  # messages of jobs that end on a signal help nobody
                print(line, end="", flush=True)
        code = job.wait()
    return (130 if received.signals and code else code), begun


def list_pages(given: dict) -> list[Path]:
    """The pages of the config's scene, newest first; those made by its settings, if there are any."""
    scene = given["scene"]
    exact = stage_folder("terrain", encode_branch(given, scene) | {"seed": given["seeds"][0]}) / "page/index.html"
    found = [exact] if exact.is_file() else list(Path("results", scene).rglob("terrain/page/index.html"))
    return sorted((path.parent for path in found), key=lambda path: path.stat().st_mtime, reverse=True)


def report_result(given: dict, done: str, overlays: list[Path]) -> None:
    """Print what was made, where it is, and what to type next."""
    page = list_pages(given)[0]
    terrain, bundle, tiles = page.parent, page.parents[1], page.parents[2]
    usual = given["scene"] == read_config([CONFIG])["scene"] and not set(overlays) - {SMALLER}
    print(
        f"""
{done}.
  stills   {terrain}/*.png
  page     {page} ({_measure_folder(page) / 1e6:.0f} MB)
  tiles    {tiles}/tiles/*.ply (for any splat viewer)
           {bundle}/gswt.zip (for the public GSWT renderer)
  field    {tiles.parent}/field.ply
Next:
  make view{"" if usual else f" SCENE={given['scene']}"}
           walk over the terrain in a browser
  make run SCENE=name
           another scene of config/scenes; docs/photos.md says how to add your own photos""",
        flush=True,
    )


def _measure_folder(folder: Path) -> int:
    """Bytes of all files below a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def view(given: dict, port: int) -> int:
    """Serve the page of a scene, on this machine only."""
    from dav_gswt.terrain import serve

    if not (found := list_pages(given)):
        scene = given["scene"]
        raise InputError(f"there is no page of {scene!r} yet: type `make run SCENE={scene}` first")
    return serve.main([str(found[0]), "--port", str(port)])


if __name__ == "__main__":
    sys.exit(main())
