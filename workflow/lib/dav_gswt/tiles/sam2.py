"""SAM 2 from a folder of weights: masks of the objects that an exemplar shows from above.

Ravi et al. 2024, by transformers' `Sam2Model`: only config.json and model.safetensors are read, so no code that came
with the weights is run and nothing is fetched. As in the authors' own mask generator, the model is prompted with a grid
of points; masks of a high predicted IoU and stability are kept, after non-maximum suppression.
"""

from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from safetensors import SafetensorError
from torch import Tensor, nn
from torch.nn import functional

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import read_json

EXTRA = "transformers==5.23.0"
HELP = "workflow/schemas/config.schema.json says what it must hold"
MODEL_TYPES = "sam2", "sam2_video"  # the published folders are of the second: the same network, and one for videos
MEAN, DEVIATION = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # of the pictures that the network was trained on
GRID_POINTS = 32  # along a side of the grid
BATCH = 64  # points in one call
MIN_PREDICTED_IOU = 0.8
MIN_STABILITY, OFFSET = 0.9, 1.0  # least IoU of a mask at thresholds moved by the offset to either side
MAX_IOU = 0.7  # of two masks: above it the one of the lower score is dropped
COMPARED_SIZE = 128  # pixels along a side at which masks are compared
MIN_CELLS = 9  # of a mask


def load_model(folder: Path | str) -> nn.Module:
    """The network in a folder, in single precision on the CPU.

    Raises: InputError: there is no such folder, it is of another model, the weights are pickles, incomplete, not finite
    or of another shape; transformers is not installed.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder, and SAM 2's weights are never fetched; {HELP}")
    config, file = folder / "config.json", folder / "model.safetensors"
    if not file.is_file():
        pickles = sorted(p.name for kind in ("bin", "pt", "pth") for p in folder.glob(f"*.{kind}"))
        note = f" ({pickles[0]} is a pickle, which could run anything, and is not read)" if pickles else ""
        raise InputError(f"{folder}: there is no model.safetensors in it{note}; {HELP}")
    settings = read_json(config)
    if not isinstance(settings, dict) or settings.get("model_type") not in MODEL_TYPES:
        raise InputError(f"{config}: is not of SAM 2 (model_type is none of {', '.join(MODEL_TYPES)}); {HELP}")
    try:
        from transformers import Sam2Model  # here, not above: only those who have such a folder need it
    except ImportError as error:
        raise InputError(f"SAM 2 needs transformers: pip install '{EXTRA}' ({error})") from error
    try:
        loaded = Sam2Model.from_pretrained(
            str(folder), local_files_only=True, use_safetensors=True, output_loading_info=True, dtype=torch.float32
        )
        model, found = cast("tuple[nn.Module, dict[str, Any]]", loaded)  # a pair, as output_loading_info is set
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RuntimeError, SafetensorError) as error:
        raise InputError(f"{folder}: SAM 2 cannot be read from it ({summarize_error(error)}); {HELP}") from error
    if missing := sorted(found["missing_keys"]):
        raise InputError(f"{file}: {missing[0]} is missing (of {len(missing)}); copy it again")
    if bad := [name for name, values in model.named_parameters() if not values.isfinite().all()]:
        raise InputError(f"{file}: {bad[0]} has values that are not finite; copy it again")
    return model.eval()


def predict_masks(model: Any, colour: Float[Array, "m m 3"]) -> list[Bool[Array, "m m"]]:
    """Masks of the objects in a picture (values in [0, 1]) by descending score; there may be none."""
    cells = len(colour)
    side = int(np.ravel(model.config.prompt_encoder_config.image_size)[0])
    planes = torch.from_numpy(np.ascontiguousarray(colour.transpose(2, 0, 1), np.float32))[None]
    planes = functional.interpolate(planes, (side, side), mode="bilinear", antialias=True, align_corners=False)
    planes = (planes - torch.tensor(MEAN)[:, None, None]) / torch.tensor(DEVIATION)[:, None, None]
    place = (torch.arange(GRID_POINTS) + 0.5) * side / GRID_POINTS
    points = torch.cartesian_prod(place, place)
    kept, scores = [], []
    with torch.inference_mode():
        embeddings = model.get_image_embeddings(planes)
        for some in points.split(BATCH):
            found = model(image_embeddings=list(embeddings), input_points=some[None, :, None], multimask_output=True)
            logits, score = found.pred_masks[0].flatten(0, 1), found.iou_scores[0].flatten()
            good = (score >= MIN_PREDICTED_IOU) & (_stability(logits) >= MIN_STABILITY)
            large = functional.interpolate(logits[good][:, None], (cells, cells), mode="bilinear", antialias=True)[:, 0]
            big = (large > 0).sum((1, 2)) >= MIN_CELLS
            kept += list((large[big] > 0).numpy())
            scores += score[good][big].tolist()
    return [kept[i] for i in suppress_overlaps(kept, np.array(scores))]


def _stability(logits: Float[Tensor, "n h w"]) -> Float[Tensor, "n"]:
    """Overlap of each mask at a higher threshold with the same at a lower one; 0 for an empty one."""
    high, low = ((logits > offset).sum((1, 2)) for offset in (OFFSET, -OFFSET))
    return high / low.clamp(min=1)


def suppress_overlaps(masks: list[Bool[Array, "m m"]], scores: Float[Array, "n"]) -> list[int]:
    """Non-maximum suppression: indices of the masks whose IoU with every better kept mask is at most MAX_IOU.

    By descending score; of equal scores the first comes first.
    """
    if not masks:
        return []
    small = torch.from_numpy(np.stack(masks).astype(np.float32))[:, None]
    flat = (functional.interpolate(small, (COMPARED_SIZE, COMPARED_SIZE))[:, 0].flatten(1) > 0.5).float()
    both, area = flat @ flat.T, flat.sum(1)
    overlap = (both / (area[:, None] + area - both).clamp(min=1)).numpy()
    chosen: list[int] = []
    for i in np.argsort(-scores, kind="stable"):
        if not (overlap[i, chosen] > MAX_IOU).any():
            chosen.append(int(i))
    return chosen
