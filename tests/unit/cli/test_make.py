"""`dav-gswt make`: the folder of a terrain, its scene.yaml, what is linked into it and what is said of it."""

import argparse
import json
from dataclasses import replace

import pytest
import yaml
from fixtures.frames import scene_frame

import dav_gswt
from dav_gswt.cli import judgement, main, make
from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import LeftOutPhoto, SfmSign, SfmVerdict, SourceFrame, write_scene_frame

JPEG = b"\xff\xd8\xff\xe0" + b"0" * 40


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder `pit` of three photos in the working directory."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pit").mkdir()
    for number in range(3):
        (tmp_path / f"pit/{number}.jpg").write_bytes(JPEG + bytes([number]))
    return tmp_path


def prepare(*arguments: str):
    parser = argparse.ArgumentParser()
    make.add_command(parser.add_subparsers())
    return make.prepare_scene(parser.parse_args(["make", *arguments]))


def scene_of(folder):
    return yaml.safe_load((folder / "pit-terrain/scene.yaml").read_text())


def test_a_folder_becomes_a_scene_that_uses_all_photos(folder, capsys):
    out, settings = prepare("pit", "--preset", "draft")
    assert str(out) == "pit-terrain" and "pit: 3 photos" in capsys.readouterr().out
    assert scene_of(folder) == {
        "scene": "pit",
        "scenes": {"pit": {"kind": "photos", "folder": str(folder / "pit"), "preset": "draft"}},
    }
    scene = settings["scenes"]["pit"]
    assert scene["preset"] == "draft" and scene["agent"] == "replay" and "start" not in scene


def test_what_was_edited_stays_and_options_change_it(folder):
    prepare("pit")
    path = folder / "pit-terrain/scene.yaml"
    path.write_text(path.read_text().replace("kind: photos", "kind: photos\n    focal: 28.0"))
    path.write_text(path.read_text() + "# mine\n")
    prepare("pit")
    assert path.read_text().startswith("# A terrain of 3 photos") and path.read_text().endswith("# mine\n")
    assert scene_of(folder)["scenes"]["pit"]["focal"] == 28.0
    prepare("pit-terrain", "--preset", "reference")
    assert scene_of(folder)["scenes"]["pit"] | {"folder": ""} == {
        "kind": "photos", "folder": "", "focal": 28.0, "preset": "reference",
    }  # fmt: skip
    assert path.read_text().startswith("# A terrain of 3 photos")
    prepare("pit-terrain/scene.yaml", "--capture", "drone")
    assert scene_of(folder)["scenes"]["pit"]["agent"] == "plan"


def test_folders_in_the_way_and_other_inputs_are_refused(folder):
    (folder / "full").mkdir()
    (folder / "full/letter.txt").write_text("dear")
    with pytest.raises(InputError, match="full: is in the way and no terrain"):
        prepare("pit", "-o", "full")
    prepare("pit")
    (folder / "pit").rename(folder / "moved")
    with pytest.raises(InputError, match="has the terrain of another input"):
        prepare("moved", "-o", "pit-terrain")
    with pytest.raises(InputError, match="config files go to Snakemake"):
        (folder / "my.yaml").write_text("scene: x")
        prepare("my.yaml")
    assert (folder / "full/letter.txt").read_text() == "dear"


def test_a_wrong_option_is_not_kept(folder):
    wrong = {"--preset": ("fast", "no 'fast'; presets has draft"), "--focal": ("-3", "focal")}
    wrong |= {key: ("nowhere", f"{key} nowhere: there is no such") for key in ("--model", "--masks")}
    for option, (value, said) in wrong.items():
        with pytest.raises(InputError, match=said):
            prepare("pit", option, value)
        assert not (folder / "pit-terrain").exists()
    prepare("pit")
    with pytest.raises(InputError, match="no 'fast'"):
        prepare("pit", "--preset", "fast")
    assert "preset" not in scene_of(folder)["scenes"]["pit"]


@pytest.mark.parametrize(
    "photos, split", [(16, (8, 2, 4)), (20, (8, 3, 4)), (19, (10, 3, 3)), (8, (8, 0, 1)), (5, (5, 0, 1))]
)
def test_a_budget_is_used_up_in_rounds_of_about_four(photos, split):
    start, rounds, per_round = make.split_budget(photos)
    assert (start, rounds, per_round) == split and start + rounds * per_round == photos


def test_results_are_linked_whole_and_replace_earlier_ones(tmp_path):
    source, target = tmp_path / "source", tmp_path / "target"
    for place, name in ((source, "a/b.txt"), (source, "c.txt"), (target, "old.txt")):
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(name)
    make.link_folder(source, target)
    assert sorted(str(p.relative_to(target)) for p in target.rglob("*") if p.is_file()) == ["a/b.txt", "c.txt"]
    assert (target / "c.txt").samefile(source / "c.txt")


def test_view_finds_a_terrain_by_its_input_and_the_newest_one(folder):
    with pytest.raises(InputError, match="there is no terrain here"):
        main.find_page(None)
    for name in ("old-terrain", "pit-terrain"):
        (folder / name / "page").mkdir(parents=True)
        (folder / name / "page/index.html").write_text(name)
    for given in ("pit", "pit-terrain", "pit-terrain/page"):
        assert main.find_page(type(folder)(given)).resolve() == folder / "pit-terrain/page"
    assert main.find_page(None).resolve() == folder / "pit-terrain/page"


