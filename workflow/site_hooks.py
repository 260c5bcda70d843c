"""Hooks of mkdocs: pages that are not in the repository.

reference/api.md lists modules and their public names, from the source's docstrings. reference/config.md lists the
config's keys. In a clone, pages link to the config's schema instead; on the site these links lead to the page.
"""

import ast
import re
from pathlib import Path

from mkdocs.structure.files import File, Files
from reference import describe_config  # beside this file

LIBRARY = Path(__file__).parent / "lib/dav_gswt"
SCHEMA = re.compile(r"\]\(((?:\.\./)*)\.\./workflow/schemas/config\.schema\.json")
HEAD = """# Python API

The first line of every module's, class's and function's docstring. The source has the rest: formulas, shapes, units,
edge cases and errors. Import packages as `dav_gswt.<package>.<module>`.
"""


def on_files(files: Files, config) -> Files:
    """Add the pages to the site."""
    files.append(File.generated(config, "reference/api.md", content=api_page(LIBRARY)))
    files.append(File.generated(config, "reference/config.md", content=describe_config()))
    return files


def on_page_markdown(markdown: str, **_) -> str:
    """Turn links to the config's schema into links to the page of its keys."""
    return SCHEMA.sub(r"](\1reference/config.md", markdown)


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
