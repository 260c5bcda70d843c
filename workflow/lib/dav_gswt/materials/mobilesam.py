"""MobileSAM: the outline of the thing in a box, by networks in two ONNX files.

The networks are SAM (Kirillov et al. 2023) with a small image encoder (Zhang et al. 2023). A picture
is encoded once; each box is then a prompt of its own. onnxruntime runs them on the CPU.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.materials.mobilesam_package import ELSE, EXTRA
from dav_gswt.threads import one_thread

SIDE = 1024  # pixels along the longest side of a picture, for the encoder
MEAN, DEVIATION = (123.675, 116.28, 103.53), (58.395, 57.12, 57.375)  # of the 8-bit pictures it was trained on
EMBEDDING = (1, 256, 64, 64)
LOGITS = (1, 1, 256, 256)  # of a mask at the decoder's own resolution
ENCODER_INPUT = (3, SIDE, SIDE)  # after the number of pictures
DECODER_INPUTS = {
    *("image_embeddings", "point_coords", "point_labels"),
    *("mask_input", "has_mask_input", "orig_im_size"),
}
CORNERS = (2.0, 3.0)  # labels of the two corners of a box
MOST_BYTES = 200 * 2**20  # of a file; the published ones have 27 and 16 MiB
OUTSIDE = b"\x0a\x08location\x12"  # key of a tensor's values that lie in another file
MOST_COVERED = 0.5  # of the picture, by a mask: more is the ground, not a thing on it
LEAST_BOX_IOU = 0.5  # of the mask's bounding box with the prompt: less is another thing

BoxFinder = Callable[[Float[Array, "4"]], Bool[Array, "h w"] | None]


@dataclass(frozen=True)
class Segmenter:
    """The two networks, as sessions of onnxruntime."""

    encoder: Any
    decoder: Any

    def open_picture(self, picture: Float[Array, "h w 3"]) -> BoxFinder:
        """Encode a picture (sRGB in [0, 1]); returns a function that finds the mask of the thing in a box.

        A box is its edges in pixels: first column, first row, end column, end row. The mask is None if
        it is not plausible: see `is_plausible`.
        """
        shape = picture.shape[:2]
        name = self.encoder.get_inputs()[0].name
        embedding = np.asarray(self.encoder.run(None, {name: prepare_picture(picture)})[0], np.float32)

        def find(box: Float[Array, "4"]) -> Bool[Array, "h w"] | None:
            feed = {
                "image_embeddings": embedding,
                "point_coords": scale_box(box, shape)[None],
                "point_labels": np.array([CORNERS], np.float32),
                "mask_input": np.zeros(LOGITS, np.float32),
                "has_mask_input": np.zeros(1, np.float32),
                "orig_im_size": np.array(shape, np.float32),
            }
            (masks,) = self.decoder.run(["masks"], feed)
            if masks.shape != (1, 1, *shape):
                raise InputError(f"config: segmenter: decoder.onnx: its masks are not those of MobileSAM; {ELSE}")
            cells = masks[0, 0] > 0
            return cells if is_plausible(cells, box) else None

        return find


def load_segmenter(encoder: Path | str, decoder: Path | str, threads: int = 1) -> Segmenter:
    """Open the networks in two files.

    Raises: InputError: a file is missing, too large, unreadable for onnxruntime, or of another network; onnxruntime is
    not installed.
    """
    first, second = _open_session(Path(encoder), threads), _open_session(Path(decoder), threads)
    inputs, outputs = first.get_inputs(), first.get_outputs()
    if len(inputs) != 1 or tuple(inputs[0].shape[1:]) != ENCODER_INPUT or tuple(outputs[0].shape) != EMBEDDING:
        raise InputError(f"{encoder}: is not the encoder of MobileSAM (inputs or outputs differ); {ELSE}")
    asked, given = ({each.name for each in ends} for ends in (second.get_inputs(), second.get_outputs()))
    if asked != DECODER_INPUTS or "masks" not in given:
        raise InputError(f"{decoder}: is not the decoder of MobileSAM (inputs or outputs differ); {ELSE}")
    return Segmenter(first, second)


def _open_session(path: Path, threads: int) -> Any:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError(f"{path}: has more than {MOST_BYTES} bytes, so it is not of MobileSAM; {ELSE}")
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: not readable ({error.strerror}); {ELSE}") from error
    if OUTSIDE in content:
        raise InputError(f"{path}: keeps weights in other files, which are not read; {ELSE}")
    try:
        import onnxruntime  # an extra
    except ImportError as error:
        raise InputError(f"config: segmenter: needs onnxruntime: pip install '{EXTRA}' ({error})") from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
    options.use_deterministic_compute = True
    options.log_severity_level = 4  # errors are raised
    try:
        return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's own exceptions have no common base
        raise InputError(f"{path}: onnxruntime cannot read it ({summarize_error(error)}); {ELSE}") from error


def prepare_picture(picture: Float[Array, "h w 3"]) -> Float32[Array, "1 3 s s"]:
    """The encoder's input: the longest side scaled to SIDE pixels, normalized, zeros below and to the right."""
    import torch  # deferred: it takes a second to load, and few runs have a segmenter
    from torch.nn import functional

    longest = max(picture.shape[:2])
    height, width = (max(1, round(side * SIDE / longest)) for side in picture.shape[:2])
    planes = torch.from_numpy(np.ascontiguousarray(picture.transpose(2, 0, 1), np.float32))[None]
    with one_thread():
        scaled = functional.interpolate(planes, (height, width), mode="bilinear", antialias=True, align_corners=False)
    mean, deviation = (np.array(values, np.float32)[:, None, None] for values in (MEAN, DEVIATION))
    padded = np.zeros((1, *ENCODER_INPUT), np.float32)
    padded[0, :, :height, :width] = (255 * scaled[0].numpy() - mean) / deviation
    return padded


def scale_box(box: Float[Array, "4"], shape: tuple[int, int]) -> Float32[Array, "2 2"]:
    """Corners (x, y) of a box in the encoder's picture, whose pixel k is at k; shape: of the picture."""
    return (np.reshape(box, (2, 2)) * (SIDE / max(shape)) - 0.5).astype(np.float32)


def is_plausible(cells: Bool[Array, "h w"], box: Float[Array, "4"]) -> bool:
    """Whether a mask is neither empty nor most of the picture, and about fills the box of its prompt."""
    if not cells.any() or cells.mean() > MOST_COVERED:
        return False
    rows, columns = np.flatnonzero(cells.any(1)), np.flatnonzero(cells.any(0))
    own = np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], float)
    both = np.prod(np.maximum(np.minimum(own[2:], box[2:]) - np.maximum(own[:2], box[:2]), 0))
    areas = [np.prod(edges[2:] - edges[:2]) for edges in (own, box)]
    return bool(both >= LEAST_BOX_IOU * (sum(areas) - both))
