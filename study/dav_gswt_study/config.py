"""The study's keys of the config (`study:`), checked against the product's; and the named entries that it makes.

Read by the workflow before the first job, so it loads no numerics.
"""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from dav_gswt.config.base import Auto, ConfigModel, Name, Seed, Share, Text, key
from dav_gswt.config.load import check_config, check_model
from dav_gswt.config.model import Policy
from dav_gswt.config.settings import Heights
from dav_gswt.errors import InputError
from dav_gswt_study.config_fits import Comparison, Names, PresetCosts, Seeds
from dav_gswt_study.seams import replicates
from dav_gswt_study.sweeps import grid
from dav_gswt_study.tables import checks
from dav_gswt_study.tradeoff import settings

FLOOR = "floor"  # in a pair of the forced-choice study: the same place without a seam


class PolicySettings(ConfigModel):
    """A policy with settings of its own."""

    policy: Policy = key("its name")
    prior: Name | None = key("instead of the config's", None)
    p_drop: float | None = key("instead of the config's", None, ge=0, lt=1)
    lam: float | None = key("instead of the config's", None, ge=0, le=1e6)


Policies = Annotated[list[Policy | PolicySettings], Field(min_length=1)]


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


class BaseSettings(ConfigModel):
    """Settings that comparisons start from."""

    policy: Policy = key("how views are chosen")
    prior: Name = key("an entry of `priors`")
    p_drop: float | None = key("instead of the config's", None, ge=0, lt=1)
    lam: float | None = key("instead of the config's", None, ge=0, le=1e6)
    k: int | None = key("instead of the config's", None, ge=1, le=1000)
    rounds: int = key("rounds", ge=1, le=100)
    tau: Share = key("mean uncertainty from which a tile keeps all orders")
    tiling: Name = key("an entry of `tilings`")
    preset: Name = key("an entry of `presets`")


class Levels(ConfigModel):
    """`snakemake lod_table presort_table`: levels, pre-sorted orders and rounding against the finest."""

    scenes: Names = key("whose tiles are measured")
    seeds: Seeds | None = key("of each scene; the config's if left out", None)
    fixed: FixedSettings | None = key("settings that replace the config's", None)


class Materials(Levels):
    """Materials and objects against true labels (family `oasis`, `materials: auto`)."""


class Lattice(Levels):
    """How visibly terrains repeat, from above (`snakemake materials_pages`)."""


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
    width: int = key("of a frame", unit="pixels", ge=16, le=1920)
    height: int = key("of a frame", unit="pixels", ge=16, le=1080)
    rate: int = key("frames a second", ge=1, le=60)


class Frames(Levels):
    """`snakemake frame_times`: milliseconds of a frame on a walk, by the library and by the page in a browser."""

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
    """`snakemake seams`: can anybody find the seams, and does the terrain repeat?"""

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


class Vary(ConfigModel):
    """One setting and its values, or two, of which every combination is made."""

    policy: Policies | None = key("policies", None)
    prior: Names | None = key("entries of `priors`", None)
    p_drop: list[Annotated[float, Field(ge=0, lt=1)]] | None = key("dropouts", None, min_length=1)
    lam: list[Annotated[float, Field(ge=0, le=1e6)]] | None = key("weights of LPIPS", None, min_length=1)
    k: list[Annotated[int, Field(ge=1, le=1000)]] | None = key("views a round", None, min_length=1)
    rounds: list[Annotated[int, Field(ge=0, le=100)]] | None = key("rounds", None, min_length=1)
    tau: list[Share] | None = key("thresholds", None, min_length=1)
    tiling: Names | None = key("entries of `tilings`", None)

    @model_validator(mode="after")
    def _require_one_or_two(self) -> "Vary":
        if not 1 <= len(self.model_fields_set) <= 2:
            raise ValueError("one or two settings are varied")
        return self


class Measure(ConfigModel):
    """What is measured, and of which seeds."""

    views: list[Seed] | None = key("PSNR, SSIM, LPIPS of the test photos", None)
    tiles: list[Seed] | None = key("uncertainty, orders, bytes of the bundle", None)
    seams: list[Seed] | None = key("Seam-LPIPS, density", None)
    stills: list[Seed] | None = key("seconds of three stills", None)

    @model_validator(mode="after")
    def _require_one(self) -> "Measure":
        if not self.model_fields_set:
            raise ValueError("nothing is measured")
        return self


