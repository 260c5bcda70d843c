"""`dav-gswt advise`: the preset within the limits, what is printed, and what cannot be answered."""

import json
import shutil
from dataclasses import asdict

import numpy as np
import pytest
from fixtures.configs import ROOT

from dav_gswt import csv_tables
from dav_gswt.cli import advise, main
from dav_gswt.cli.advise import Choice, Limits, choose
from dav_gswt.cli.estimate import describe_work, estimate_seconds
from dav_gswt.cli.finished_run import find_finished_run
from dav_gswt.cli.forecast import FRONT, Forecast, Measured
from dav_gswt.cli.machine_speed import MachineSpeed
from dav_gswt.images.image_files import write_png

SCENE = "{kind: photos, folder: photos, size: 64, start: 2, agent: replay, preset: standard, tiling: auto}"
PRESETS = {"draft": (28.0, 0.2), "standard": (30.0, 0.1), "reference": (30.4, 0.08)}  # PSNR, LPIPS


def choice(preset, seconds, loss, mb=10.0, psnr=30.0):
    return Choice(Forecast(preset, psnr, loss, 0.0), float(seconds), mb)


CHOICES = [
    choice("draft", 60, 2.0, 5.0, 28.0),
    choice("standard", 200, 0.3, 50.0, 29.7),
    choice("auto", 400, 0.0, 90.0),
]


@pytest.mark.parametrize(
    "limits, preset",
    [
        pytest.param(Limits(), "auto", id="no limit: the best"),
        pytest.param(Limits(loss=0.5), "standard", id="the fastest within the loss"),
        pytest.param(Limits(seconds=250.0, mb=20.0), "draft", id="two limits"),
        pytest.param(Limits(seconds=30.0), "draft", id="none: the nearest"),
        pytest.param(Limits(loss=0.01, seconds=390.0), "auto", id="none: a little too slow beats far too bad"),
    ],
)
def test_the_choice_is_the_best_within_the_limits(limits, preset):
    assert choose(CHOICES, limits).preset == preset


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A checkout's config with one scene of four photos and a table of two scenes, on the reference machine."""
    shutil.copytree(ROOT / "config", tmp_path / "config")
    (tmp_path / "config/scenes/mine.yaml").write_text(SCENE)
    (tmp_path / "photos").mkdir()
    for name in "abcd":
        write_png(tmp_path / f"photos/{name}.png", np.random.default_rng(ord(name)).uniform(0, 1, (48, 64, 3)))
    rows = [
        asdict(Measured(scene, preset, 768, psnr - less, lpips, 0.0, 5e5, 80.0, 60.0, 60.0))
        for scene, less in (("sand", 0.0), ("rock", 4.0))
        for preset, (psnr, lpips) in PRESETS.items()
    ]
    csv_tables.write_table(tmp_path / FRONT, rows)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(advise, "measure_speed", lambda cores: MachineSpeed())
    return tmp_path


def run(*arguments):
    return main.main(["advise", "--scene", "mine", *arguments])


def test_presets_are_listed_and_one_is_advised(project, capsys):
    assert run("--loss", "1") == 0
    said = capsys.readouterr().out
    assert "Advice: `preset: standard` of the scene 'mine'" in said and "loses 0.4 dB to the best" in said
    assert [line.split()[0] for line in said.splitlines()[1:4]] == ["draft", "standard", "reference"]
    assert "from 2 scenes" in said and "0.0 dB in the mean, 0.0 at most, and seconds by 0%, 0% at most" in said


def test_what_has_no_answer_is_said(project, capsys):
    assert run("--seconds", "1") == 1
    assert "No preset is within these limits; nearest is `preset: draft`" in capsys.readouterr().out
    assert run("--psnr", "20") == 1
    assert "mine: no run of it is finished" in capsys.readouterr().err
    assert main.main(["advise", "--scene", "moon"]) == 1
    assert "there is no 'moon'" in capsys.readouterr().err


def test_a_finished_run_tells_the_level_and_how_slow_the_others_will_be(project, capsys):
    config = advise.load_config([], {"scene": "mine"})
    branch = "mine/seed0/draft/active_farthest_none_pdrop0_lam0_k4"
    (round_ := project / "results" / branch / "iter2").mkdir(parents=True)
    (round_ / "metrics.json").write_text(json.dumps({"psnr_colour_corrected": 20.0}))
    assert run("--psnr", "21") == 0
    said = capsys.readouterr().out
    assert "known: draft, 20.00 dB" in said and "22.0 dB" in said and "Advice: `preset: standard`" in said

    def seconds():
        known, front = find_finished_run(config, MachineSpeed()), advise.forecast.read_front()
        return [each.seconds for each in advise.list_choices(config, front, known, MachineSpeed())]

    before = seconds()
    (timed := project / "results/benchmarks" / branch / "iter2/levels").mkdir(parents=True)
    work, speed = describe_work(config, "draft"), MachineSpeed()
    taken = 3 * estimate_seconds({"make_levels": 1}, work, speed)
    (timed / "make_levels.tsv").write_text(f"s\tmax_rss\n{taken}\t800\n")
    (timed / "evaluate_at_64.tsv").write_text("s\n1000\n")  # no job of a run
    (timed / "cut_tiles.tsv").write_text("")  # broken off
    assert seconds() == pytest.approx([3 * each for each in before])
