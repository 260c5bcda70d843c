"""Entries of the study's config for fits that are measured by themselves."""

from typing import Annotated

from pydantic import Field, model_validator

from dav_gswt.config.base import ConfigModel, Name, Seed, key
from dav_gswt.config.settings import Preset

Seeds = Annotated[list[Seed], Field(min_length=1)]
Names = Annotated[list[Name], Field(min_length=1)]


class Refits(Preset):
    """`snakemake refits`: photos taken in rounds against one fit to all of them, with the same number of steps."""

    photos: int = key("of the last round, the start included", ge=3, le=100_000)
    photos_a_round: list[Annotated[int, Field(ge=1, le=1000)]] = key("sizes of rounds that are compared", min_length=1)
    first_rates: list[Annotated[float, Field(gt=0, le=1)]] = key(
        "learning rates at the first step of a refit, as shares of a first fit's", min_length=1
    )
    seeds: Seeds = key("of fits; the start is that of the first one")


class GainBound(Preset):
    """`snakemake gain_bound`: policies beside the greedy choice of the photo whose refit truly gains most."""

    k: int = key("photos a round", ge=1, le=1000)
    rounds: int = key("rounds", ge=1, le=100)
    seeds: Seeds = key("of fits; the start is that of the first one")


Amounts = Annotated[list[Annotated[int, Field(ge=1, le=100_000_000)]], Field(min_length=3)]


class Scale(ConfigModel):
    """`snakemake scale`: how seconds and memory grow."""

    scene: Name = key("whose first field photos are rendered from")
    field: Name = key("an entry of `presets`, of that field")
    preset: Name = key("an entry of `presets`, of the fits that are measured")
    photos: Amounts = key("numbers of photos of a fit")
    size: int = key("of these photos", unit="pixels a side", ge=32, le=16384)
    pixels: Amounts = key("sizes of photos of a fit, pixels a side")
    photos_of_pixels: int = key("number of these photos", ge=3, le=1000)
    steps_of_pixels: int = key("optimiser steps of their fits: a preset's would take long", ge=1, le=100_000)
    limits: Amounts = key("most Gaussians of a fit, by as many photos and steps")
    pixels_of_limits: int = key("size of the photos of these fits", unit="pixels a side", ge=32, le=16384)
    gaussians: Amounts = key("numbers of Gaussians that are rendered")
    candidates: Amounts = key("numbers of candidates that are scored")
    tiles: Amounts = key("numbers of tiles in view")


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
