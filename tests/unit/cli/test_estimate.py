"""The arithmetic of the estimate that `make run` prints. No test asserts times of this machine."""

import re
from dataclasses import replace

import numpy as np
import pytest
from fixtures.configs import ROOT, checked_config

from dav_gswt.cli import estimate
from dav_gswt.cli.estimate import COSTS, PER_JOB, describe_estimate, describe_work, estimate_seconds, format_duration
from dav_gswt.cli.machine_speed import MachineSpeed, measure_speed, share_cores
from dav_gswt.config.base import LARGEST_SIDE
from dav_gswt.images.image_files import write_png

SAME = MachineSpeed()
JOBS = {"render_photos": 1, "fit_coarse": 1, "update_field": 2, "score_coarse": 1, "score_round": 2, "capture_views": 2}
JOBS |= {"select_poses": 2, "make_levels": 1, "cut_tiles": 1, "bundle_tiles": 1, "render_terrain": 1}

PRESETS = ("draft", "standard", "reference")


@pytest.fixture
def config(monkeypatch) -> dict:
    monkeypatch.chdir(ROOT)
    return checked_config()


def test_a_job_s_parts_take_as_much_longer_as_the_machine_is_slower(config):
    work = describe_work(config)
    cost = COSTS["fit_coarse"](work)
    assert estimate_seconds({"fit_coarse": 1}, work, SAME) == pytest.approx(PER_JOB + cost.general + cost.raster)
    assert estimate_seconds({"fit_coarse": 3}, work, MachineSpeed(5.0, 2.0)) == pytest.approx(
        3 * (2 * (PER_JOB + cost.general) + 5 * cost.raster)
    )


def test_no_jobs_take_no_time_and_every_rule_has_a_cost(config):
    work = describe_work(config)
    assert estimate_seconds({}, work, SAME) == 0
    assert estimate_seconds({"split_views": 2}, work, SAME) == pytest.approx(
        2 * (PER_JOB + estimate.OTHER_RULE.general)
    )
    rules = "".join(path.read_text() for path in (ROOT / "rules").glob("*.smk"))
    assert all(re.search(rf"rule {rule}:| as {rule} with:", rules) for rule in COSTS)


@pytest.mark.parametrize("key", ["steps", "steps_per_photo", "max_gaussians", "size", "level_steps", "sh_degree"])
def test_more_work_takes_longer(config, key):
    draft = config["presets"]["draft"]
    more = {"size": 320, "sh_degree": 1}.get(key, draft[key] * 2)
    config["presets"] |= {"less": draft | {"size": 256}, "more": draft | {"size": 256} | {key: more}}
    less, more = (estimate_seconds(JOBS, describe_work(config, name), SAME) for name in ("less", "more"))
    assert more > less


def test_presets_are_ordered_by_their_time(config):
    draft, standard, reference = (
        estimate_seconds(estimate.count_jobs(config, name), describe_work(config, name), SAME)
        for name in ("draft", "standard", "reference")
    )
    assert draft < standard < reference


def test_no_more_photos_count_than_there_are(config, tmp_path):
    """`start: 1000` fits all photos of a folder; rounds take what is left."""
    for number in range(20):
        (tmp_path / f"{number}.jpg").touch()
    (tmp_path / "LICENSE").touch()

    def describe(**keys):
        config["scenes"]["mine"] = config["scenes"]["copr_dunes"] | {"folder": str(tmp_path)} | keys
        return describe_work(config | {"scene": "mine", "k": 6, "rounds": 2})

    every, eight = describe(start=1000), describe(start=8)
    assert (every.total, every.start, every.tests, every.new) == (20, 18, 2, 0)
    assert (eight.start, eight.tests, eight.new) == (8, 2, 5) and eight.all_photos == 18
    assert every.all_steps == describe(start=18).all_steps


def test_photos_of_a_folder_are_counted(config, tmp_path):
    for name in ("a.jpg", "b.jpg", ".hidden"):
        (tmp_path / name).touch()
    config["scenes"]["mine"] = config["scenes"]["copr_dunes"] | {"folder": str(tmp_path), "start": 2}
    work = describe_work(config | {"scene": "mine"})
    assert (work.total, work.start, work.tests, work.rendered) == (2, 2, 0, False)
    assert describe_work(config | {"scene": "mine", "policy": "w2-lpips"}).samples == 5 * 8


def test_photos_are_no_larger_than_they_are(config, tmp_path):
    write_png(tmp_path / "a.png", np.zeros((64, 40, 3)))
    config["scenes"]["mine"] = config["scenes"]["copr_dunes"] | {"folder": str(tmp_path), "size": LARGEST_SIDE}
    config["presets"]["native"] = config["presets"]["draft"] | {"size": LARGEST_SIDE}
    work = describe_work(config | {"scene": "mine"}, "native")
    assert work.photo_pixels == work.fit_pixels == 40 * 64


def test_a_photo_that_cannot_be_read_stops_no_estimate(config, tmp_path):
    (tmp_path / "a.jpg").touch()
    found = estimate.measure_photos({"kind": "photos", "folder": str(tmp_path)})
    assert found == (LARGEST_SIDE, estimate.PHOTO_SHAPE)


