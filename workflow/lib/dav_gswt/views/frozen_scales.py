"""scores.json: scales that the first round fixes for all later rounds of a scene, and a summary of the scoring."""

from dataclasses import asdict, dataclass
from pathlib import Path

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import read_json, write_json
from dav_gswt.provenance import record_provenance
from dav_gswt.views.uncertainty.weighting import Quantiles, Scales


@dataclass(frozen=True)
class FrozenScales:
    """scales: of the terms. pixels: values of w2_sq maps that become 0 and 1 in uncertainties of Gaussians; None
    without a prior."""

    scales: Scales
    pixels: Quantiles | None


def read_frozen_scales(path: Path | str) -> FrozenScales:
    """Read scores.json. Raises: InputError: not that of a first round."""
    found = read_json(path)
    try:
        pixels = found["pixels"] and Quantiles(float(found["pixels"]["low"]), float(found["pixels"]["high"]))
        return FrozenScales(Scales({name: float(scale) for name, scale in found["scales"].items()}), pixels)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InputError(
            f"{path}: does not hold the scales of a first round ({summarize_error(error)}); make it again"
        ) from error


def write_frozen_scales(
    path: Path | str, frozen: FrozenScales, facts: dict, inputs: dict[str, Path | str | list], parameters: dict
) -> None:
    """Write scores.json. facts: summary of the scoring, see `ScoringResult.describe`."""
    scales, pixels = frozen.scales.by_term, frozen.pixels and asdict(frozen.pixels)
    write_json(path, facts | {"scales": scales, "pixels": pixels, "provenance": record_provenance(inputs, parameters)})
