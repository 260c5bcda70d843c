"""What the documentation names exists: links, files, modules, commands; and its examples of configs are valid."""

import re

import pytest
import yaml
from fixtures import doc_pages

from dav_gswt.config import load

PAGES = {str(page.relative_to(doc_pages.ROOT)): page for page in doc_pages.pages()}
EXAMPLES = [
    pytest.param(block, id=f"{name}:{number}")
    for name, page in PAGES.items()
    for number, block in enumerate(re.findall(r"```yaml\n(.*?)```", page.read_text(encoding="utf-8"), re.S))
]


def test_no_link_is_dead():
    dead = [(name, link) for name, page in PAGES.items() for link in doc_pages.links(page)
            if not (page.parent / link).exists()]  # fmt: skip
    assert dead == []


def test_every_path_and_module_that_a_page_names_exists():
    current = {name: page for name, page in PAGES.items() if name != "CHANGELOG.md"}  # which names what was renamed
    paths = {(name, path) for name, page in current.items() for path in doc_pages.named_paths(page)}
    assert {(name, path) for name, path in paths if not (doc_pages.ROOT / path).exists()} == set()
    modules = {(name, module) for name, page in PAGES.items() for module in doc_pages.named_modules(page)}
    assert {(name, module) for name, module in modules if not doc_pages.is_in_library(module)} == set()


def test_every_file_that_code_and_config_name_exists(root):
    """Pages, rules, scripts and configs that comments, docstrings and messages send readers to."""
    named = re.compile(r"(?<![\w/{.])(?:docs/[\w/-]+\.md|rules/[\w/]+\.smk|scripts/[\w/]+\.py|config/[\w/]+\.yaml)\b")
    files = [root / "Snakefile", root / "Makefile", root / "pyproject.toml"]
    for folder in ("rules", "scripts", "config", "benchmarks", "workflow"):
        files += [f for f in (root / folder).rglob("*") if f.suffix in (".py", ".smk", ".yaml", ".js", ".md", ".rst")]
    found = {(str(f.relative_to(root)), name) for f in files for name in named.findall(f.read_text(encoding="utf-8"))}
    assert {(file, name) for file, name in found if not (root / name).exists()} == set()


def test_the_page_of_the_terrain_api_names_all_of_it(root):
    types = (root / "workflow/viewer/terrain_api.d.ts").read_text("utf-8")
    interfaces = r"export interface (?:Terrain|Painter|LoadOptions|Update|Hit|Gaussians|Order) .*?\{(.*?)\n\}"
    members = set(re.findall(r"^  (\w+)[?:(]", "".join(re.findall(interfaces, types, re.S)), re.M))
    members |= set(re.findall(r"^export (?:function|class) (\w+)", types, re.M))
    page = (root / "docs/terrain-api.md").read_text("utf-8")
    assert len(members) > 30 and not {name for name in members if not re.search(rf"\b{name}\b", page)}


def test_every_make_target_that_a_page_names_is_in_the_makefile(root):
    known = set(re.findall(r"^([a-z-]+):", (root / "Makefile").read_text(encoding="utf-8"), re.M))
    named = set().union(*(doc_pages.named_targets(page)["make"] for page in PAGES.values()))
    assert {"run", "view", "test", "docs"} <= named <= known


@pytest.mark.parametrize("block", EXAMPLES)
def test_every_config_that_a_page_shows_is_valid(block, root, tmp_path):
    keys = yaml.safe_load(block)
    example = {"scenes": {"my_scene": keys}} if "kind" in keys else keys  # a file of config/scenes, or a config
    (tmp_path / "example.yaml").write_text(yaml.safe_dump(example))
    given = load.read_config([root / "config/config.yaml", tmp_path / "example.yaml"])
    scenes = load.check_config(load.add_scene_files(given, root / "config/scenes"))["scenes"]
    assert set(example.get("scenes", {})) <= set(scenes)