def test_a_finished_field_has_an_estimate_too(config):
    field = {"kind": "field", "field": "a.ply", "up": [0, 0, 1], "preset": "standard", "tiling": "auto"}
    config["scenes"]["given"] = field
    jobs = {"import_field": 1, "prepare_external_field": 1, "make_levels": 1, "cut_tiles": 1}
    assert estimate_seconds(jobs, describe_work(config | {"scene": "given"}), SAME) > 0


def test_a_short_run_is_told_no_preset(config):
    assert (
        describe_estimate(config, {"fit_coarse": 1}, SAME, PRESETS) == "It will take about 10 seconds on this machine"
    )


def test_a_long_run_is_told_the_best_preset_that_is_short_enough(config):
    config["scenes"]["desert"] |= {"preset": "reference"}
    speed = MachineSpeed(7.0, 1.0)
    jobs = {name: estimate.count_jobs(config, name) for name in PRESETS}
    times = {name: estimate_seconds(jobs[name], describe_work(config, name), speed) for name in PRESETS}
    assert times["reference"] > estimate.LONG
    name = max((n for n in times if times[n] <= estimate.LONG and times[n] < 0.8 * times["reference"]), key=times.get)
    told = describe_estimate(config, jobs["reference"], speed, PRESETS)
    assert f"with preset: {name} {format_duration(times[name])}" in told


def test_a_run_that_is_long_with_every_preset_is_told_the_fastest(config):
    config["scenes"]["desert"] |= {"preset": "reference"}
    assert "with preset: draft" in describe_estimate(
        config, estimate.count_jobs(config), MachineSpeed(500.0, 1.0), PRESETS
    )


def test_a_preset_of_the_study_is_no_advice(config):
    config["scenes"]["desert"] |= {"preset": "reference"}
    config["presets"]["tiny"] = config["presets"]["draft"] | {"size": 64, "steps": 1, "steps_per_photo": 1}
    assert "with preset: draft" in describe_estimate(
        config, estimate.count_jobs(config), MachineSpeed(500.0, 1.0), PRESETS
    )


def test_a_run_that_is_beyond_its_fits_is_told_no_preset(config):
    assert "preset" not in describe_estimate(config, {"make_levels": 1}, MachineSpeed(1e4, 1e4), PRESETS)


@pytest.mark.parametrize(
    "seconds, text",
    [
        (3, "10 seconds"),
        (44, "40 seconds"),
        (70, "a minute"),
        (170, "3 minutes"),
        (1300, "20 minutes"),
        (7000, "1.9 hours"),
    ],
)
def test_a_duration_has_no_more_digits_than_are_known(seconds, text):
    assert format_duration(float(seconds)) == f"about {text}"


def test_the_speed_of_this_machine_is_two_positive_numbers(monkeypatch):
    monkeypatch.setattr("dav_gswt.cli.machine_speed.DURATION", 0.0)
    speed = measure_speed(1)
    assert speed.raster > 0 and speed.general > 0


def test_work_is_that_of_the_config(config):
    work = describe_work(config)
    assert (work.total, work.tests, work.start, work.new, work.rounds) == (8, 6, 8, 4, 2)
    assert work.photo_pixels == work.fit_pixels == 384**2 and work.gaussians == 140_000
    assert replace(work, gaussians=70_000.0).field_size == 0.5


@pytest.mark.parametrize(
    "threads, others, cores, longer",
    [(2, 0, 2, 1), (2, 2, 2, 2), (1, 1, 2, 1), (1, 5, 2, 3), (2, 4, 16, 1), (2, 0, 1, 1)],
)
def test_jobs_share_the_cores_with_others(threads, others, cores, longer):
    assert share_cores(threads, float(others), cores) == longer


def test_jobs_are_those_of_a_whole_run(config):
    jobs = estimate.count_jobs(config)
    assert jobs["update_field"] == config["rounds"] and jobs["render_photos"] == jobs["find_materials"] == 1
    assert "register_photos" in estimate.count_jobs(config | {"scene": "copr_dunes"})


def test_photos_are_chosen_with_the_fits_of_another_preset(config):
    """Then only the fit to all photos is the preset's own."""
    jobs = estimate.count_jobs(config, "standard")
    assert jobs["update_field"] == jobs["copy_chosen_photos"] == config["rounds"] and jobs["fit_chosen_photos"] == 1
    assert not set(estimate.CHOSEN) & set(estimate.count_jobs(config, "draft"))
    work, draft = describe_work(config, "standard"), describe_work(config, "draft")
    for rule in estimate.CHOOSING:
        assert estimate_seconds({rule: 1}, work, SAME) == estimate_seconds({rule: 1}, draft, SAME)
    assert (work.all_photos, work.all_steps) == (16, 300 + 20 * 8)


def test_without_rounds_a_preset_s_own_fit_is_the_only_one(config):
    work = describe_work(config | {"rounds": 0}, "standard")
    assert work.choosing is None and not set(estimate.CHOSEN) & set(estimate.replace_chosen({"fit_coarse": 1}, work))


def test_a_finished_field_is_not_fitted(config):
    config["scenes"]["given"] = {"kind": "field", "field": "a.ply", "up": [0, 0, 1], "preset": "standard"}
    jobs = estimate.count_jobs(config | {"scene": "given"})
    assert jobs["prepare_external_field"] == 1 and "fit_coarse" not in jobs
