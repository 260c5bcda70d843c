"""A digest of the library code that a script runs: Snakemake follows a rule's script, but not what it imports."""

import re
from functools import cache
from hashlib import sha256
from pathlib import Path

LIBRARY = Path(__file__).parent
_STRING_OR_COMMENT = re.compile(
    r'''"""(?:\\.|[^\\])*?"""|\'\'\'(?:\\.|[^\\])*?\'\'\'|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|#[^\n]*''', re.S
)
_BLANK = re.compile(r"[ \t]*(?:\n[ \t]*)*\n")
_IMPORT = re.compile(r"^[ \t]*(?:from ([\w.]+) import (\([^)]*\)|[^\n]*)|import ([\w.]+))", re.M)


@cache
def digest_code(script: Path, *packages: Path) -> str:
    """Digest of every library file that a script imports, directly or through other library files.

    packages: the folders of the packages whose files count; without any, this library's.

    Imports inside functions count, docstrings and comments do not. The C++ sources count where the rasterizer is
    imported. Files are read once a process: a plan asks for each script's digest many times.
    """
    packages, files = packages or (LIBRARY,), dict[str, Path]()
    found = list(_imported_modules(script, packages))
    while found:
        module = found.pop()
        if module not in files and (file := _file_of(module, packages)):
            files[module] = file
            found += _imported_modules(file, packages)
    digest = sha256("".join(_read_code(files[module]) for module in sorted(files)).encode())
    if "dav_gswt.raster" in files:
        core = sorted(f for f in (LIBRARY / "raster/core").iterdir() if f.suffix in (".cpp", ".h", ".txt"))
        digest.update(b"".join(file.read_bytes() for file in core))
    return digest.hexdigest()[:12]


def remove_prose(source: str) -> str:
    """Python source without comments and blank lines, and with empty docstrings: what it does is the same.

    By a regular expression of strings and comments: parsing all of the library takes seconds, and every job plans anew.
    """
    kept, code, end = [], "", 0
    for found in _STRING_OR_COMMENT.finditer(source):
        code, end, token = code + source[end : found.start()], found.end(), found.group()
        if token.startswith("#"):
            continue
        alone = not code.rpartition("\n")[2].strip()  # the first token of its line
        if alone and token.startswith('"""') and (code.rstrip().endswith(":") or not kept and not code.strip()):
            code += '""'
        else:
            kept += [_BLANK.sub("\n", code), token]
            code = ""
    return "".join([*kept, _BLANK.sub("\n", code + source[end:])])


@cache
def _read_code(file: Path) -> str:
    return remove_prose(file.read_text(encoding="utf-8"))


@cache
def _imported_modules(file: Path, packages: tuple[Path, ...]) -> tuple[str, ...]:
    """The library modules that a file imports, and the packages that they lie in."""
    found: set[str] = set()
    for origin, names, plain in _IMPORT.findall(file.read_text(encoding="utf-8")):
        parts = (plain or origin).split(".")
        if parts[0] not in {package.name for package in packages}:
            continue
        found.update(".".join(parts[: n + 1]) for n in range(len(parts)))  # the packages that it lies in, too
        named = re.findall(r"\w+", re.sub(r" as \w+|#.*", "", names))
        found.update(f"{origin}.{name}" for name in named if _file_of(f"{origin}.{name}", packages))
    return tuple(sorted(found))


@cache
def _file_of(module: str, packages: tuple[Path, ...]) -> Path | None:
    """The file of a library module or package; None where the name is none (a function, a compiled module)."""
    top, *parts = module.split(".")
    place = next(package for package in packages if package.name == top).joinpath(*parts)
    files = (place / "__init__.py", place.with_suffix(".py"))
    return next((file for file in files if file.is_file()), None)
