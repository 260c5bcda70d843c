"""Hooks of mkdocs: write reference/api.md, the list of modules and their public names, from the source's docstrings.

Nothing is imported, so the site builds without the library's dependencies.
"""

import ast
import re
from pathlib import Path

from mkdocs.structure.files import File, Files

LIBRARY = Path(__file__).parent / "lib/dav_gswt"
HEAD = """# Python API

The first line of every module's, class's and function's docstring. The source has the rest: formulas, shapes, units,
edge cases and errors. Import packages as `dav_gswt.<package>.<module>`.
"""


def on_files(files: Files, config) -> Files:
    """Add the page to the site."""
    files.append(File.generated(config, "reference/api.md", content=api_page(LIBRARY)))
    return files


def api_page(library: Path) -> str:
    """The page as Markdown: a section a package, a list a module."""
    return HEAD + "\n".join(_package(folder, library) for folder in sorted(_packages(library)))


def _packages(library: Path) -> list[Path]:
    return [library, *(init.parent for init in library.rglob("*/__init__.py"))]


def _package(folder: Path, library: Path) -> str:
    name = ".".join([library.name, *folder.relative_to(library).parts])
    lines = [f"\n## `{name}`\n", _summary(ast.parse((folder / "__init__.py").read_text(encoding="utf-8"))), ""]
    for path in sorted(folder.glob("*.py")):
        if path.name != "__init__.py":
            lines += _module(path)
    return "\n".join(lines)


def _module(path: Path) -> list[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    lines = [f"- **`{path.stem}`** {_summary(tree)}"]
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            lines.append(f"    - `{node.name}` {_summary(node)}")
    return lines


def _summary(node: ast.Module | ast.ClassDef | ast.FunctionDef) -> str:
    """The docstring's first paragraph on one line; outside of code spans, Markdown's own characters are escaped."""
    paragraph = " ".join((ast.get_docstring(node) or "").split("\n\n")[0].split())
    parts = paragraph.split("`")
    return "`".join(part if number % 2 else re.sub(r"([<*_\[])", r"\\\1", part) for number, part in enumerate(parts))
