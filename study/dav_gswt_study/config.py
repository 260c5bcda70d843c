"""The study's keys of the config (`study:`), checked against the product's; and the named entries that it makes.

Read by the workflow before the first job, so it loads no numerics.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from dav_gswt.config.base import Auto, ConfigModel, Name, Seed, Share, Text, key
from dav_gswt.config.load import check_config, check_model
from dav_gswt.config.model import Policy
from dav_gswt.config.settings import Heights
from dav_gswt_study import experiments

Seeds = Annotated[list[Seed], Field(min_length=1)]
Names = Annotated[list[Name], Field(min_length=1)]

FLOOR = "floor"  # in a pair of the forced-choice study: the same place without a seam


class Photographed(ConfigModel):
    """From where synthetic scenes are photographed and tested."""

    scenes: Names = key("synthetic scenes")
    layout: Literal["ring", "cap", "paper"] = key(
        "how photos are placed: `ring`, one from above and the others around it at 65 degrees; `cap`, evenly over the "
        "hemisphere above `min_elevation`; `paper`, 36 on a circle at 45 degrees and the others as `cap`",
        "ring",
    )
    oblique: int = key("further test views around the exemplar at 45 degrees", 0, ge=0, le=200)
    walkers: int = key("further test views at eye level, 0.8, 1.6 and 3.2 m above the ground in turn", 0, ge=0, le=200)


class FixedSettings(ConfigModel):
    """Settings that replace the config's."""

    policy: Policy | None = key("how views are chosen", None)
    prior: Name | None = key("an entry of `priors`", None)
    p_drop: float | None = key("dropout of the prior", None, ge=0, lt=1)
    lam: float | None = key("weight of LPIPS", None, ge=0, le=1e6)
    k: int | None = key("views a round", None, ge=1, le=1000)
    rounds: int | None = key("rounds", None, ge=0, le=100)
    photos: int | None = key("photos that an experiment ends with, instead of `rounds`", None, ge=3, le=100_000)
    tau: Share | None = key("mean uncertainty from which a tile keeps all orders", None)
    tiling: Name | None = key("an entry of `tilings`", None)
    preset: Name | None = key("an entry of `presets`", None)


Policies = Annotated[list[Policy], Field(min_length=1)]


class Levels(ConfigModel):
    """The scenes of a table, and the settings that they are made with."""

    scenes: Names = key("whose tiles are measured")
    seeds: Seeds | None = key("of each scene; the config's if left out", None)
    fixed: FixedSettings | None = key("settings that replace the config's", None)


class Flight(ConfigModel):
    """A walk straight on, rendered frame by frame."""

    frames: int = key("number of frames", ge=2, le=100_000)
    length: float = key("of the walk", unit="tile sides", gt=0, le=100_000)
    height: float = key("of the eye above the surface", unit="eye floors", ge=0.5, le=100)


class GalleryPage(ConfigModel):
    """`snakemake gallery_page`: scenes as photographed and as terrain, with verdicts and numbers, and a walk."""

    scenes: Names = key("whose terrains are shown")
    walk: Name = key("the scene of the walk")
    flight: Flight = key("the walk")
    hours: Annotated[list[float], Field(min_length=2, max_length=2)] = key(
        "solar time of the first and the last frame, where the terrain has a sun"
    )
    width: int = key("of a frame", unit="pixels", ge=16, le=1920)
    height: int = key("of a frame", unit="pixels", ge=16, le=1080)
    rate: int = key("frames a second", ge=1, le=60)


class Frames(Levels):
    """`snakemake frame_times`: milliseconds of a frame of the page in a browser, on a walk."""

    heights: Heights = key("the surface")
    flight: Flight = key("the walk")
    width: int = key("of a frame", unit="pixels", ge=16, le=4096)
    height: int = key("of a frame", unit="pixels", ge=16, le=4096)
    budgets: list[Annotated[int, Field(ge=1000, le=6_000_000)]] = key(
        "Gaussians in view; tables show the first", min_length=1
    )


class Calibration(ConfigModel):
    """Scores of candidate poses against the true error of the field there."""

    scenes: list[Name] = key("of agent `render` or `replay`")
    policy: Policy = key("which chooses the views between the rounds")
    rounds: int = key("the last round that is measured; 0 is the coarse field", ge=0, le=100)


class PolicySet(ConfigModel):
    """Scenes on which policies are compared."""

    title: Text = key("what its scenes have in common: they are a row of the page together")
    scenes: Names = key("with `start`")
    k: list[Annotated[int, Field(ge=1, le=1000)]] = key("photos a round", min_length=1)
    photos: int = key("photos that each experiment ends with", ge=3, le=100_000)
    policies: Policies | None = key("instead of those above", None)
    seeds: Seeds | None = key("instead of those above", None)
    preset: Name | None = key("of the fits, instead of the scenes' own", None)


class ViewBenchmark(ConfigModel):
    """`snakemake view_benchmark`: policies compared photo by photo, from the same photos and pools."""

    table: Literal["view", "hundred", "development"] = key(
        "whose tables and page; `development` for choosing parameters"
    )
    baseline: Policy = key("the policy that the others are compared with")
    policies: Policies = key("those compared")
    seeds: Seeds = key("which photos start: one start a seed")
    sets: list[PolicySet] = key("scenes, photos a round and photos in all", min_length=1)


class Seams(ConfigModel):
    """`snakemake seams`: can anybody find the seams?"""

    scenes: Names = key("whose tiles are measured: by their own `tiling`, and by those below")
    tilings: Names = key("entries of `tilings` that are compared")
    baseline: Name = key("the one of these that the others are compared with")
    replicates: int = key("tile sets of each scene's own tiling", 1, ge=1, le=100)
    compared_replicates: int = key("tile sets of each compared tiling", 1, ge=1, le=100)


