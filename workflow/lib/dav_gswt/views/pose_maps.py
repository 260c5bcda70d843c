"""Maps of candidate poses: kept for all of them in one file, shown for some as parts of an EXR."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.files import UNREADABLE, atomic_file
from dav_gswt.images.image_files import enlarge_map
from dav_gswt.views.scores import Scores

Part = tuple[dict[str, Array], dict[str, str]]  # of an EXR: channels, and what the header says
NOTHING: dict[str, Part] = {"none": ({"opacity": np.zeros((1, 1), np.float32)}, {"camera": "no pose was left"})}


@dataclass(frozen=True)
class PoseMaps:
    """Of n candidates. opacity: what is not known to be opaque, of the whole picture (NaN below a lower one).
    w2_sq: how much the prior's samples disagree, of the picture's middle square; None without a prior."""

    names: list[str]
    opacity: Float32[Array, "n h w"]
    w2_sq: Float32[Array, "n hz wz"] | None

    def parts(self, scores: Scores, names: list[str]) -> dict[str, Part]:
        """Some candidates' maps, as parts of an EXR."""
        return {name: self.part(scores, name) for name in names}

    def part(self, scores: Scores, name: str) -> Part:
        """A candidate's maps on the pixels of its picture; header: pose and terms."""
        i, row = self.names.index(name), scores.names.index(name)
        opacity = self.opacity[i]
        opacity = opacity[: int((~np.isnan(opacity[:, 0])).sum())]
        channels = {"opacity": opacity}
        if self.w2_sq is not None:
            channels["w2_sq"] = _place_square(self.w2_sq[i], opacity.shape)
        header = {k: repr(getattr(scores.poses[row], k)) for k in ("elevation", "azimuth", "radius")}
        return channels, header | {k: repr(float(v[row])) for k, v in scores.terms.items()}


def _place_square(square: Float32[Array, "s s"], shape: tuple[int, int]) -> Float32[Array, "h w"]:
    """A map of the middle square, on a whole picture's pixels; NaN beside it."""
    h, w = shape
    side = min(h, w)
    top, left = (h - side) // 2, (w - side) // 2
    out = np.full(shape, np.nan, np.float32)
    out[top : top + side, left : left + side] = enlarge_map(square, side, side)
    return out


def apply_uncertainty(field: GaussianField, gaussians: Float32[Array, "g"]) -> GaussianField:
    """The field with the uncertainty that maps gave its first Gaussians. What was imagined since stays as it is, in
    full doubt: the maps are of the field before."""
    doubt = field.uncertainty.copy()
    doubt[: len(gaussians)] = np.where(field.imagined[: len(gaussians)], doubt[: len(gaussians)], gaussians)
    return replace(field, uncertainty=doubt)


def write_pose_maps(path: Path | str, maps: PoseMaps, gaussians: Float32[Array, "g"]) -> None:
    """All maps in half precision (w2_sq in single), and the uncertainty that they give each Gaussian of the field."""
    values = {"names": np.array(maps.names, str), "opacity": maps.opacity.astype(np.float16), "gaussians": gaussians}
    if maps.w2_sq is not None:
        values["w2_sq"] = maps.w2_sq
    with atomic_file(path) as part, part.open("wb") as file:
        np.savez_compressed(file, **values)


def read_pose_maps(path: Path | str) -> tuple[PoseMaps, Float32[Array, "g"]]:
    """Maps and Gaussians' uncertainty. Raises: InputError: not what `write_pose_maps` wrote."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            w2_sq = stored.get("w2_sq")
            names = [str(name) for name in stored["names"]]
            return PoseMaps(names, stored["opacity"].astype(np.float32), w2_sq), stored["gaussians"]
    except UNREADABLE as error:
        raise InputError(f"{path}: not readable as maps of poses ({error}); make it again") from error
