"""What the first round settles for all others of its scene, and what scores.json says of a scoring."""

from dataclasses import asdict, dataclass
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.files import read_json, write_json
from dav_gswt.provenance import record_provenance
from dav_gswt.views.uncertainty.weighting import Quantiles, Scales


@dataclass(frozen=True)
class FrozenScales:
    """scales: of terms. pixels: of w2_sq's maps, those that count as 0 and as 1 when the maps are carried onto
    Gaussians; None without a prior."""

    scales: Scales
    pixels: Quantiles | None


def read_frozen_scales(path: Path | str) -> FrozenScales:
    """Raises: InputError: not the scores.json of a first round."""
    found = read_json(path)
    try:
        pixels = found["pixels"] and Quantiles(float(found["pixels"]["low"]), float(found["pixels"]["high"]))
        return FrozenScales(Scales({name: float(scale) for name, scale in found["scales"].items()}), pixels)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{path}: does not hold the scales of a first round ({error}); make it again") from error


def write_frozen_scales(
    path: Path | str, frozen: FrozenScales, facts: dict, inputs: dict[str, Path | str], parameters: dict
) -> None:
    """facts: what more is to be said of a scoring."""
    scales, pixels = frozen.scales.of, frozen.pixels and asdict(frozen.pixels)
    write_json(path, facts | {"scales": scales, "pixels": pixels, "provenance": record_provenance(inputs, parameters)})
