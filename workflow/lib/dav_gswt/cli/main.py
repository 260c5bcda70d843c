"""`dav-gswt`: the commands beside `make run` and `make view`."""

import argparse
import sys
from pathlib import Path

from dav_gswt.cli import export, run_safely
from dav_gswt.inspect import command as inspect
from dav_gswt.paths import RESULTS
from dav_gswt.terrain import serve


def main(arguments: list[str] | None = None) -> int:
    """Run a command. Returns the exit status: 1, with a message, where the input cannot be used."""
    parser = argparse.ArgumentParser(prog="dav-gswt", description=__doc__)
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    inspect.add_command(commands)
    export.add_command(commands)
    about = "serve a page folder on this machine"
    command = commands.add_parser("serve", help=about, description=about)
    command.add_argument("dir", type=Path, help="a page folder, as make_page writes it")
    command.add_argument("--port", type=int, default=8000)
    command.set_defaults(run=lambda options: serve.serve(options.dir, options.port))
    about = "one static page over the newest terrain of every scene"
    command = commands.add_parser("gallery", help=about, description=about)
    command.add_argument("pages", nargs="*", type=Path, help="page folders (default: the newest of every scene)")
    command.add_argument("--out", type=Path, default=Path(RESULTS, "gallery"))
    command.set_defaults(run=_run_gallery)
    return run_safely(parser.parse_args(arguments))


def find_pages(results: Path) -> list[Path]:
    """The newest page with a front of each scene, by the scenes' names."""
    from dav_gswt.terrain.page import FRONT  # here, not above: it is slow to load

    newest: dict[str, Path] = {}
    for front in sorted(results.glob(f"*/seed*/**/terrain/page/{FRONT}"), key=lambda path: path.stat().st_mtime):
        newest[front.relative_to(results).parts[0]] = front.parent
    return [newest[scene] for scene in sorted(newest)]


def _run_gallery(options: argparse.Namespace) -> None:
    from dav_gswt.terrain.gallery import write_gallery  # here, not above: it is slow to load

    entries = write_gallery(options.pages or find_pages(Path(RESULTS)), Path("workflow/gallery"), options.out)
    print(f"{options.out / 'index.html'}: {', '.join(entry.name for entry in entries)}")
    print(f"Any static host takes the folder {options.out} as it is.")


if __name__ == "__main__":
    sys.exit(main())
