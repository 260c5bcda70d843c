"""What `make run` lays over the config where PyTorch has to draw."""

import re

import pytest

from dav_gswt.cli import run
from dav_gswt.config.load import read_config
from dav_gswt.errors import InputError
from dav_gswt.raster import backends


@pytest.fixture
def without_core(monkeypatch):
    real = backends.explain_unavailable
    monkeypatch.delenv(backends.VARIABLE, raising=False)
    monkeypatch.setattr(
        backends, "explain_unavailable", lambda name: real(name) if name == "torch" else "it was not built"
    )


def test_where_the_core_is_missing_a_smaller_size_is_printed_and_used(without_core, capsys):
    assert run.select_overlays(quietly=False) == [run.SMALLER]
    assert "slower" in (said := capsys.readouterr().out) and "it was not built" in said
    assert run.select_overlays(quietly=True) == [run.SMALLER] and not capsys.readouterr().out


def test_torch_by_choice_is_given_as_the_reason(monkeypatch, capsys):
    if backends.explain_unavailable("cpu"):
        pytest.skip(f"cpu: {backends.explain_unavailable('cpu')}")
    monkeypatch.setenv(backends.VARIABLE, "torch")
    assert run.select_overlays(quietly=False) == [run.SMALLER]
    assert "DAV_GSWT_BACKEND asks for it" in capsys.readouterr().out
    monkeypatch.setenv(backends.VARIABLE, "cpu")
    assert run.select_overlays(quietly=False) == []


def test_the_smaller_config_is_valid_and_smaller_for_every_preset(root, monkeypatch):
    monkeypatch.chdir(root)
    usual, small = run.load_config([]), run.load_config([run.SMALLER])
    for name, preset in read_config([run.CONFIG])["presets"].items():
        for key in ("size", "max_gaussians", "steps", "steps_per_photo", "level_steps"):
            if preset[key] != "auto":
                assert small["presets"][name][key] < preset[key], (name, key)
            assert isinstance(small["presets"][name][key], int)
    assert small["scenes"] == usual["scenes"] and small["scene"] == usual["scene"]


def test_an_entry_with_a_name_of_the_study_is_refused(root, tmp_path, monkeypatch):
    """The study's would go before it, and nothing would say so."""
    (tmp_path / "config").symlink_to(root / "config")
    monkeypatch.chdir(tmp_path)
    text = re.sub(r"(?m)^(tilings:.*)$", r"\1\n  semantic: {tile: 0.3}", (root / "config/config.yaml").read_text())
    (tmp_path / "own.yaml").write_text(text)
    monkeypatch.setattr(run, "CONFIG", tmp_path / "own.yaml")
    with pytest.raises(InputError, match=r"own\.yaml: tilings\.semantic: config/study\.yaml has an entry of this name"):
        run.load_config([])


def test_presets_for_terrains_are_those_of_the_config_alone(root, monkeypatch):
    monkeypatch.chdir(root)
    assert run.list_presets([]) == ["draft", "standard", "reference"]
    assert "compared" in run.load_config([])["presets"]
