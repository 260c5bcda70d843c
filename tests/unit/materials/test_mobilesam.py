"""MobileSAM, with a stand-in for its networks."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.materials import mobilesam


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

    def __init__(self, cells):
        self.cells, self.prompts = cells, []

    def get_inputs(self):
        return [SimpleNamespace(name=name) for name in mobilesam.DECODER_INPUTS]

    def get_outputs(self):
        return [SimpleNamespace(name=name) for name in ("masks", "iou_predictions", "low_res_masks")]

    def run(self, names, feed):
        assert set(feed) == mobilesam.DECODER_INPUTS and names == ["masks"]
        assert feed["orig_im_size"].tolist() == list(self.cells.shape)
        self.prompts.append((feed["point_coords"], feed["point_labels"]))
        return [np.where(self.cells, 3.0, -3.0)[None, None]]


def square(low, high, side=40):
    cells = np.zeros((side, side), bool)
    cells[low:high, low:high] = True
    return cells


def segment(cells, box):
    return mobilesam.Segmenter(Encoder(), Decoder(cells)).open_picture(np.zeros((*cells.shape, 3)))(
        np.array(box, float)
    )


def test_a_picture_is_normalized_and_padded_with_zeros():
    picture = np.zeros((50, 100, 3))
    picture[:, :, 0] = 1
    planes = mobilesam.prepare_picture(picture)
    assert planes.shape == (1, 3, 1024, 1024) and planes.dtype == np.float32
    np.testing.assert_allclose(planes[0, 0, :512], (255 - 123.675) / 58.395, atol=1e-4)
    np.testing.assert_allclose(planes[0, 1, :512], -116.28 / 57.12, atol=1e-4)
    assert not planes[0, :, 512:].any()


def test_a_prompt_is_the_two_corners_of_a_box_in_the_encoders_picture():
    cells = np.zeros((50, 100), bool)
    segmenter = mobilesam.Segmenter(Encoder(), decoder := Decoder(cells))
    find = segmenter.open_picture(np.zeros((50, 100, 3)))
    find(np.array([0.0, 10, 50, 20])), find(np.array([0.0, 10, 50, 20]))
    (points, labels), _ = decoder.prompts
    np.testing.assert_allclose(points, [[[-0.5, 101.9], [511.5, 204.3]]], atol=1e-4)
    assert labels.tolist() == [[2.0, 3.0]]


@pytest.mark.parametrize(
    ("cells", "box"),
    [
        (square(0, 0), [10, 10, 20, 20]),  # empty
        (square(2, 38), [2, 2, 38, 38]),  # more than half of the picture
        (square(10, 20), [10, 10, 30, 30]),  # a part of what was asked for
        (square(10, 20), [25, 25, 35, 35]),  # elsewhere
    ],
)
def test_masks_that_are_not_what_was_asked_for_are_dropped(cells, box):
    assert segment(cells, box) is None


def test_a_mask_that_fills_its_box_is_kept_and_masks_of_another_shape_are_refused():
    assert (segment(square(10, 20), [9, 9, 21, 21]) == square(10, 20)).all()
    segmenter = mobilesam.Segmenter(Encoder(), Decoder(square(10, 20)))
    segmenter.decoder.run = lambda names, feed: [np.zeros((1, 3, 8, 8))]
    with pytest.raises(InputError, match="its masks are not those of MobileSAM"):
        segmenter.open_picture(np.zeros((40, 40, 3)))(np.array([10.0, 10, 20, 20]))


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


@pytest.mark.parametrize(
    ("sessions", "complaint"),
    [
        ([RuntimeError("bad\nprotobuf")], "encoder.onnx: onnxruntime cannot read it .bad protobuf"),
        ([Decoder(square(1, 2))] * 2, "is not the encoder of MobileSAM"),
        ([Encoder()] * 2, "is not the decoder of MobileSAM"),
    ],
)
def test_two_networks_of_the_right_kind_are_opened_and_others_refused(files, monkeypatch, sessions, complaint):
    right = Encoder(), Decoder(square(1, 2))
    pretend_runtime(monkeypatch, *right)
    assert mobilesam.load_segmenter(*files) == mobilesam.Segmenter(*right)
    pretend_runtime(monkeypatch, *sessions)
    with pytest.raises(InputError, match=complaint):
        mobilesam.load_segmenter(*files)


def test_files_are_checked_before_they_are_opened(files, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)

    def refuse(complaint):
        with pytest.raises(InputError, match=complaint):
            mobilesam.load_segmenter(*files)

    refuse("pip install 'onnxruntime>=1.23,<2'")
    files[0].write_bytes(b"..." + mobilesam.OUTSIDE + b"...")
    refuse("keeps weights in other files")
    monkeypatch.setattr(mobilesam, "MOST_BYTES", 5)
    refuse("has more than 5 bytes")
    files[0].unlink()
    refuse("encoder.onnx: not readable")
