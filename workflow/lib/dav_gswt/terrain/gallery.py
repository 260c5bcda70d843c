"""A gallery: a static page over several terrains, with their pages beside it, ready for any web server."""

import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder, read_record
from dav_gswt.templates import render_template
from dav_gswt.terrain.page import FRONT, STILL, FrontTexts

TEMPLATE, STYLE = "index.html", "gallery.css"
BY_SYSTEMS = ".DS_Store", "Thumbs.db"  # that file browsers leave


@dataclass(frozen=True)
class Entry:
    """A terrain in the gallery. folder: of its page there. megabytes: of all files of the page."""

    page: Path
    folder: str
    name: str
    line: str
    verdict: str
    megabytes: str


def write_gallery(pages: Sequence[Path | str], template_dir: Path | str, out_dir: Path | str) -> list[Entry]:
    """Copy pages into `out_dir`, a folder each, with a page over all of them; whole or not at all.

    pages: folders as `write_page` makes them with a front, in the order in which they are shown.
    Raises: InputError: there is no page, a folder is none with a front, or `out_dir` holds what is of no gallery.
    """
    if not pages:
        raise InputError("there is no page yet that a gallery could show: type `make run` first")
    entries = list_entries(pages)
    _keep_foreign_files(Path(out_dir))
    with atomic_folder(out_dir) as part:
        for entry in entries:
            shutil.copytree(entry.page, part / entry.folder, ignore=shutil.ignore_patterns(".*"))
        html = render_template(Path(template_dir) / TEMPLATE, {"scenes": entries})
        (part / TEMPLATE).write_text(html, encoding="utf-8")
        shutil.copyfile(Path(template_dir) / STYLE, part / STYLE)
    return entries


def _keep_foreign_files(folder: Path) -> None:
    """Raises: InputError: the folder, which is replaced as a whole, holds what no gallery put there."""
    for path in sorted(folder.iterdir()) if folder.is_dir() else []:
        if path.name not in (TEMPLATE, STYLE, *BY_SYSTEMS) and not (path / FRONT).is_file():
            raise InputError(
                f"{path} is no part of a gallery, and would be deleted with the old one: move it, or name another "
                "folder with --out"
            )


def list_entries(pages: Sequence[Path | str]) -> list[Entry]:
    """What the gallery says of each page; pages of the same name have numbered folders. Raises: as `write_gallery`."""
    entries: list[Entry] = []
    for page in map(Path, pages):
        if not ((page / FRONT).is_file() and (page / STILL).is_file()):
            raise InputError(f"{page}: a page without name and still ({FRONT}, {STILL}); make it again with `make run`")
        front = read_record(page / FRONT, FrontTexts, "make the page again")
        size = sum(path.stat().st_size for path in page.rglob("*") if path.is_file())
        wanted, taken = (
            re.sub(r"[^a-z0-9]+", "-", front.name.lower()).strip("-") or "terrain",
            {e.folder for e in entries},
        )
        names = [wanted, *(f"{wanted}-{number}" for number in range(2, len(taken) + 2))]
        folder = next(each for each in names if each not in taken)
        entries.append(Entry(page, folder, front.name, front.line, front.verdict, f"{size / 1e6:.1f}"))
    return entries
