"""The examples of docs/architecture.md and of a tutorial: an extension is one function or class, and works as shown."""

import importlib
import re

import numpy as np
import pytest

from dav_gswt.capture.agents import AGENTS
from dav_gswt.export.formats import FORMATS
from dav_gswt.geometry.poses import Pose
from dav_gswt.terrain.heights import SURFACES, surface_from_config
from dav_gswt.views.policies import POLICIES, SelectionInput
from dav_gswt.views.scores import Scores
from dav_gswt.views.terms import TERMS
from dav_gswt.views.uncertainty import Scales

MOST_LINES = 20  # of an example


@pytest.fixture
def extension(root):
    """Run the example below a heading, in the module that the text before it names; what it registers goes again."""
    registries = (POLICIES, TERMS, AGENTS, FORMATS, SURFACES)
    before = [dict(each) for each in registries]

    def run(heading: str, page: str = "docs/architecture.md") -> dict:
        section = re.search(rf"^##+ {heading}\n(.*?)(?=^##)", (root / page).read_text(), re.M | re.S)
        text, block = re.search(r"(.*?)```python[^\n]*\n(.*?)```", section[1], re.S).groups()
        assert len(block.splitlines()) <= MOST_LINES
        module = re.search(r"`workflow/lib/(dav_gswt/\w+/\w+)\.py`", text)[1].replace("/", ".")
        names = dict(vars(importlib.import_module(module)))
        exec(block, names)
        return names

    yield run
    for registry, content in zip(registries, before, strict=True):
        registry.clear()
        registry.update(content)


def test_a_policy(extension):
    extension("1. Write the function", "docs/tutorials/policy.md")
    poses = [Pose(f"p{k}", 30.0, float(azimuth), 1.0) for k, azimuth in enumerate((50, 150, 240, 60))]
    scores = Scores(poses, {"opacity": np.zeros(4)}, Scales({}))
    inputs = SelectionInput(np.zeros((0, 3)), 3, np.random.default_rng(0))
    assert sorted(POLICIES["around"].choose(scores, inputs)) in ([0, 1, 2], [1, 2, 3])


def test_a_score_term(extension):
    extension("A score term")
    given = type("Given", (), {"masks": [np.ones((2, 2), np.float32), np.array([[1, 0], [0, 0]], np.float32)]})()
    assert TERMS["shade"].compute(given).tolist() == [0.0, 0.75]


def test_an_agent(extension):
    extension("An agent")
    assert AGENTS["robot"].device and AGENTS["robot"].kinds == ("photos",)


def test_an_exporter(extension, tmp_path):
    extension("An exporter")
    means = np.arange(6, dtype=np.float32).reshape(2, 3)
    job = type("Job", (), {"spool": type("Spool", (), {"read": lambda self, column: iter([means])})()})()
    FORMATS["xyz"].write(job, str(tmp_path / "terrain"))
    assert (tmp_path / "terrain.xyz").read_text() == "0.00000 1.00000 2.00000\n3.00000 4.00000 5.00000\n"


def test_a_surface(extension):
    extension("A surface")
    waves = surface_from_config({"kind": "waves", "height": 0.5, "wavelength": 4.0}, 2.0, 1.0)
    y = np.linspace(-9, 9, 50)
    height, slope = waves.at(0 * y, y)
    ahead, _ = waves.at(0 * y, y + 1e-6)
    np.testing.assert_allclose((ahead - height) / 1e-6, slope[:, 1], atol=1e-4)
    assert waves.bounds[0] <= height.min() and height.max() <= waves.bounds[1] and slope.max() <= waves.bounds[2]
    assert waves.describe()[0] == {"kind": "waves", "height": 1.0, "wavelength": 8.0}