class ForcedChoice(ConfigModel):
    """`snakemake perceptual_kit` and `perceptual_results`: people choose the crop with the less visible seam."""

    scenes: Names = key("whose tiles are shown")
    pairs: list[Annotated[list[Name], Field(min_length=2, max_length=2)]] = key(
        "two tilings with the same `tile`, `strip` and `variants`, or one and `floor`, the same place uncut",
        min_length=1,
    )
    crops: int = key("pairs of crops of each scene and comparison", ge=1, le=100)
    checks: int = key("attention checks of each scene", ge=0, le=100)
    size: int = key("side of a crop", unit="pixels", ge=48, le=1024)
    seed: Seed = key("of places, names and trial lists")
    answers: Text = key("the folder with the files that people saved; it may be missing")


class Sweep(ConfigModel):
    """`snakemake study/results/sweeps/<name>.png`: what one setting changes."""

    scenes: Names = key("scenes with photos; policies are compared fairly with `agent: replay`")
    vary: Annotated[dict[str, Annotated[list[Any], Field(min_length=1)]], Field(min_length=1, max_length=2)] = key(
        "a key of `fixed` and its values, or two keys, of which every combination is made"
    )
    fixed: FixedSettings = key("settings that replace the config's", FixedSettings())
    measure: Annotated[dict[Literal["views", "tiles", "seams", "stills"], Seeds], Field(min_length=1)] = key(
        "seeds by what is measured of them: test photos, the bundle, Seam-LPIPS, seconds of three stills"
    )
    baseline: str | None = key("the value that tables compare the others with", None)

    @model_validator(mode="after")
    def _check_values(self) -> "Sweep":
        for name, values in self.vary.items():
            for value in values:
                FixedSettings.model_validate({name: value})
        return self


class Knob(ConfigModel):
    """A setting that the trade-off turns by itself."""

    of: Literal["presets", "tilings", "priors"] | None = key("the table whose entries it changes", None)
    key_: str | None = Field(None, alias="key", description="the key; the knob's name if left out")
    values: list[Auto | Literal["scratch", "continue"] | int | float] = key(
        "its settings, the most accurate first", min_length=1
    )
    base: FixedSettings | None = key("settings of this knob alone", None)
    measure: Literal["views", "stills", "seams"] = key("what measures its accuracy")


class Tradeoff(ConfigModel):
    """`snakemake tradeoff`: what each setting costs and what it is worth."""

    scene: Name = key("a scene with photos")
    seed: Seed = key("of all experiments")
    base: FixedSettings = key("settings that knobs are turned from")
    presets: Names = key("presets that are compared as they are")
    only: Names | None = key("the knobs that are turned; all if left out", None)
    knobs: dict[Name, Knob] = key("by name")


class PresetCosts(ConfigModel):
    """`snakemake preset_costs`: what presets cost and what they are worth, with all else as the config has it."""

    scenes: Names = key("scenes with photos")
    presets: Names = key("`standard` among them, which the others' seconds are compared with")
    size: int = key("of the test photos, whatever size is fitted", unit="pixels", ge=32, le=4096)
    seed: Seed = key("of all experiments")


class TableFigures(ConfigModel):
    """What the paper's figures show."""

    scenes: Names = key("scenes with photos")
    seed: Seed = key("of all figures")
    estimators: Annotated[list[Policy], Field(min_length=1, max_length=5)] = key("policies beside each other")
    policy: Policy = key("of the other figures")
    rounds: int = key("rounds shown", ge=1, le=100)


class Tables(ConfigModel):
    """`snakemake study`: the paper's tables and figures."""

    timing: Name = key("the sweep of the timing table")
    sensitivity: Names = key("sweeps of one setting each")
    ablation: Names = key("sweeps whose values are compared with their `baseline`")
    also: list[Name] = key("further sweeps, plotted only", [])
    viewer: bool = key("`true`: with the milliseconds of `frame_times`, which needs Chromium", False)
    figures: TableFigures = key("what the figures show")


class StudyConfig(ConfigModel):
    """What the study compares."""

    photographed: dict[Name, Photographed] = key("by name, how synthetic scenes are photographed and tested", {})
    lod: Levels | None = key("levels, orders, rounding", None)
    materials: Levels | None = key("materials and objects against true labels", None)
    lattice: Levels | None = key("how visibly terrains repeat", None)
    gallery: GalleryPage | None = key("terrains and a walk, as pictures", None)
    frames: Frames | None = key("frame times", None)
    calibration: Calibration | None = key("scores against true errors", None)
    view_benchmark: ViewBenchmark | None = key("policies", None)
    seams: Seams | None = key("seams", None)
    forced_choice: ForcedChoice | None = key("the study with people", None)
    sweeps: dict[Name, Sweep] = key("by name", {})
    tradeoff: Tradeoff | None = key("speed against accuracy", None)
    preset_costs: PresetCosts | None = key("what presets cost and are worth", None)
    tables: Tables | None = key("the paper's tables and figures", None)


def expand_study(config: dict, study: dict) -> dict:
    """The checked config with the study's defaults, and with the presets, tilings and priors that the study makes.

    Raises: InputError: the key, what is wrong with it, and what it may be.
    """
    study = check_model(StudyConfig, study, "study").model_dump(mode="json", exclude_none=True, by_alias=True)
    made = experiments.add_replicates(experiments.add_entries(config | study))
    tables = {table: made[table] for table in ("presets", "tilings", "priors")}
    return check_config(config | tables) | {"study": study}  # values of knobs are in range where the entries are
