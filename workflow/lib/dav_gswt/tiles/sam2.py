"""SAM 2 from a folder of weights: masks of the things that an exemplar shows from above.

Ravi et al. 2024, as transformers has it (`Sam2Model`): config.json and model.safetensors are read and nothing else, so
no code that came with the weights is ever run and nothing is fetched. As in the authors' own generator of masks, a grid
of points asks what lies under each, sure and stable answers are kept, and of answers alike the surest.
"""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from safetensors import SafetensorError
from torch import Tensor, nn
from torch.nn import functional

from dav_gswt.errors import InputError
from dav_gswt.files import read_json

EXTRA = "transformers==5.23.0"
HELP = "docs/reference/config.md says what it must hold"
TYPES = "sam2", "sam2_video"  # the published folders are of the second: the same network, and one for videos
MEAN, SPREAD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # of its pictures
POINTS = 32  # a side of the grid
AT_ONCE = 64  # points asked about at a time
SURE = 0.8  # overlap with the truth that a mask expects of itself
STABLE, OFFSET = 0.9, 1.0  # overlap of a mask with itself where its threshold is moved to either side, by that much
ALIKE = 0.7  # overlap of two masks of one thing
COMPARED = 128  # pixels a side at which masks are compared
LEAST = 9  # cells of a mask


def load_model(folder: Path | str) -> nn.Module:
    """The network in a folder, in single precision on the CPU.

    Raises: InputError: no folder, another model's, weights that are pickles, missing or one short, not finite, or of
    another shape, by name; transformers is not installed.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder, and SAM 2's weights are never fetched; {HELP}")
    config, file = folder / "config.json", folder / "model.safetensors"
    if not file.is_file():
        pickles = sorted(p.name for kind in ("bin", "pt", "pth") for p in folder.glob(f"*.{kind}"))
        note = f" ({pickles[0]} is a pickle, which could run anything, and is not read)" if pickles else ""
        raise InputError(f"{folder}: there is no model.safetensors in it{note}; {HELP}")
    told = read_json(config)
    if not isinstance(told, dict) or told.get("model_type") not in TYPES:
        raise InputError(f"{config}: is not of SAM 2 (model_type is none of {', '.join(TYPES)}); {HELP}")
    try:
        from transformers import Sam2Model  # here, not above: only those who have such a folder need it
    except ImportError as error:
        raise InputError(f"SAM 2 needs transformers: pip install '{EXTRA}' ({error})") from error
    try:
        model, found = Sam2Model.from_pretrained(
            str(folder), local_files_only=True, use_safetensors=True, output_loading_info=True, dtype=torch.float32
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RuntimeError, SafetensorError) as error:
        raise InputError(f"{folder}: SAM 2 cannot be read from it ({str(error).splitlines()[0]}); {HELP}") from error
    if missing := sorted(found["missing_keys"]):
        raise InputError(f"{file}: {missing[0]} is missing (of {len(missing)}); copy it again")
    if bad := [name for name, values in model.named_parameters() if not values.isfinite().all()]:
        raise InputError(f"{file}: {bad[0]} has values that are not finite; copy it again")
    return model.eval()


def predict_masks(model: Any, colour: Float[Array, "m m 3"]) -> list[Bool[Array, "m m"]]:
    """Masks of what a picture (values in [0, 1]) shows, the surest first; there may be none."""
    cells = len(colour)
    side = int(np.ravel(model.config.prompt_encoder_config.image_size)[0])
    planes = torch.from_numpy(np.ascontiguousarray(colour.transpose(2, 0, 1), np.float32))[None]
    planes = functional.interpolate(planes, (side, side), mode="bilinear", antialias=True, align_corners=False)
    planes = (planes - torch.tensor(MEAN)[:, None, None]) / torch.tensor(SPREAD)[:, None, None]
    place = (torch.arange(POINTS) + 0.5) * side / POINTS
    points = torch.cartesian_prod(place, place)
    kept, scores = [], []
    with torch.inference_mode():
        seen = model.get_image_embeddings(planes)
        for some in points.split(AT_ONCE):
            found = model(image_embeddings=list(seen), input_points=some[None, :, None], multimask_output=True)
            logits, score = found.pred_masks[0].flatten(0, 1), found.iou_scores[0].flatten()
            sure = (score >= SURE) & (_stability(logits) >= STABLE)
            large = functional.interpolate(logits[sure][:, None], (cells, cells), mode="bilinear", antialias=True)[:, 0]
            big = (large > 0).sum((1, 2)) >= LEAST
            kept += list((large[big] > 0).numpy())
            scores += score[sure][big].tolist()
    return [kept[i] for i in _apart(kept, np.array(scores))]


def _stability(logits: Float[Tensor, "n h w"]) -> Float[Tensor, "n"]:
    """Overlap of each mask at a higher threshold with the same at a lower one; 0 for an empty one."""
    high, low = ((logits > offset).sum((1, 2)) for offset in (OFFSET, -OFFSET))
    return high / low.clamp(min=1)


def _apart(masks: list[Bool[Array, "m m"]], scores: Float[Array, "n"]) -> list[int]:
    """The masks that are like none surer, the surest first; of equally sure ones the first."""
    if not masks:
        return []
    small = torch.from_numpy(np.stack(masks).astype(np.float32))[:, None]
    flat = (functional.interpolate(small, (COMPARED, COMPARED))[:, 0].flatten(1) > 0.5).float()
    both, area = flat @ flat.T, flat.sum(1)
    overlap = (both / (area[:, None] + area - both).clamp(min=1)).numpy()
    chosen: list[int] = []
    for i in np.argsort(-scores, kind="stable"):
        if not (overlap[i, chosen] > ALIKE).any():
            chosen.append(int(i))
    return chosen