class Sweep(ConfigModel):
    """`snakemake study/results/sweeps/<name>.png`: what one setting changes."""

    scenes: Names = key("scenes with photos; policies are compared fairly with `agent: replay`")
    vary: Vary = key("the setting and its values")
    fixed: FixedSettings = key("settings that replace the config's", FixedSettings())
    measure: Measure = key("what is measured, and of which seeds")
    baseline: str | None = key("the value that tables compare the others with", None)


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
    base: BaseSettings = key("settings that knobs are turned from")
    presets: Names = key("presets that are compared as they are")
    only: Names | None = key("the knobs that are turned; all if left out", None)
    knobs: dict[Name, Knob] = key("by name")

    @model_validator(mode="after")
    def _check_tau(self) -> "Tradeoff":
        """Without `of` a knob is `tau`; the range of other knobs is that of the entries they change."""
        for name, knob in self.knobs.items():
            if knob.of is None and (name != "tau" or any(not 0 <= float(value) <= 1 for value in knob.values)):
                raise ValueError(f"knobs.{name}: give `of`; without it a knob is tau, whose values are from 0 to 1")
        return self


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

    lod: Levels | None = key("levels, orders, rounding", None)
    materials: Materials | None = key("materials and objects against true labels", None)
    lattice: Lattice | None = key("how visibly terrains repeat", None)
    gallery: GalleryPage | None = key("terrains and a walk, as pictures", None)
    frames: Frames | None = key("frame times", None)
    calibration: Calibration | None = key("scores against true errors", None)
    view_benchmark: ViewBenchmark | None = key("policies", None)
    compare: Comparison | None = key("another program's fit beside ours", None)
    seams: Seams | None = key("seams and repetition", None)
    forced_choice: ForcedChoice | None = key("the study with people", None)
    sweeps: dict[Name, Sweep] = key("by name", {})
    tradeoff: Tradeoff | None = key("speed against accuracy", None)
    preset_costs: PresetCosts | None = key("what presets cost and are worth", None)
    tables: Tables | None = key("the paper's tables and figures", None)


def expand_study(config: dict, study: dict) -> dict:
    """The checked config with the study's defaults, and with the presets, tilings and priors that the study makes.

    Raises: InputError: the key, what is wrong with it, and what it may be.
    """
    model = check_model(StudyConfig, study, "study")
    study = model.model_dump(mode="json", exclude_none=True, by_alias=True)
    flat = config | study
    for table in ("lod", "materials", "lattice", "gallery", "frames", "seams", "forced_choice"):
        _require_names(f"study.{table}.scenes", study.get(table, {}).get("scenes", []), config["scenes"], "scenes")
    if "gallery" in study:
        _require_names("study.gallery.walk", [study["gallery"]["walk"]], config["scenes"], "scenes")
    if "compare" in study:
        _require_names("study.compare.scene", [study["compare"]["scene"]], config["scenes"], "scenes")
    if "preset_costs" in study:
        _require_names("study.preset_costs.scenes", study["preset_costs"]["scenes"], config["scenes"], "scenes")
        _require_names("study.preset_costs.presets", study["preset_costs"]["presets"], config["presets"], "presets")
    if "view_benchmark" in study:
        _check_view_benchmark(study["view_benchmark"], config)
    if "seams" in study:
        _check_seams(study["seams"], config["tilings"])
    if "forced_choice" in study:
        _check_forced_choice(study["forced_choice"], config["tilings"])
    grid.check_sweeps(flat)
    checks.check(flat)
    settings.check_tradeoff(flat)
    made = replicates.add_replicates(settings.add_entries(flat))
    tables = {table: made[table] for table in ("presets", "tilings", "priors")}
    return check_config(config | tables) | {"study": study}  # values of knobs are in range where the entries are


def _require_names(where: str, names: list[str], table: dict, called: str) -> None:
    for name in names:
        if name not in table:
            raise InputError(f"config: {where}: there is no {name!r}; {called} has {', '.join(table) or 'nothing'}")


def _check_seams(seams: dict, tilings: dict) -> None:
    _require_names(
        "study.seams.tilings", [replicates.split_tiling(name)[0] for name in seams["tilings"]], tilings, "tilings"
    )
    if seams["baseline"] not in seams["tilings"]:
        raise InputError(f"config: study.seams.baseline: {seams['baseline']} is not among study.seams.tilings")


def _check_forced_choice(study: dict, tilings: dict) -> None:
    """Both entries of every pair exist; only the second may be the floor."""
    if any(pair[0] == FLOOR for pair in study["pairs"]):
        raise InputError(f"config: study.forced_choice.pairs: {FLOOR} is the same place without a seam: name it second")
    names = [replicates.split_tiling(name)[0] for pair in study["pairs"] for name in pair if name != FLOOR]
    _require_names("study.forced_choice.pairs", names, tilings, f"{FLOOR} is allowed second; tilings")


def _check_view_benchmark(benchmark: dict, config: dict) -> None:
    """Policies can be compared where every scene starts from some of its photos and each experiment takes a round."""
    scenes, where = config["scenes"], "config: study.view_benchmark"
    if benchmark["baseline"] not in benchmark["policies"]:
        raise InputError(f"{where}.baseline: {benchmark['baseline']} is not among view_benchmark.policies")
    for i, group in enumerate(benchmark["sets"]):
        if "preset" in group:
            _require_names(f"study.view_benchmark.sets.{i}.preset", [group["preset"]], config["presets"], "presets")
        for policy in group.get("policies", benchmark["policies"]):
            if isinstance(policy, dict) and "prior" in policy:
                _require_names("study.view_benchmark.policies", [policy["prior"]], config["priors"], "priors")
        for name in group["scenes"]:
            if "start" not in scenes.get(name, {}):
                raise InputError(f"{where}.sets.{i}.scenes: {name} is no scene with `start`, photos to start from")
            if group["photos"] < scenes[name]["start"] + max(group["k"]):
                raise InputError(
                    f"{where}.sets.{i}.photos: {group['photos']} leave no round of {max(group['k'])} after the "
                    f"{scenes[name]['start']} that {name} starts from"
                )
