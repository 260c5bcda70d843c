"""MobileSAM. Most tests have a stand-in for its networks; one reads the published ones where they are at hand."""

import os
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.materials import mobilesam

WEIGHTS = "DAV_GSWT_MOBILESAM"  # names a folder with the published networks


class Encoder:
    def get_inputs(self):
        return [SimpleNamespace(name="input", shape=["batch_size", 3, 1024, 1024])]

    def get_outputs(self):
        return [SimpleNamespace(name="output", shape=[1, 256, 64, 64])]

    def run(self, names, feed):
        assert feed["input"].shape == (1, 3, 1024, 1024) and feed["input"].dtype == np.float32
        return [np.zeros((1, 256, 64, 64), np.float32)]


class Decoder:
    """Gives the same cells for every prompt."""

    def __init__(self, cells, score=0.9):
        self.cells, self.score, self.prompts = cells, score, []

    def get_inputs(self):
        return [SimpleNamespace(name=name) for name in mobilesam.DECODER_INPUTS]

    def get_outputs(self):
        return [SimpleNamespace(name=name) for name in ("masks", "iou_predictions", "low_res_masks")]

    def run(self, names, feed):
        assert set(feed) == mobilesam.DECODER_INPUTS and names == ["masks", "iou_predictions"]
        assert feed["orig_im_size"].tolist() == list(self.cells.shape)
        self.prompts.append((feed["point_coords"], feed["point_labels"]))
        return [np.where(self.cells, 3.0, -3.0)[None, None], np.array([[self.score]], np.float32)]


def square(low, high, side=40):
    cells = np.zeros((side, side), bool)
    cells[low:high, low:high] = True
    return cells


def segment(cells, box, score=0.9):
    segmenter = mobilesam.Segmenter(Encoder(), Decoder(cells, score))
    (found,) = segmenter.segment_boxes(segmenter.embed_image(np.zeros((*cells.shape, 3))), np.array([box], float))
    return found


def test_a_picture_is_normalized_and_padded_with_zeros():
    picture = np.zeros((50, 100, 3))
    picture[:, :, 0] = 1
    planes = mobilesam.prepare_picture(picture)
    assert planes.shape == (1, 3, 1024, 1024) and planes.dtype == np.float32
    np.testing.assert_allclose(planes[0, 0, :512], (255 - 123.675) / 58.395, atol=1e-4)
    np.testing.assert_allclose(planes[0, 1, :512], -116.28 / 57.12, atol=1e-4)
    assert not planes[0, :, 512:].any()


def test_the_boxes_edges_are_scaled_to_the_encoders_picture():
    corners = mobilesam.scale_box(np.array([0.0, 10.0, 50.0, 20.0]), (50, 100))
    np.testing.assert_allclose(corners, [[-0.5, 101.9], [511.5, 204.3]], atol=1e-4)


def test_a_prompt_is_the_two_corners_of_a_box():
    segmenter = mobilesam.Segmenter(Encoder(), decoder := Decoder(square(10, 20)))
    segmenter.segment_boxes(segmenter.embed_image(np.zeros((40, 40, 3))), np.array([[10.0, 10, 20, 20]] * 2))
    (points, labels), _ = decoder.prompts
    assert points.shape == (1, 2, 2) and labels.tolist() == [[2.0, 3.0]]


def test_a_mask_that_fills_its_box_is_kept_with_its_score():
    found = segment(square(10, 20), [9, 9, 21, 21], 0.75)
    assert found is not None and (found.cells == square(10, 20)).all() and found.predicted_iou == 0.75


@pytest.mark.parametrize(
    ("cells", "box"),
    [
        pytest.param(square(0, 0), [10, 10, 20, 20], id="empty"),
        pytest.param(square(2, 38), [2, 2, 38, 38], id="more than half of the picture"),
        pytest.param(square(10, 20), [10, 10, 30, 30], id="a part of what was asked for"),
        pytest.param(square(10, 20), [25, 25, 35, 35], id="elsewhere"),
    ],
)
def test_masks_that_are_not_what_was_asked_for_are_dropped(cells, box):
    assert segment(cells, box) is None


