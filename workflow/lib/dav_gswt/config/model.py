"""The whole config of the product."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from dav_gswt.config.base import Auto, ConfigModel, Name, Seed, Share, Text, key, lower_first
from dav_gswt.config.scenes import FieldScene, Scene
from dav_gswt.config.settings import (
    ClassTerm,
    Export,
    Hills,
    NoiseClasses,
    Preset,
    Prior,
    SunPosition,
    Surface,
    Tiling,
)
from dav_gswt.views.policies import POLICY_NAMES

if TYPE_CHECKING:
    Policy = str  # the names are known at run time only
else:
    Policy = Literal[POLICY_NAMES]
Lpips = Literal["installed", "none"] | Text
SweptSetting = Literal["k", "p_drop", "lam", "tau", "rounds"]


class Config(ConfigModel):
    """The experiment: what is made, from what, and how well."""

    scene: Name = key(
        "the scene that `snakemake` and `make run` make: a file of config/scenes, or an entry of `scenes`"
    )
    seeds: list[Seed] = key("each is a run of its own: start views, noise of the fit", [0], min_length=1)
    policy: Policy | Auto = key(
        "how the next views are chosen: docs/reference/policies.md; `auto`: of given photos (`agent: replay`) by "
        "`farthest`, else by `coverage-error`",
        "auto",
    )
    prior: Name = key("the entry of `priors` that policies sample", "terrain")
    p_drop: float = key("share of its attention that a prior drops in each sample", 0.15, ge=0, lt=1)
    lam: float = key("weight of LPIPS beside squared W2 in what selects poses (the paper's lambda)", 0.1, ge=0, le=1e6)
    rounds: int = key("rounds of view selection (the paper's T)", 2, ge=0, le=100)
    k: int = key(
        "views chosen in a round; where fewer are left, all; `--config views_per_round=3` on the command line, where "
        "Snakemake takes no key of one letter",
        4,
        ge=1,
        le=1000,
    )
    inpaint: bool = key("`true`: ground that no photo saw is painted by `prior`, and marked", False)
    levels: Annotated[int, Field(ge=1, le=8)] | Auto = key(
        "levels of detail; `auto`: as many as are ever drawn, at most six", "auto"
    )
    tau: Share = key(
        "tiles and objects whose mean uncertainty reaches it are drawn in all pre-sorted orders, the others in about "
        "half; 0: all, 1: none. It acts in the bundle only",
        0.6,
    )
    lpips: Lpips = key(
        "the weights of LPIPS: `installed`, those that come with the library; a path of others; `none`: cuts "
        "know colours and superpixels only, scores and metrics lack LPIPS",
        "installed",
    )
    variation: float = key(
        "large-scale light and dark of the ground, as a multiple of what the exemplar has; 0: none. Neither on a "
        "sphere nor in gswt.zip",
        1,
        ge=0,
        le=4,
    )
    heights: Surface = key("the surface that the tiles are placed on", Hills(kind="hills"))
    sun: SunPosition | Auto | Literal["none"] = key(
        "the sun that shone on the photos. The page moves it over the day, with light and shadow on hills. `auto`: "
        "from the time and place in EXIF, or from light and dark on the ground's relief; else 45 degrees high in the "
        "south-west. `none`: the light stays as photographed. Neither on a sphere nor in exports",
        "auto",
    )
    wind: float = key("how far plants sway on the page; 0: none", 1, ge=0, le=4)
    classes: list[ClassTerm] = key(
        "which material lies where, on a terrain of several: terms whose scores are added",
        [NoiseClasses(kind="noise")],
        min_length=1,
        max_length=16,
    )
    stills: list[Annotated[int, Field(ge=16, le=8192)]] = key(
        "width and height of the stills", [1920, 1080], unit="pixels", min_length=2, max_length=2
    )
    export: Export = key("a finite terrain for other programs, asked for by its path: docs/exports.md", Export())
    scenes: dict[Name, Scene] = key("what there is to make a terrain of", {})
    priors: dict[Name, Prior] = key("diffusion priors", {})
    presets: dict[Name, Preset] = key("speed against accuracy", min_length=1)
    sweeps: dict[SweptSetting, list[int | float]] = key(
        "`snakemake sweeps`: a list of values for each of `k`, `p_drop`, `lam`, `tau` and `rounds` that is varied, by "
        "itself, with the other settings as the config has them",
        {},
    )
    tilings: dict[Name, Tiling] = key("how tiles are cut", min_length=1)

    @model_validator(mode="after")
    def _require_known_names(self) -> "Config":
        _require("scene", self.scene, self.scenes, "scenes")
        _require("prior", self.prior, self.priors, "priors")
        for name, scene in self.scenes.items():
            _require(f"scenes.{name}.preset", scene.preset, self.presets, "presets")
            _require(f"scenes.{name}.tiling", scene.tiling, self.tilings, "tilings")
        for name, preset in self.presets.items():
            _require_chooser(name, preset, self.presets)
        if "none" in self.priors:
            raise ValueError("priors.none: is the name of no prior; give yours another")
        return self

    @model_validator(mode="after")
    def _require_swept_values(self) -> "Config":
        """A value of `sweeps` has the type and the bounds of the setting itself."""
        for name, values in self.sweeps.items():
            field = Config.model_fields[name]
            setting: Any = Annotated[field.annotation, *field.metadata]
            adapter = TypeAdapter(setting, config=ConfigModel.model_config)
            try:
                for value in values:
                    adapter.validate_python(value)
            except ValidationError as error:
                raise ValueError(f"sweeps.{name}: {lower_first(error.errors()[0]['msg'])}") from None
        return self

    @model_validator(mode="after")
    def _require_inpainter(self) -> "Config":
        """Ground can be inpainted where there are photos, by a prior that knows depth."""
        if not self.inpaint:
            return self
        if isinstance(self.scenes[self.scene], FieldScene):
            raise ValueError(
                f"inpaint: {self.scene} is a finished field: without photos nothing says what they did not see; "
                "set inpaint: false"
            )
        if self.priors[self.prior].model != "terrain":
            able = [name for name, prior in self.priors.items() if prior.model == "terrain"]
            raise ValueError(
                f"inpaint: the prior {self.prior} knows no depth; set prior to one of model terrain "
                f"({', '.join(able) or 'none is'} in priors), or inpaint: false"
            )
        return self


def _require_chooser(name: str, preset: Preset, presets: dict[str, Preset]) -> None:
    """A preset that leaves the choice of photos to another names one that chooses them itself."""
    if not preset.choose_with:
        return
    where = f"presets.{name}.choose_with"
    _require(where, preset.choose_with, presets, "presets")
    if presets[preset.choose_with].choose_with:
        able = ", ".join(each for each, entry in presets.items() if not entry.choose_with)
        raise ValueError(
            f"{where}: {preset.choose_with} chooses no photos itself; name one that does ({able or 'none'})"
        )


def _require(where: str, name: str, table: dict, called: str) -> None:
    if name not in table:
        raise ValueError(f"{where}: there is no {name!r}; {called} has {', '.join(table) or 'nothing'}")
