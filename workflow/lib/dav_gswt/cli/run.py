"""What `make run` and `make view` do: run the workflow, say where the results are, and serve the page."""

import argparse
import getpass
import os
import re
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import psutil

from dav_gswt.cli import at_least, run_safely
from dav_gswt.config.load import add_scene_files, check_config, read_config
from dav_gswt.errors import InputError
from dav_gswt.paths import RESULTS, encode_branch, stage_folder
from dav_gswt.raster import backends
from dav_gswt.terrain import serve

CONFIG, SCENES = Path("config/config.yaml"), Path("config/scenes")
SMALLER = Path("config/without_compiler.yaml")
LOGGER = Path("workflow/logger")  # a plugin of Snakemake, found by PYTHONPATH
PROFILE_NOTE = "Using workflow specific profile"  # printed by Snakemake before its loggers begin
JOB = re.compile(r"\[\d+ of \d+\] .* \.\.\.$")  # a line of the log at which a job begins
ODD_LETTERS = re.compile(r"""[\s'"\\$&;()<>|*?\[\]{}`!]""")  # that a shell does not take as they are
GRACE = 5.0  # seconds that jobs have to end by themselves after a signal, and then Snakemake


def main(arguments: list[str] | None = None) -> int:
    """Run the workflow, or serve its page. Returns the exit status, 130 after a signal."""
    parser = argparse.ArgumentParser(prog="python -m dav_gswt.cli.run", description=__doc__)
    parser.add_argument("--scene", help="a scene of config/scenes or config/config.yaml (default: its `scene`)")
    parser.add_argument("--cores", type=at_least(1), default=2)
    parser.add_argument("--configfile", nargs="+", type=Path, default=[], help="override config/config.yaml, in order")
    parser.add_argument("--view", action="store_true", help="serve the scene's page on this machine")
    parser.add_argument("--port", type=int, default=8000)
    parser.set_defaults(run=_run)
    return run_safely(parser.parse_args(arguments))


def _run(options: argparse.Namespace) -> int:
    overlays = select_overlays() + options.configfile
    changes = {"scene": options.scene} if options.scene else {}
    given = check_config(add_scene_files(read_config([CONFIG, *overlays], changes), SCENES))
    if not options.view:
        return run(given, options.cores, overlays)
    if not (pages := list_pages(given)):
        scene = given["scene"]
        raise InputError(f"there is no page of {scene!r} yet: type `make run SCENE={scene}` first")
    serve.serve(pages[0], options.port)
    return 0


def select_overlays(root: Path = Path()) -> list[Path]:
    """The config files of a workflow to read before the user's: a smaller size where PyTorch renders."""
    return [root / SMALLER] if backends.select_backend() == "torch" else []


def run(given: dict, cores: int, overlays: list[Path]) -> int:
    """Run this folder's workflow for the config's scene and say what was made. Returns the exit status."""
    code, done = run_workflow(given["scene"], cores, overlays)
    if code == 0:
        report_result(given, done, overlays)
    return code


def run_workflow(
    scene: str, cores: int, overlays: list[Path], root: Path = Path(), folder: Path = Path()
) -> tuple[int, str]:
    """Run a workflow for a scene. Returns the exit status, 130 after a signal, and what was done, in words.

    root: of the workflow. folder: gets `results`. Snakemake does not remove the lock of a run that was killed; this
    function does, unless a process still works in the folder.

    Raises: InputError: another run works in the folder, or Snakemake cannot start this Python.
    """
    if ODD_LETTERS.search(sys.executable):
        raise InputError(
            f"{sys.executable}: Snakemake starts no job with a Python whose path has blanks or quotes; install the "
            "program into a folder without them"
        )
    os.environ.update(replace_missing_user(folder))
    if backends.select_backend() == "torch":
        why = backends.explain_unavailable("cpu") or f"{backends.VARIABLE} asks for it"
        print(f"PyTorch renders, many times slower, so at a smaller size ({SMALLER}): {why}", flush=True)
    snakemake = [sys.executable, "-m", "snakemake", "--config", f"scene={scene}"]
    if root != Path():
        profile = root / "workflow/profiles/default"  # Snakemake finds it in a clone, beside the Snakefile
        snakemake += ["--snakefile", str(root / "Snakefile"), "--workflow-profile", str(profile)]
        snakemake += ["--directory", str(folder)]
    if overlays:
        snakemake += ["--configfile", *map(str, [root / CONFIG, *overlays])]
    if any((folder / ".snakemake/locks").glob("*")):
        if others := find_running_processes(folder):
            raise InputError(f"another run works in this folder (process {others[0]}): wait for it or stop it")
        print("The last run was cut short; going on where it stopped.")
        subprocess.run([*snakemake, "--unlock"], check=False, capture_output=True)
    start = time.monotonic()
    code, jobs = follow([*snakemake, "--cores", str(cores), "--logger", "davgswt"], root)
    if code < 0 or code == 130:
        print("\nStopped. The same command goes on where this ended.", file=sys.stderr)
        return 130, ""
    if code:
        print("\nNot finished. What stands above says why; the same command goes on from here.", file=sys.stderr)
        return code, ""
    seconds = time.monotonic() - start
    return 0, f"{jobs} job{'s' * (jobs != 1)} done in {seconds:.0f} s" if jobs else "Up to date, nothing to do"


