"""The settings of fits, from an entry of the config's `presets`, which trade speed for accuracy."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, TypeVar

from dav_gswt.field import GaussianField
from dav_gswt.reconstruction import underlay
from dav_gswt.reconstruction.fitting.plan import (
    AUTO,
    MAX_GAUSSIANS,
    STEPS_PER_NEW_PHOTO,
    Count,
    FitPlan,
    count_first_steps,
)

# Learning rates of an update at its first step, as a share of a first fit's: the field is nearly right, and rates as at
# first would undo its detail faster than a round's few steps make it again (docs/active-views.md)
UPDATE_RATE = 0.3
GROUND_SHARE = 0.9  # of the Gaussians, that the ground may take with its underlay; objects get the rest


@dataclass(frozen=True, kw_only=True)
class _FitSettings:
    """What the first fit and its updates have in common."""

    size: int  # longer side of the photos, pixels
    max_gaussians: Count
    sh_degree: Count = 0
    pose_rate: float = 0.0  # radians a step that cameras may turn

    @property
    def gaussian_limit(self) -> int:
        return limit_gaussians(self.max_gaussians)


@dataclass(frozen=True, kw_only=True)
class CoarseSettings(_FitSettings):
    """The keys of a preset that the first fit reads."""

    spacing: float  # of the discs, in sizes of a photo's pixel on the ground
    steps: Count
    steps_per_photo: Count = 0  # for each photo beyond `plan.FEW_PHOTOS`

    @property
    def max_discs(self) -> int:
        """Cells that the ground's grid may have."""
        return limit_discs(self.max_gaussians)

    def plan_coarse_fit(self, photos: int, half_share: float = 0.0) -> FitPlan:
        """The plan of the first fit, to so many photos."""
        steps = count_first_steps(self.steps, self.steps_per_photo, photos)
        return FitPlan(steps, self.max_gaussians, self.sh_degree, half_share, self.pose_rate)


@dataclass(frozen=True, kw_only=True)
class UpdateSettings(_FitSettings):
    """The keys of a preset that the update of a field reads."""

    steps_per_photo: Count  # for every new photo
    first_rate: float = field(default=UPDATE_RATE, metadata={"of_preset": False})  # for comparisons

    @property
    def steps_per_new_photo(self) -> int:
        return STEPS_PER_NEW_PHOTO if self.steps_per_photo == AUTO else int(self.steps_per_photo)

    def plan_update(self, field: GaussianField, earlier: int, new: int) -> FitPlan:
        """The plan of an update of a field from so many earlier photos with so many new ones.

        Steps: a number for each new photo. With "auto", the Gaussians per photo are at most those of the field, and the
        spherical harmonics have the field's degree. Rates begin at `first_rate` of a first fit's.
        """
        limit = min(MAX_GAUSSIANS, len(field) * (earlier + new) // max(1, earlier))
        degree = field.sh_degree if self.sh_degree == AUTO else self.sh_degree
        rates = {"pose_rate": self.pose_rate, "first_rate": self.first_rate if earlier else 1.0}
        return FitPlan(self.steps_per_new_photo * new, self.max_gaussians, degree, limit=limit, **rates)


Settings = TypeVar("Settings", CoarseSettings, UpdateSettings)


def select_settings(kind: type[Settings], preset: Mapping[str, Any]) -> Settings:
    """The settings of one kind from a preset, which may have keys for other stages."""
    names = [each.name for each in fields(kind) if each.metadata.get("of_preset", True)]
    return kind(**{name: preset[name] for name in names if name in preset})


def limit_gaussians(max_gaussians: Count) -> int:
    """Most Gaussians of a field."""
    return MAX_GAUSSIANS if max_gaussians == AUTO else int(max_gaussians)


def limit_discs(max_gaussians: Count) -> int:
    """Most cells of the ground's grid in a field of so many Gaussians."""
    return int(GROUND_SHARE * limit_gaussians(max_gaussians) / (1 + 1 / underlay.STRIDE**2))
