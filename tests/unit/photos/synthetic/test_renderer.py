"""Which of mitsuba's variants renders: libraries that crash, hang or lie are passed over."""

import logging
import os
import subprocess
import sys

import numpy as np
import pytest
from fixtures.frames import scene_frame

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import read_scene_frame, write_scene_frame
from dav_gswt.photos.synthetic import renderer
from dav_gswt.photos.synthetic.renderer import Variant

NEW, OLD = Variant("llvm_ad_rgb", "/somewhere/libLLVM.so.19.1", 19), Variant("llvm_ad_rgb", "/libLLVM-15.so.1", 15)


@pytest.fixture
def variant(monkeypatch):
    """Ask for a variant anew, with libraries of which only some work."""
    renderer.choose_variant.cache_clear()

    def ask(word, working=(), there=(NEW, OLD)):
        monkeypatch.setenv(renderer.VARIABLE, word)
        monkeypatch.setattr(renderer, "find_libraries", lambda: list(there))
        monkeypatch.setattr(renderer, "check_library", lambda library: library in {v.library for v in working})
        return renderer.choose_variant()

    yield ask
    renderer.choose_variant.cache_clear()


@pytest.mark.parametrize(
    "word, working, found",
    [
        pytest.param("", (NEW,), Variant("scalar_rgb"), id="not set"),
        pytest.param("scalar", (NEW,), Variant("scalar_rgb"), id="scalar"),
        pytest.param("llvm", (NEW, OLD), NEW, id="the newest"),
        pytest.param("llvm", (OLD,), OLD, id="the newest that works"),
        pytest.param("auto", (), Variant("scalar_rgb"), id="none works"),
        pytest.param("auto", (NEW,), NEW, id="auto"),
    ],
)
def test_the_environment_says_which_variant_renders(variant, word, working, found):
    assert variant(word, working) == found


@pytest.mark.parametrize("word, said", [("cuda", "choose from scalar, llvm, auto"), ("llvm", "libllvm19")])
def test_an_unavailable_variant_is_reported(variant, word, said):
    with pytest.raises(InputError, match=said):
        variant(word)


def test_the_choice_is_logged_once_and_kept(variant, caplog):
    with caplog.at_level(logging.INFO, "dav_gswt.photos.synthetic.renderer"):
        variant("auto", (NEW,))
        renderer.choose_variant()
    assert [r.message for r in caplog.records] == [
        "synthetic scenes are rendered by mitsuba's llvm_ad_rgb with LLVM 19"
    ]
    assert renderer.describe_renderer() | {"mitsuba": ""} == {"mitsuba": "", "variant": "llvm_ad_rgb", "llvm": "19"}


@pytest.mark.parametrize("word", ["scalar", "llvm"])
def test_a_frame_that_names_the_renderer_can_be_read_again(variant, word, tmp_path):
    variant(word, (NEW,))
    frame = scene_frame(kind="synthetic", renderer=renderer.describe_renderer())
    write_scene_frame(tmp_path / "ground.json", frame)
    assert read_scene_frame(tmp_path / "ground.json") == frame


@pytest.mark.parametrize(
    "name, number",
    [
        ("libLLVM-14.so.1", 14),
        ("libLLVM-15.so", 15),
        ("libLLVM-14.0.6.so", 14),
        ("libLLVM.so.19.1", 19),
        ("libLLVM.so", None),
        ("libLLVMX86CodeGen.a", None),
    ],
)
def test_a_library_tells_its_version_by_its_name(name, number):
    assert renderer.parse_version(name) == number


@pytest.mark.parametrize(
    "trial",
    [
        pytest.param("import os; os.abort()", id="crashes"),
        pytest.param("import time; time.sleep(60)", id="hangs"),
        pytest.param("print('mean 0.3')", id="a wrong picture"),
        pytest.param("print('mean nan')", id="no number"),
        pytest.param("pass", id="says nothing"),
        pytest.param("print('mean 0.5'); raise SystemExit(1)", id="fails at its end"),
    ],
)
def test_a_library_that_spoils_its_trial_does_not_work(trial):
    assert not renderer.check_library("/libLLVM.so.99", trial, timeout=2.0)


def test_a_library_that_passes_its_trial_works_and_is_named_to_it():
    trial = f"import os; assert os.environ['{renderer.LIBRARY}'] == '/libLLVM.so.99'; print('mean 0.501')"
    assert renderer.check_library("/libLLVM.so.99", trial)


def test_the_same_world_is_seen_in_a_compiled_variant(tmp_path):
    """In processes of their own, since a process keeps its variant."""
    pytest.importorskip("mitsuba")
    if not any(renderer.check_library(v.library) for v in renderer.find_libraries()):
        pytest.skip("no LLVM library that works on this machine: apt-get install libllvm19")
    script = """
import sys
import numpy as np
from dav_gswt.geometry import camera_layouts
from dav_gswt.photos.synthetic import desert, truth
from dav_gswt.photos.synthetic import scene as synthetic
desert.TEXELS = 256
scene = synthetic.make_scene("desert", 0, tufts=60, stones=40)
camera = camera_layouts.orbit(70, 0, 7.0, (0, 0, 0), 48, 48, 55.0)
depth, label = truth.render_truth(scene, camera)
np.savez(sys.argv[1], depth=depth, label=label, picture=synthetic.render(scene, camera, 100))
"""
    seen = {}
    for word in ("scalar", "llvm"):
        environment = os.environ | {renderer.VARIABLE: word}
        file = tmp_path / f"{word}.npz"
        subprocess.run([sys.executable, "-c", script, file], env=environment, check=True)
        seen[word] = np.load(file)
    one, other = seen["scalar"], seen["llvm"]
    assert set(np.unique(one["label"])) == {1.0, 2.0, 3.0}
    # plants are moved in double precision here, in single there: a ray may just miss what it just hit
    assert (one["label"] != other["label"]).mean() < 0.003
    same = one["label"] == other["label"]
    assert np.abs(one["depth"] - other["depth"])[same & (one["label"] == 1)].max() < 1e-4
    # 100 rays leave noise of about 0.02 in a pixel; the mean over 2304 pixels is 50 times quieter
    assert np.abs(one["picture"].mean((0, 1)) - other["picture"].mean((0, 1))).max() < 2e-3
    assert np.abs(one["picture"] - other["picture"]).mean() < 0.02
