"""What kind of file it is, by its first bytes: names and suffixes of people's files are often wrong."""

import shlex
import zipfile
from pathlib import Path
from typing import Literal

Kind = Literal["photo", "heif", "raw", "video", "ply", "spz", "spz4", "splat", "ksplat", "sog", "other"]

SUFFIXES = {".jpg", ".jpeg", ".jpe", ".jfif", ".png", ".tif", ".tiff", ".webp", ".jp2", ".jxl", ".bmp", ".ppm", ".tga"}
HEIF_SUFFIXES = {".heic", ".heif", ".hif", ".avif"}
HEAD = 32  # bytes that tell
STILL_BRANDS = {b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1", b"avif", b"avis"}
PHOTO_MAGIC = (b"\xff\xd8\xff", b"\x89PNG", b"II*\0", b"MM\0*", b"BM", b"P5", b"P6", b"\xff\x0a", b"\0\0\0\x0cJXL ")
PHOTO_MAGIC = (*PHOTO_MAGIC, b"\0\0\0\x0cjP  ")
RAW_SUFFIXES = {".dng", ".cr2", ".cr3", ".nef", ".arw", ".orf", ".rw2", ".raf", ".raw"}  # most are TIFF by their bytes
ATOMS = {b"moov", b"mdat", b"wide", b"free", b"skip"}  # a QuickTime file may begin with any of them
BY_SUFFIX: dict[str, Kind] = {".splat": "splat", ".ksplat": "ksplat"}  # their first bytes tell nothing
UNREAD: dict[Kind, str] = {
    "splat": "a .splat (antimatter15)",
    "ksplat": "a .ksplat (GaussianSplats3D)",
    "sog": "a SOG (PlayCanvas)",
    "spz4": "an SPZ of version 4 (versions 1 to 3 are read)",
}
CONVERTER = "npx @playcanvas/splat-transform"  # Node.js


def detect_kind(path: Path) -> Kind:
    """The kind of a file. A file that cannot be read is `other`."""
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError:
        return "other"
    suffix = path.suffix.lower()
    if suffix in RAW_SUFFIXES:
        return "raw"
    if head[4:8] == b"ftyp":
        return "heif" if head[8:12] in STILL_BRANDS else "raw" if head[8:12] == b"crx " else "video"
    if head[4:8] in ATOMS:
        return "video"
    if head.startswith(PHOTO_MAGIC) or head[:4] == b"RIFF" and head[8:12] == b"WEBP" or suffix == ".tga":
        return "photo"
    if head.startswith((b"ply\n", b"ply\r")):
        return "ply"
    if head.startswith(b"\x1f\x8b") and suffix == ".spz":
        return "spz"
    if head.startswith(b"NGSP"):
        return "spz4"
    if head.startswith(b"PK\3\4"):
        return "sog" if _has_member(path, "meta.json") else "other"
    return BY_SUFFIX.get(suffix, "other")


def advise_conversion(path: Path, kind: Kind) -> str | None:
    """What a splat is that the library does not read, and the command that converts it; None if it reads this kind."""
    source = path / "meta.json" if path.is_dir() else path  # an unpacked SOG is a folder
    command = f"{CONVERTER} {shlex.quote(str(source))} {shlex.quote(f'{path.stem}.ply')}"
    return f"is {UNREAD[kind]}; convert it: {command}" if kind in UNREAD else None


def _has_member(path: Path, name: str) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            return name in archive.namelist()
    except (OSError, zipfile.BadZipFile):
        return False
