"""The arithmetic of the estimate that `make run` prints. No test asserts times of this machine."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.configs import ROOT, checked_config

from dav_gswt.cli import estimate
from dav_gswt.cli.estimate import COSTS, PER_JOB, describe_estimate, describe_work, estimate_seconds, format_duration
from dav_gswt.cli.machine_speed import MachineSpeed, share_cores
from dav_gswt.config.base import LARGEST_SIDE
from dav_gswt.images.image_files import write_png

SAME = MachineSpeed()
PRESETS = ("draft", "standard", "reference")


@pytest.fixture
def config(monkeypatch) -> dict:
    monkeypatch.chdir(ROOT)
    return checked_config()


def test_a_job_s_parts_take_as_much_longer_as_the_machine_is_slower(config):
    work = describe_work(config)
    cost = COSTS["fit_coarse"](work)
    assert estimate_seconds({"fit_coarse": 1}, work, SAME) == pytest.approx(PER_JOB + cost.general + cost.raster)
    three = estimate_seconds({"fit_coarse": 3}, work, MachineSpeed(5.0, 2.0))
    assert three == pytest.approx(3 * (2 * (PER_JOB + cost.general) + 5 * cost.raster))
    other = estimate_seconds({"split_views": 2}, work, SAME)  # a rule without costs of its own
    assert other == pytest.approx(2 * (PER_JOB + estimate.OTHER_RULE.general))


def test_every_rule_costs_what_was_fitted(config):
    """Golden values: of all rules once, for work of which nothing is 0."""
    work = replace(describe_work(config, "draft"), samples=40, features=5.0, scene_cost=1.5)
    costs = [cost(work) for cost in COSTS.values()]
    assert sum(cost.general for cost in costs) == pytest.approx(519.4057808)
    assert sum(cost.raster for cost in costs) == pytest.approx(33.1135370)


def test_no_more_photos_count_than_there_are(config, tmp_path):
    """`start: 1000` fits all photos of a folder; rounds take what is left."""
    for number in range(20):
        (tmp_path / f"{number}.jpg").touch()
    for name in ("LICENSE", ".hidden.jpg"):
        (tmp_path / name).touch()

    def describe(**keys):
        config["scenes"]["mine"] = config["scenes"]["copr_dunes"] | {"folder": str(tmp_path)} | keys
        return describe_work(config | {"scene": "mine", "k": 6, "rounds": 2})

    every, eight = describe(start=1000), describe(start=8)
    assert (every.total, every.start, every.tests, every.new) == (20, 18, 2, 0)
    assert (eight.start, eight.tests, eight.new) == (8, 2, 5) and eight.all_photos == 18
    assert every.all_steps == describe(start=18).all_steps


def test_photos_are_no_larger_than_they_are(config, tmp_path):
    write_png(tmp_path / "a.png", np.zeros((64, 40, 3)))
    config["scenes"]["mine"] = config["scenes"]["copr_dunes"] | {"folder": str(tmp_path), "size": LARGEST_SIDE}
    config["presets"]["native"] = config["presets"]["draft"] | {"size": LARGEST_SIDE}
    work = describe_work(config | {"scene": "mine"}, "native")
    assert work.photo_pixels == work.fit_pixels == 40 * 64
    (tmp_path / "a.png").write_text("no photo")  # the run itself tells of it
    found = estimate.measure_photos({"kind": "photos", "folder": str(tmp_path)})
    assert found == (LARGEST_SIDE, estimate.PHOTO_SHAPE)


def test_a_long_run_is_told_the_best_preset_that_is_short_enough(config):
    config["scenes"]["desert"] |= {"preset": "reference"}
    speed = MachineSpeed(7.0, 1.0)
    jobs = {name: estimate.count_jobs(config, name) for name in PRESETS}
    times = {name: estimate_seconds(jobs[name], describe_work(config, name), speed) for name in PRESETS}
    assert times["reference"] > estimate.LONG
    name = max((n for n in times if times[n] <= estimate.LONG and times[n] < 0.8 * times["reference"]), key=times.get)
    told = describe_estimate(config, jobs["reference"], speed, PRESETS)
    assert f"with preset: {name} {format_duration(times[name])}" in told


def test_work_is_that_of_the_config(config):
    work = describe_work(config)
    assert (work.total, work.tests, work.start, work.new, work.rounds) == (8, 6, 8, 4, 2)
    assert describe_work(config | {"policy": "w2-lpips"}).samples == 5 * 8
    assert work.photo_pixels == work.fit_pixels == 384**2 and work.gaussians == 140_000
    assert replace(work, gaussians=70_000.0).field_size == 0.5


def test_jobs_share_the_cores_with_others():
    found = [share_cores(*given) for given in ((2, 0.0, 2), (1, 5.0, 2), (2, 4.0, 16), (2, 0.0, 1))]
    assert found == [1, 3, 1, 1]


def test_photos_are_chosen_with_the_fits_of_another_preset(config):
    assert "register_photos" in estimate.count_jobs(config | {"scene": "copr_dunes"})
    jobs = estimate.count_jobs(config, "standard")
    assert jobs["update_field"] == jobs["copy_chosen_photos"] == config["rounds"] and jobs["fit_chosen_photos"] == 1
    assert jobs["render_photos"] == jobs["find_materials"] == 1
    assert not set(estimate.CHOSEN) & set(estimate.count_jobs(config, "draft"))
    work, draft = describe_work(config, "standard"), describe_work(config, "draft")
    for rule in estimate.CHOOSING:
        assert estimate_seconds({rule: 1}, work, SAME) == estimate_seconds({rule: 1}, draft, SAME)
    assert (work.all_photos, work.all_steps) == (16, 300 + 20 * 8)
    work = describe_work(config | {"rounds": 0}, "standard")  # nothing is chosen
    assert work.choosing is None and not set(estimate.CHOSEN) & set(estimate.replace_chosen({"fit_coarse": 1}, work))


def test_a_finished_field_is_not_fitted(config):
    config["scenes"]["given"] = {"kind": "field", "field": "a.ply", "up": [0, 0, 1], "preset": "standard"}
    jobs, work = estimate.count_jobs(config | {"scene": "given"}), describe_work(config | {"scene": "given"})
    assert jobs["prepare_external_field"] == 1 and "fit_coarse" not in jobs
    assert estimate_seconds(jobs, work, SAME) > 0
