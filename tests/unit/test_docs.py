"""What a stranger reads: no dead link, no missing file, a README that one can take in, a site that builds."""

import importlib.util
import os
import re
import subprocess
import sys

import pytest
import yaml
from fixtures import doc_pages

from dav_gswt.config import load

PAGES = [pytest.param(page, id=str(page.relative_to(doc_pages.ROOT))) for page in doc_pages.pages()]
MADE_BY_THE_SITE = {"reference/api.md"}


@pytest.mark.parametrize("page", PAGES)
def test_no_link_is_dead(page):
    dead = [target for target in doc_pages.links(page) if not (page.parent / target).exists()]
    assert dead == []


@pytest.mark.parametrize("page", PAGES)
def test_every_path_that_a_page_names_exists(page):
    if page.name == "CHANGELOG.md":
        pytest.skip("names what was renamed")
    missing = {path for path in doc_pages.named_paths(page) if not (doc_pages.ROOT / path).exists()}
    assert missing == set()


@pytest.mark.parametrize("page", PAGES)
def test_every_module_that_a_page_names_exists(page):
    assert {name for name in doc_pages.named_modules(page) if not doc_pages.is_in_library(name)} == set()


@pytest.mark.parametrize("page", PAGES)
def test_no_page_cites_what_a_reader_cannot_have(page):
    cited = re.findall(r"(?<![\w/])(?:\.\./)+shared/\S*", page.read_text(encoding="utf-8"))
    assert cited == []


def test_every_file_that_code_and_config_name_exists(root):
    """Pages, rules, scripts and configs that comments, docstrings and messages send readers to."""
    named = re.compile(r"(?<![\w/{.])(?:docs/[\w/-]+\.md|rules/[\w/]+\.smk|scripts/[\w/]+\.py|config/[\w/]+\.yaml)\b")
    files = [root / "Snakefile", root / "Makefile", root / "pyproject.toml"]
    for folder in ("rules", "scripts", "config", "benchmarks", "workflow"):
        files += [f for f in (root / folder).rglob("*") if f.suffix in (".py", ".smk", ".yaml", ".js", ".md", ".rst")]
    found = {(str(f.relative_to(root)), name) for f in files for name in named.findall(f.read_text(encoding="utf-8"))}
    assert {(file, name) for file, name in found if not (root / name).exists()} == set()


def test_the_architecture_page_names_every_rule_with_its_script(root):
    rows = re.findall(
        r"^\|[^|]*\| (`.+?) \| (`scripts/.+?) \|", (root / "docs/architecture.md").read_text("utf-8"), re.M
    )
    listed = {rule for names, _ in rows for rule in re.findall(r"`(\w+)`", names)}
    scripts = {script for _, names in rows for script in re.findall(r"`(scripts/\w+\.py)`", names)}
    rules = "".join(path.read_text("utf-8") for path in (root / "rules").glob("*.smk"))
    assert listed == set(re.findall(r"^(?:rule|use rule \w+ as) (\w+)", rules, re.M))
    assert scripts == {str(path.relative_to(root)) for path in (root / "scripts").glob("*.py")}


def test_the_page_of_the_terrain_api_names_all_of_it(root):
    types = (root / "workflow/viewer/terrain_api.d.ts").read_text("utf-8")
    bodies = re.findall(
        r"export interface (?:Terrain|Painter|LoadOptions|Update|Hit|Gaussians|Order) .*?\{(.*?)\n\}", types, re.S
    )
    members = set(re.findall(r"^  (\w+)[?:(]", "".join(bodies), re.M))
    members |= set(re.findall(r"^export (?:function|class) (\w+)", types, re.M))
    page = (root / "docs/terrain-api.md").read_text("utf-8")
    assert len(members) > 30 and not {name for name in members if not re.search(rf"\b{name}\b", page)}


def test_the_readme_is_short(root):
    assert len((root / "README.md").read_text(encoding="utf-8").splitlines()) <= 130


def test_every_make_target_that_a_page_names_is_in_the_makefile(root):
    known = set(re.findall(r"^([a-z]+):", (root / "Makefile").read_text(encoding="utf-8"), re.M))
    named = set().union(*(doc_pages.named_targets(page)["make"] for page in doc_pages.pages()))
    assert {"run", "view", "test", "docs"} <= named <= known


def test_targets_are_read_without_options_and_placeholders(tmp_path):
    (tmp_path / "a.md").write_text(
        "`make run SCENE=my_meadow`, `snakemake --cores 2 --config k=2 -- seams`, `snakemake results/x/<bundle>/a`\n"
        "```sh\n.venv/bin/snakemake --profile workflow/profiles/slurm study   # all of it\n```\n"
    )
    assert doc_pages.named_targets(tmp_path / "a.md") == {"make": {"run"}, "snakemake": {"seams", "study"}}


EXAMPLES = [
    pytest.param(block, id=f"{page.relative_to(doc_pages.ROOT)}:{number}")
    for page in doc_pages.pages()
    for number, block in enumerate(re.findall(r"```yaml\n(.*?)```", page.read_text(encoding="utf-8"), re.S))
]


@pytest.mark.parametrize("block", EXAMPLES)
def test_every_config_that_a_page_shows_is_valid(block, root, tmp_path):
    keys = yaml.safe_load(block)
    example = {"scenes": {"my_scene": keys}} if "kind" in keys else keys  # a file of config/scenes, or a config
    (tmp_path / "example.yaml").write_text(yaml.safe_dump(example))
    given = load.read_config([root / "config/config.yaml", tmp_path / "example.yaml"])
    scenes = load.check_config(load.add_scene_files(given, root / "config/scenes"))["scenes"]
    assert set(example.get("scenes", {})) <= set(scenes)


def test_every_page_of_the_site_is_in_its_navigation(root):
    listed = set(re.findall(r"[\w/-]+\.md", (root / "mkdocs.yml").read_text(encoding="utf-8").split("\nnav:")[1]))
    pages = {page.relative_to(root / "docs").as_posix() for page in (root / "docs").rglob("*.md")}
    assert listed - MADE_BY_THE_SITE == {page for page in pages if not page.startswith("research/data/")}


@pytest.fixture(scope="module")
def site(root, tmp_path_factory):
    """The site, built as `make docs` builds it."""
    if not importlib.util.find_spec("material"):
        pytest.skip("mkdocs-material is not installed: make docs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder]
    env = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=root, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_the_site_builds_without_a_warning(site):
    assert (site / "architecture.html").exists() and (site / "reference/api.html").exists()


def test_the_site_loads_nothing_from_a_network(site):
    source = re.compile(r"<(?:script|link|img)[^>]+(?:src|href)=\"?(https?:[^\" >]+)")
    assert {page: found for page in site.rglob("*.html") if (found := source.findall(page.read_text("utf-8")))} == {}