def test_the_judgement_says_what_was_found_how_good_it_is_and_what_would_help(tmp_path):
    verdict = SfmVerdict("doubtful", (SfmSign("tilt", "doubtful", "photos look aside"),))
    about = {"images": 5, "registered": 4, "left_out": (LeftOutPhoto("a.jpg", "blurred"),), "verdict": verdict}
    weak = {"grade": "marginal", "reason": "material0 has little: photograph 2.0 times as much of it"}
    materials = {"excluded": 0.07, "objects": [{}], "materials": [{"share": 0.4, "verdict": weak}]}
    materials["materials"].append({"share": 0.6, "verdict": {"grade": "good", "reason": ""}})
    materials["left_out"] = [{"reason": "cut off", "share": 0.02}]
    metrics = {"psnr_colour_corrected": 20.0, "windows": {"psnr_colour_corrected": 26.0, "test_views": [{}, {}]}}
    paths = [tmp_path / name for name in ("ground.json", "materials.json", "metrics.json")]
    write_scene_frame(paths[0], scene_frame(kind="photos", **about))
    for path, value in zip(paths[1:], (materials, metrics), strict=True):
        path.write_text(json.dumps(value))
    said = judgement.judge_terrain(*paths)
    assert said == [
        "Found 2 kinds of ground (60%, 40%). 7% of it is not in the terrain (dark in materials.png).",
        "Left out: 1 thing cut off at a border (2%).",
        "1 thing on it is scattered over the terrain (to leave it out: `materials: {exclude: MASK.png}` in scene.yaml, "
        "see docs/photos.md).",
        "4 of 5 photos are used; not a.jpg.",
        "Compared with 2 test photos, the terrain is good (26.0 dB PSNR; good from 25, very good from 30).",
        "The camera poses are doubtful, since photos look aside.",
        "The kind that covers 40% was photographed on a small area: photograph 2.0 times as much of it.",
    ]
    (tmp_path / "report.html").write_text("<body><p>photos</p></body>\n")
    make.add_to_report(tmp_path / "report.html", ["One & all."], tmp_path / "made.html")
    assert "<li>One &amp; all.</li>\n</ul>\n</body>\n" in (tmp_path / "made.html").read_text()
    paths[2].write_text('{"psnr": null, "test_views": []}')
    assert "was not measured (--test 2" in judgement.judge_terrain(paths[0], None, paths[2])[1]


@pytest.mark.parametrize(
    "scores, photos, doubts, cause, advice",
    [
        ([17, 16], 24, "camera poses are doubtful, since x", "camera poses are doubtful, since x.", "sharply"),
        ([17, 17, 9], 24, "", "other things or light in 2.", "things moved"),
        ([17, 17, 15], 8, "", "only 8 photos.", "Take 20"),
        ([17, 17, 15], 24, "", "unknown, often blur or things that moved.", "sharply"),
    ],
)
def test_a_poor_score_has_its_likely_cause_and_what_to_do(scores, photos, doubts, cause, advice):
    views = [{"view": f"{number}.png", "psnr_colour_corrected": score} for number, score in enumerate(scores)]
    said = " ".join(judgement.explain_poor_quality({"test_views": views, "photos": photos}, doubts))
    assert cause in said and advice in said


def test_python_makes_a_terrain_as_the_command_does(folder, monkeypatch):
    asked = []
    monkeypatch.setattr(make, "run_scene", lambda out, settings, cores: asked.append((out, settings)) or 0)
    made = make.Made(*(folder / name for name in ("page", "terrain.png", "field.ply", "report.html", "scene.yaml")))
    monkeypatch.setattr(make, "collect_results", lambda out, settings: made)
    assert dav_gswt.make("pit", preset="draft", test=1) is made
    (out, settings), *_ = asked
    assert str(out) == "pit-terrain" and settings["scenes"]["pit"]["test"] == 1
    with pytest.raises(InputError, match="speed: no option"):
        dav_gswt.make("pit", speed=3)
    monkeypatch.setattr(make, "run_scene", lambda *_: 1)
    with pytest.raises(InputError, match="no terrain was made"):
        dav_gswt.make("pit")


def test_the_judgement_says_from_how_high_the_ground_looks_sharp():
    manifest, windows = {"eye_floor": 1.96}, {"cell": 0.021, "pixel": 0.014}
    frame = scene_frame(unit="metre")
    (said,) = judgement.describe_sharpness(frame, windows, manifest)
    assert said == (
        "The ground looks sharp from 2 m above it: its cells (2.1 cm) are 1.5 times as wide as pixels of the photos."
    )
    (said,) = judgement.describe_sharpness(replace(frame, unit="flying height"), None, manifest)
    assert said == "The ground looks sharp from 2 camera heights above it."
    splat = replace(
        frame,
        unit="flying height",
        source=SourceFrame((0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), 6.5),
    )
    (said,) = judgement.describe_sharpness(splat, None, manifest)
    assert said == "The ground looks sharp from 13 units of the splat above it."
    assert not judgement.describe_sharpness(frame, windows, None)
