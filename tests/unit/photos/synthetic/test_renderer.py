"""Which of mitsuba's variants renders: libraries that crash, hang or lie are passed over."""

import pytest

from dav_gswt.errors import InputError
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


@pytest.mark.parametrize(
    "trial",
    [
        pytest.param("import os; os.abort()", id="crashes"),
        pytest.param("import time; time.sleep(9)", id="hangs"),
        pytest.param("print('mean 0.3')", id="a wrong picture"),
        pytest.param("print('mean 0.5'); raise SystemExit(1)", id="fails at its end"),
    ],
)
def test_a_library_that_spoils_its_trial_does_not_work(trial):
    assert not renderer.check_library("/libLLVM.so.99", trial, timeout=1.0)


def test_a_library_that_passes_its_trial_works_and_is_named_to_it():
    trial = f"import os; assert os.environ['{renderer.LIBRARY}'] == '/libLLVM.so.99'; print('mean 0.501')"
    assert renderer.check_library("/libLLVM.so.99", trial)
