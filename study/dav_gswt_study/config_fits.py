"""Entries of the study's config for fits that are measured by themselves."""

from typing import Annotated

from pydantic import Field, model_validator

from dav_gswt.config.base import ConfigModel, Name, Seed, key
from dav_gswt.config.settings import Preset

Seeds = Annotated[list[Seed], Field(min_length=1)]
Names = Annotated[list[Name], Field(min_length=1)]


class Comparison(Preset):
    """`make compare OPENSPLAT=<program>`: other programs' fits beside ours, of the same photos."""

    scene: Name = key("whose photos are fitted")
    margin: float = key("ground fitted around the exemplar, as a share of its side", ge=0, le=100)
    opensplat: str = key("the program, as one calls it", "opensplat")
    gsplat_steps: int = key("steps of gsplat's trainer, on a GPU", ge=1, le=100_000)
    seconds: float = key("that it may take", gt=0, le=100_000)
    every: int = key("steps after which a field is compared with the test photos", ge=1, le=100_000)


class PresetCosts(ConfigModel):
    """`snakemake preset_costs`: what presets cost and what they are worth, with all else as the config has it."""

    scenes: Names = key("scenes with photos")
    presets: Names = key("`standard` among them, which the others' seconds are compared with")
    size: int = key("of the test photos, whatever size is fitted", unit="pixels", ge=32, le=4096)
    seed: Seed = key("of all experiments")

    @model_validator(mode="after")
    def _check_presets(self) -> "PresetCosts":
        if "standard" not in self.presets:
            raise ValueError("presets: give `standard` too; the others' seconds are compared with its")
        return self