def find_running_processes(folder: Path = Path()) -> list[int]:
    """The processes that work in a folder: Snakemake, or a job that outlived it."""
    here, found = folder.resolve(), []
    for process in psutil.process_iter():
        with suppress(psutil.Error, OSError):
            words = process.cmdline()[:4]
            works = any(word.endswith("snakemake") or ".snakemake/scripts/" in word for word in words)
            if works and Path(process.cwd()) == here:
                found.append(process.pid)
    return found


def short_log(root: Path) -> dict[str, str]:
    """The environment in which Snakemake finds the plugin `--logger davgswt` of a checkout."""
    places = [str(root / LOGGER), *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(places)}


def replace_missing_user(folder: Path) -> dict[str, str]:
    """The variables that take the place of what the system does not know of its user, as under `docker run --user`.

    Without an entry in /etc/passwd there is no name; where the home cannot be written, caches and settings of
    libraries go to `folder`.
    """
    missing = {}
    try:
        getpass.getuser()
    except (KeyError, OSError):  # OSError from Python 3.13 on
        missing["USER"] = f"user{os.getuid()}"
    for name, usual in (("XDG_CACHE_HOME", ".cache"), ("XDG_CONFIG_HOME", ".config")):
        place = Path(os.environ.get(name) or Path(os.environ.get("HOME", ""), usual))
        there = next(part for part in (place, *place.parents) if part.exists())
        if not place.is_absolute() or not os.access(there, os.W_OK):
            missing[name] = str(folder.resolve() / ".snakemake" / name.lower())
    return missing


def follow(command: list[str], root: Path = Path()) -> tuple[int, int]:
    """Run Snakemake with the short log. Returns its exit status (130 after a signal) and the number of jobs begun."""
    begun, received = 0, []

    def receive(number: int, _frame: object) -> None:
        received.append(number)
        if len(received) == 1:
            threading.Thread(target=end_run, args=(job, number), daemon=True).start()

    # A shell makes its background commands ignore Ctrl-C, which Snakemake would inherit.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        env=short_log(root.resolve()),
    ) as job:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, receive)
        for line in job.stdout or ():
            begun += bool(JOB.match(line))
            if not received and not line.startswith(PROFILE_NOTE):  # a job that a signal ends has nothing to tell
                print(line, end="", flush=True)
        code = job.wait()
    return (130 if received and code else code), begun


def end_run(job: subprocess.Popen, number: int) -> None:
    """End Snakemake and its jobs after a signal. Snakemake alone would wait for its jobs after SIGTERM.

    A terminal sends Ctrl-C to all of them. SIGTERM comes to this process alone, so the jobs are interrupted here. Jobs
    that go on, in compiled code, are killed after GRACE seconds, and Snakemake tidies up after them.
    """
    if number == signal.SIGTERM:
        _send(signal.SIGINT, [psutil.Process(job.pid), *_list_children(job.pid)])
    for last in (False, True):
        with suppress(subprocess.TimeoutExpired):
            job.wait(GRACE)
            return
        _send(signal.SIGKILL, [each for each in _list_children(job.pid) if last or not _is_snakemake(each)])
    job.kill()


def _list_children(pid: int) -> list[psutil.Process]:
    with suppress(psutil.Error):
        return psutil.Process(pid).children(recursive=True)
    return []


def _is_snakemake(process: psutil.Process) -> bool:
    with suppress(psutil.Error):
        return any(word.endswith("snakemake") for word in process.cmdline()[:4])
    return False


def _send(number: int, processes: list[psutil.Process]) -> None:
    for process in processes:
        with suppress(psutil.Error):  # it has ended
            process.send_signal(number)


def list_pages(given: dict) -> list[Path]:
    """The pages of the config's scene, newest first, or the page of exactly its settings if that exists."""
    scene = given["scene"]
    exact = stage_folder("terrain", encode_branch(given, scene) | {"seed": given["seeds"][0]}) / "page/index.html"
    found = [exact] if exact.is_file() else list(Path("results", scene).rglob("terrain/page/index.html"))
    return sorted((path.parent for path in found), key=lambda path: path.stat().st_mtime, reverse=True)


def report_result(given: dict, done: str, overlays: list[Path]) -> None:
    """Print what was made, where it is, and what to type next; results/latest/SCENE leads there."""
    page = list_pages(given)[0]
    latest, folder = Path(RESULTS, "latest", given["scene"]), page.parents[3]  # the folder of a round
    latest.parent.mkdir(parents=True, exist_ok=True)
    latest.unlink(missing_ok=True)
    latest.symlink_to(os.path.relpath(folder, latest.parent), target_is_directory=True)
    terrain, field = latest / page.parent.relative_to(folder), latest
    page = terrain / page.name
    usual = given["scene"] == read_config([CONFIG])["scene"] and not set(overlays) - {SMALLER}
    size = sum(path.stat().st_size for path in page.rglob("*") if path.is_file())
    print(
        f"""
{done}.
  stills   {terrain}/*.png
  page     {page} ({size / 1e6:.0f} MB)
  field    {field}/field.ply (for any splat viewer)
  others   .venv/bin/dav-gswt export {field} --formats glb tiles gswt -o FOLDER
Next:
  make view{"" if usual else f" SCENE={given['scene']}"}
           walk over the terrain in a browser
  make run SCENE=name
           another scene of config/scenes; docs/photos.md says how to add your own photos""",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
