"""What counts as a change of the code that a script runs."""

import ast
import shutil
from pathlib import Path

import pytest

from dav_gswt import code_digest
from dav_gswt.code_digest import LIBRARY, digest_code, remove_prose

DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def dump_without_docstrings(source: str) -> str:
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            node.body.pop(0)
    return ast.dump(tree)


def test_nothing_but_prose_is_removed():
    """Of every tenth file of the library, and of the one whose regular expressions are full of quotes."""
    for file in [*sorted(LIBRARY.rglob("*.py"))[::10], LIBRARY / "code_digest.py"]:
        source = file.read_text(encoding="utf-8")
        kept = remove_prose(source)
        assert dump_without_docstrings(kept) == dump_without_docstrings(source), file
        assert not [n for n in ast.walk(ast.parse(kept)) if isinstance(n, DOCUMENTED) and ast.get_docstring(n)], file


@pytest.mark.parametrize(
    "one, other, same",
    [
        pytest.param('"""a"""\nx = 1\n', '"""b\n\nc"""\n\nx = 1  # d\n', True, id="a docstring and a comment"),
        pytest.param('x = "#a"\n', 'x = "#b"\n', False, id="a string with the sign of a comment"),
        pytest.param('x = "\\""  # a\n', 'x = "\\""  # b\n', True, id="a comment after an escaped quote"),
        pytest.param("x = '''a\n\nb'''\n", "x = '''a\nb'''\n", False, id="blank lines in a string"),
        pytest.param("if a:\n    b()\n", "if a:\n  pass\nb()\n", False, id="indentation"),
    ],
)
def test_what_a_program_does_counts_and_what_it_says_does_not(one, other, same):
    assert (remove_prose(one) == remove_prose(other)) == same


@pytest.fixture
def library(tmp_path, monkeypatch) -> Path:
    """A library of two modules, of which a script imports one, which imports the other."""
    package = tmp_path / "dav_gswt"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "near.py").write_text("from dav_gswt.far import f\n")
    (package / "far.py").write_text('def f():\n    """Before."""\n    return 1\n')
    (package / "script.py").write_text("from dav_gswt.near import f\n")
    monkeypatch.setattr(code_digest, "LIBRARY", package)
    return package


def digest_afresh(script: Path) -> str:
    for cached in (digest_code, code_digest._imported_modules, code_digest._read_code, code_digest._file_of):
        cached.cache_clear()
    return digest_code(script)


def test_a_change_of_what_an_import_imports_counts(library):
    before = digest_afresh(library / "script.py")
    (library / "far.py").write_text('def f():\n    """After."""\n    return 1  # one\n')
    assert digest_afresh(library / "script.py") == before
    (library / "far.py").write_text("def f():\n    return 2\n")
    assert digest_afresh(library / "script.py") != before


@pytest.fixture(autouse=True)
def forget():
    """Digests of made-up libraries are no other test's."""
    yield
    digest_afresh(Path(__file__))


@pytest.mark.parametrize(("script", "same"), [("render_photos", True), ("fit_coarse", True), ("select_poses", False)])
def test_a_new_policy_makes_no_photos_and_fits_again(script, same, root, tmp_path):
    library = shutil.copytree(LIBRARY, tmp_path / "dav_gswt", ignore=shutil.ignore_patterns("__pycache__"))
    file = root / f"scripts/{script}.py"
    before = digest_code(file, library)
    with (library / "views/policies.py").open("a") as policies:
        policies.write("def another():\n    return 1\n")
    for cached in (digest_code, code_digest._read_code):
        cached.cache_clear()
    assert (digest_code(file, library) == before) == same
