"""What `make gallery` does: one static page over the newest terrain of every scene, in results/gallery."""

import argparse
import sys
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.logs import describe_os_error
from dav_gswt.paths import RESULTS
from dav_gswt.terrain.gallery import write_gallery
from dav_gswt.terrain.page import FRONT

TEMPLATES = Path("workflow/gallery")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m dav_gswt.cli.gallery", description=__doc__)
    parser.add_argument("pages", nargs="*", type=Path, help="page folders (default: the newest of every scene)")
    parser.add_argument("--out", type=Path, default=Path(RESULTS, "gallery"))
    options = parser.parse_args(arguments)
    try:
        entries = write_gallery(options.pages or find_pages(Path(RESULTS)), TEMPLATES, options.out)
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    except OSError as error:
        print(describe_os_error(error), file=sys.stderr)
        return 1
    print(f"{options.out / 'index.html'}: {', '.join(entry.name for entry in entries)}")
    print(f"Any static host takes the folder {options.out} as it is.")
    return 0


def find_pages(results: Path) -> list[Path]:
    """The newest page with a front of each scene, by the scenes' names."""
    newest: dict[str, Path] = {}
    for front in sorted(results.glob(f"*/seed*/**/terrain/page/{FRONT}"), key=lambda path: path.stat().st_mtime):
        newest[front.relative_to(results).parts[0]] = front.parent
    return [newest[scene] for scene in sorted(newest)]


if __name__ == "__main__":
    sys.exit(main())
