"""The settings of a reconstruction: an entry of the config's `presets`, which trade speed for accuracy."""

from dataclasses import dataclass

from dav_gswt.field import GaussianField
from dav_gswt.reconstruction import underlay
from dav_gswt.reconstruction.fitting.plan import (
    AUTO,
    MAX_GAUSSIANS,
    STEPS_PER_NEW_PHOTO,
    STEPS_PER_PHOTO,
    Count,
    FitPlan,
)

GROUND_SHARE = 0.9  # of the Gaussians, that the ground may take with its underlay; objects get the rest


@dataclass(frozen=True)
class FitSettings:
    """The fields are the keys of a preset in the config."""

    size: int  # longer side of the photos, pixels
    spacing: float  # of the discs, in sizes of a photo's pixel on the ground
    max_gaussians: Count
    steps: Count  # of the coarse fit
    steps_per_photo: Count  # of an update, for every new photo
    level_steps: int  # of the fit of a coarser level
    sh_degree: Count = 0
    pose_rate: float = 0.0  # radians a step that cameras may turn
    levels: Count | None = None  # of detail, if not the number of the other presets

    @property
    def gaussian_limit(self) -> int:
        return MAX_GAUSSIANS if self.max_gaussians == AUTO else int(self.max_gaussians)

    @property
    def max_discs(self) -> int:
        """Cells that the ground's grid may have."""
        return int(GROUND_SHARE * self.gaussian_limit / (1 + 1 / underlay.STRIDE**2))

    def plan_coarse_fit(self, photos: int, half_share: float = 0.0) -> FitPlan:
        """The plan of the first fit, to so many photos."""
        steps = STEPS_PER_PHOTO * photos if self.steps == AUTO else int(self.steps)
        return FitPlan(steps, self.max_gaussians, self.sh_degree, half_share, self.pose_rate)

    def plan_update(self, field: GaussianField, earlier: int, new: int) -> FitPlan:
        """The plan of an update of a field from so many earlier photos with so many new ones.

        Steps: a number for each new photo. With "auto", the Gaussians per photo are at most those of the field, and the
        spherical harmonics have the field's degree.
        """
        steps = STEPS_PER_NEW_PHOTO if self.steps_per_photo == AUTO else int(self.steps_per_photo)
        limit = min(MAX_GAUSSIANS, len(field) * (earlier + new) // max(1, earlier))
        degree = field.sh_degree if self.sh_degree == AUTO else self.sh_degree
        return FitPlan(steps * new, self.max_gaussians, degree, pose_rate=self.pose_rate, limit=limit)
