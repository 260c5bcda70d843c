"""The settings of fits, from an entry of the config's `presets`, which trade speed for accuracy."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from dav_gswt.reconstruction import underlay
from dav_gswt.reconstruction.fitting.plan import FitPlan, count_first_steps

# Learning rates of an update at its first step, as a share of a first fit's: the field is nearly right, and full rates
# would undo its detail faster than a round's few steps make it again (docs/active-views.md)
UPDATE_RATE = 0.3
GROUND_SHARE = 0.9  # of the Gaussians, that the ground may take with its underlay; objects get the rest


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """The keys of a preset that the first fit and its updates read.

    size: longer side of the photos, pixels. spacing: of the discs, in sizes of a photo's pixel on the ground. steps: of
    the first fit. steps_per_photo: of the first fit for each photo beyond `plan.FEW_PHOTOS`, and of an update for each
    new photo. first_rate: of an update; not a key of presets.
    """

    size: int
    spacing: float
    max_gaussians: int
    steps: int
    steps_per_photo: int = 0
    sh_degree: int = 0
    first_rate: float = UPDATE_RATE

    @staticmethod
    def from_preset(preset: Mapping[str, Any]) -> "FitSettings":
        """The settings of a preset, which may have keys for other stages."""
        names = [each.name for each in fields(FitSettings) if each.name != "first_rate"]
        return FitSettings(**{name: preset[name] for name in names if name in preset})

    def from_scratch(self, start: int, photos: int) -> "FitSettings":
        """The settings of one fit with as many steps as a fit to `start` photos and updates to `photos` take."""
        steps = self.plan_coarse_fit(start).steps + self.steps_per_photo * max(0, photos - start)
        return replace(self, steps=steps, steps_per_photo=0)

    def plan_coarse_fit(self, photos: int) -> FitPlan:
        """The plan of the first fit, to so many photos."""
        steps = count_first_steps(self.steps, self.steps_per_photo, photos)
        return FitPlan(steps, self.max_gaussians, self.sh_degree)

    def plan_update(self, earlier: int, new: int) -> FitPlan:
        """The plan of an update of a field from so many earlier photos with so many new ones."""
        first_rate = self.first_rate if earlier else 1.0
        return FitPlan(self.steps_per_photo * new, self.max_gaussians, self.sh_degree, first_rate)


def limit_discs(max_gaussians: int) -> int:
    """Most cells of the ground's grid in a field of so many Gaussians."""
    return int(GROUND_SHARE * max_gaussians / (1 + 1 / underlay.STRIDE**2))
