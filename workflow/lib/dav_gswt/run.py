"""What `make run` and `make view` do: run the workflow, say what was made and where, serve the page."""

import argparse
import subprocess
import sys
import time
from pathlib import Path

import psutil
import yaml

from dav_gswt.errors import InputError

CONFIG = Path("config/config.yaml")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m dav_gswt.run", description=__doc__)
    parser.add_argument("--scene", help="an entry of scenes in config/config.yaml (default: its scene)")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--view", action="store_true", help="serve the scene's page on this machine")
    parser.add_argument("--port", type=int, default=8000)
    options = parser.parse_args(arguments)
    try:
        scene = options.scene or yaml.safe_load(CONFIG.read_text(encoding="utf-8"))["scene"]
        if options.view:
            return view(scene, options.port)
        return run(scene, options.cores)
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def run(scene: str, cores: int) -> int:
    """Run the workflow for one scene; a lock that a killed run left behind is taken away first."""
    snakemake = [sys.executable, "-m", "snakemake", "--config", f"scene={scene}"]
    if Path(".snakemake/locks").is_dir() and any(Path(".snakemake/locks").iterdir()):
        if others := running():
            raise InputError(f"another run works in this folder (process {others[0]}): wait for it or stop it")
        subprocess.run([*snakemake, "--unlock", "--quiet"], check=True, stdout=subprocess.DEVNULL)
    start = time.monotonic()
    done = subprocess.run(
        [*snakemake, "--cores", str(cores), "--rerun-incomplete", "--quiet", "rules", "host", "reason"], check=False
    )
    if done.returncode:
        print("\nNot finished. What stands above says why; run the same command again to go on.", file=sys.stderr)
        return done.returncode
    tell(scene, time.monotonic() - start)
    return 0


def running() -> list[int]:
    """Processes of Snakemake that work in this folder."""
    here, found = Path.cwd(), []
    for process in psutil.process_iter():
        try:
            if any(part.endswith("snakemake") for part in process.cmdline()[:4]) and Path(process.cwd()) == here:
                found.append(process.pid)
        except (psutil.Error, OSError):
            continue
    return found


def pages(scene: str) -> list[Path]:
    """The scene's pages, newest first."""
    found = Path("results", scene).rglob("terrain/page/index.html")
    return sorted((p.parent for p in found), key=lambda p: p.stat().st_mtime, reverse=True)


def tell(scene: str, seconds: float) -> None:
    """What was made, where it is, and what to type next."""
    page = pages(scene)[0]
    terrain, bundle, tiles = page.parent, page.parents[1], page.parents[2]
    print(
        f"""
Done in {seconds:.0f} s.
  stills   {terrain}/*.png
  page     {page}
  tiles    {bundle}/gswt.zip (for the public GSWT renderer), {tiles}/tiles/*.ply (for any splat viewer)
  field    {tiles.parent}/field.ply
Next:
  make view{"" if scene == default() else f" SCENE={scene}"}     walk over the terrain in a browser
  make run SCENE=name    another scene of config/config.yaml; config/README.md says how to add your own photos"""
    )


def default() -> str:
    return yaml.safe_load(CONFIG.read_text(encoding="utf-8"))["scene"]


def view(scene: str, port: int) -> int:
    """Serve the newest page of a scene, on this machine only."""
    from dav_gswt.terrain import serve

    if not (found := pages(scene)):
        raise InputError(f"there is no page of {scene!r} yet: type `make run SCENE={scene}` first")
    return serve.main([str(found[0]), "--port", str(port)])


if __name__ == "__main__":
    sys.exit(main())
