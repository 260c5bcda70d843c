"""The perceptual study as a user runs it: what is planned, a kit of the smallest run, scripted answers to it."""

import csv
import json
import shutil

from fixtures import answer_files
from fixtures.runs import TINY, USUAL

from dav_gswt.files import read_json


def test_scenes_share_their_levels_and_a_seam_that_is_in_two_pairs_is_cut_once(planned, tmp_path):
    study = "{scenes: [desert, grass], pairs: [[semantic, colour], [semantic, semantic-nogamma], [semantic, floor]]}"
    (tmp_path / "few.yaml").write_text(f"study: {{forced_choice: {study}}}")
    plan = planned(tmp_path, "perceptual_kit", configs=(USUAL, tmp_path / "few.yaml"))
    wanted = dict(render_pairs=2, make_levels=2, cut_tiles=6, make_kit=1, evaluate_answers=0)
    assert {rule: plan[rule] for rule in wanted} == wanted
    assert planned(tmp_path, "perceptual_results", configs=(USUAL, tmp_path / "few.yaml"))["evaluate_answers"] == 1
    everything = planned(tmp_path)
    assert not everything["render_pairs"] and not everything["make_kit"]


def test_tiles_of_other_sizes_cannot_be_compared(snakemake, tmp_path):
    (tmp_path / "few.yaml").write_text("study: {forced_choice: {pairs: [[semantic, small]]}}")
    done = snakemake(tmp_path, "perceptual_kit", "--dry-run", configs=(USUAL, tmp_path / "few.yaml"), check=False)
    assert done.returncode and "study.forced_choice.pairs: tilings of other `tile`" in done.stdout


def test_a_kit_is_made_answered_and_analysed(snakemake, tiny, tmp_path):
    folder = shutil.copytree(tiny.folder, tmp_path / "run", symlinks=True)
    snakemake(folder, "--cores", "2", "perceptual_kit", configs=(USUAL, TINY))
    home = folder / "results/forced_choice/kit"
    key = read_json(home / "key.json")
    assert (home / "page/index.html").is_file() and len(key["items"]) == 3  # two crops, and a check
    assert len(list((home / "page/pictures").iterdir())) == 6

    (folder / "answers").mkdir()
    for number in range(4):
        told = answer_files.answers(key, number, lambda item, number=number: item["check"] or number == 0)
        (folder / f"answers/2afc_{told['participant']}.json").write_text(json.dumps(told))
    snakemake(folder, "--cores", "1", "perceptual_results", configs=(USUAL, TINY))
    with (folder / "results/tables/forced_choice.csv").open(newline="") as file:
        every, desert = csv.DictReader(file)
    assert (every["scene"], every["observer"], every["participants"], every["share"]) == (
        "every",
        "participants",
        "4",
        "0.25",
    )
    assert float(every["low"]) < float(every["binomial_low"]) and desert["share"] == "0.25"
    assert read_json(folder / "results/forced_choice/participants.json")["participants"] == 4

    (folder / "answers/zzz.json").write_text('{"format": "davgswt-2afc"}')
    done = snakemake(folder, "--cores", "1", "perceptual_results", configs=(USUAL, TINY), check=False)
    assert done.returncode and "answers/zzz.json: " in done.stdout and "remove it" in done.stdout
