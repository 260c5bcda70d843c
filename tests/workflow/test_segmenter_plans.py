"""Where segmenters come from, that of objects and that of cuts, and when they are asked for."""

from importlib.util import find_spec

import pytest
from fixtures.runs import USUAL

MATERIALS = "results/desert/seed0/draft/active_farthest_none_pdrop0_lam0_k4/iter1/materials"
with_runtime = pytest.mark.skipif(not find_spec("onnxruntime"), reason="needs the extra `mobilesam`")


def test_without_a_segmenter_no_network_is_fetched(planned, tmp_path):
    plan = planned(tmp_path, MATERIALS)
    assert plan["find_materials"] == 1 and not plan["fetch_mobilesam"]


@with_runtime
def test_a_segmenter_that_is_fetched_comes_before_the_materials(planned, tmp_path):
    plan = planned(tmp_path, MATERIALS, "--config", "segmenter=fetch")
    assert plan["find_materials"] == plan["fetch_mobilesam"] == 1
    assert planned(tmp_path, "--config", "segmenter=fetch")["fetch_mobilesam"] == 1
    (tmp_path / "one.yaml").write_text("scenes: {desert: {materials: one}}")
    one = planned(tmp_path, "--config", "segmenter=fetch", configs=(USUAL, tmp_path / "one.yaml"))
    assert one["cut_tiles"] == 1 and not one["fetch_mobilesam"]


@with_runtime
def test_a_segmenter_in_a_folder_is_an_input_of_the_materials(snakemake, tmp_path):
    folder = tmp_path / "sam"

    def plan():
        given = ("--config", f"segmenter={folder}")
        return snakemake(tmp_path, MATERIALS, *given, "--dry-run", check=False).stdout

    assert f"config: segmenter: there is no {folder}" in plan()
    folder.mkdir()
    (folder / "encoder.onnx").touch()
    assert f"config: segmenter: there is no {folder}/decoder.onnx" in plan()
    (folder / "decoder.onnx").touch()
    assert f"{folder}/encoder.onnx, {folder}/decoder.onnx" in plan() and "fetch_mobilesam" not in plan()


@pytest.mark.skipif(bool(find_spec("onnxruntime")), reason="onnxruntime is installed")
def test_a_segmenter_without_its_runtime_is_refused_before_the_first_job(snakemake, tmp_path):
    done = snakemake(tmp_path, MATERIALS, "--dry-run", "--config", "segmenter=fetch", check=False)
    assert done.returncode and "needs onnxruntime: pip install 'onnxruntime>=1.23,<2'" in done.stdout


def test_a_segmenter_is_an_input_of_the_cut(snakemake, tmp_path):
    target = MATERIALS.replace("materials", "tiles_none/seams.json")
    folder, config = tmp_path / "sam2", tmp_path / "sam2.yaml"
    config.write_text(f"tilings: {{none: {{sam2: {folder}}}}}")
    folder.mkdir()

    def plan():
        return snakemake(tmp_path, target, "--dry-run", configs=(USUAL, config), check=False).stdout

    assert f"tilings.none.sam2: there is no {folder}/model.safetensors" in plan()
    (folder / "model.safetensors").touch()
    assert f"{folder}/model.safetensors" in plan()