def test_masks_of_another_shape_are_refused():
    segmenter = mobilesam.Segmenter(Encoder(), Decoder(square(10, 20)))
    segmenter.decoder.run = lambda names, feed: [np.zeros((1, 3, 8, 8)), np.ones((1, 3))]
    with pytest.raises(InputError, match="its masks are not those of MobileSAM"):
        segmenter.segment_boxes(segmenter.embed_image(np.zeros((40, 40, 3))), np.array([[10.0, 10, 20, 20]]))


def pretend_runtime(monkeypatch, *sessions):
    """An onnxruntime that opens these sessions; what is an exception is raised."""
    ahead = list(sessions)

    def open_session(content, options, providers):
        assert providers == ["CPUExecutionProvider"] and options.intra_op_num_threads == 1
        if isinstance(session := ahead.pop(0), Exception):
            raise session
        return session

    module = SimpleNamespace(SessionOptions=SimpleNamespace, InferenceSession=open_session)
    monkeypatch.setitem(sys.modules, "onnxruntime", module)


@pytest.fixture
def files(tmp_path):
    paths = tmp_path / "encoder.onnx", tmp_path / "decoder.onnx"
    for path in paths:
        path.write_bytes(b"a network")
    return paths


def test_two_networks_of_the_right_kind_are_opened(files, monkeypatch):
    encoder, decoder = Encoder(), Decoder(square(1, 2))
    pretend_runtime(monkeypatch, encoder, decoder)
    assert mobilesam.load_segmenter(*files) == mobilesam.Segmenter(encoder, decoder)


@pytest.mark.parametrize(
    ("sessions", "complaint"),
    [
        pytest.param(
            [RuntimeError("bad\nprotobuf")], "encoder.onnx: onnxruntime cannot read it .bad protobuf", id="bad"
        ),
        pytest.param([Decoder(square(1, 2))] * 2, "is not the encoder of MobileSAM", id="another encoder"),
        pytest.param([Encoder()] * 2, "is not the decoder of MobileSAM", id="another decoder"),
    ],
)
def test_other_networks_are_refused(files, monkeypatch, sessions, complaint):
    pretend_runtime(monkeypatch, *sessions)
    with pytest.raises(InputError, match=complaint):
        mobilesam.load_segmenter(*files)


def test_files_are_checked_before_they_are_opened(files, monkeypatch):
    pretend_runtime(monkeypatch)
    files[0].write_bytes(b"..." + mobilesam.OUTSIDE + b"...")
    with pytest.raises(InputError, match="keeps weights in other files"):
        mobilesam.load_segmenter(*files)
    monkeypatch.setattr(mobilesam, "MOST_BYTES", 5)
    with pytest.raises(InputError, match="has more than 5 bytes"):
        mobilesam.load_segmenter(*files)
    files[0].unlink()
    with pytest.raises(InputError, match="encoder.onnx: not readable"):
        mobilesam.load_segmenter(*files)


def test_a_missing_onnxruntime_is_named_with_the_command(files, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(InputError, match="pip install 'onnxruntime>=1.23,<2'"):
        mobilesam.load_segmenter(*files)


def test_onnxruntime_itself_refuses_what_is_no_network(files):
    pytest.importorskip("onnxruntime", reason="needs the extra `mobilesam`")
    with pytest.raises(InputError, match="encoder.onnx: onnxruntime cannot read it"):
        mobilesam.load_segmenter(*files)


def test_the_published_networks_outline_a_disc_the_same_with_two_threads():
    pytest.importorskip("onnxruntime", reason="needs the extra `mobilesam`")
    if not (folder := os.environ.get(WEIGHTS)):
        pytest.skip(f"needs {WEIGHTS}: a folder with the published encoder.onnx and decoder.onnx")
    rows, columns = np.mgrid[:96, :128]
    disc = np.hypot(rows - 40, columns - 80) < 15
    picture = np.where(disc[..., None], [0.2, 0.4, 0.15], [0.8, 0.7, 0.5])
    box, found = np.array([[64.0, 24, 97, 57]]), []
    for threads in (1, 2):
        files = (Path(folder, f"{name}.onnx") for name in ("encoder", "decoder"))
        segmenter = mobilesam.load_segmenter(*files, threads)
        found += segmenter.segment_boxes(segmenter.embed_image(picture), box)
    assert (found[0].cells & disc).sum() / (found[0].cells | disc).sum() > 0.9
    assert found[0].predicted_iou > 0.8 and (found[0].cells == found[1].cells).all()
