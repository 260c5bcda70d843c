"""Named settings (presets, priors, tilings), and the smaller tables of the config, `export` among them."""

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator

from dav_gswt.config.base import Auto, ConfigModel, Name, PhotoSize, Text, key
from dav_gswt.export.formats import FORMATS

Coordinate = Annotated[float, Field(ge=-(2**30), le=2**30)]
if TYPE_CHECKING:
    Format = str
else:
    Format = Literal[tuple(FORMATS)]


TERRAIN, GROUND = ("export_terrain",), ("export_ground",)
BOTH = (*TERRAIN, *GROUND)
Weight = Annotated[float, Field(ge=0, le=1000)]
EVALUATING = ("evaluate_round",)  # metrics.json records what its field was fitted with
FITTING = ("fit_coarse", "evaluate_coarse", "update_field", "fit_chosen_photos", "fit_windows", *EVALUATING)


class Export(ConfigModel):
    """A finite terrain for other programs: `exports/terrain`, and its ground, `exports/ground`. docs/exports.md."""

    columns: int = key("cells from west to east", 8, unit="tiles", read_by=BOTH, ge=1, le=1000)
    rows: int = key("cells from south to north", 8, unit="tiles", read_by=BOTH, ge=1, le=1000)
    centre: list[Coordinate] = key(
        "x and y of the point that the cells lie about",
        [0.0, 0.0],
        unit="tile sides",
        read_by=BOTH,
        min_length=2,
        max_length=2,
    )
    level: int = key("level of detail, 0 the finest", 0, read_by=TERRAIN, ge=0, le=15)
    formats: list[Format] = key(
        "`3dtiles`: all levels in chunks, which CesiumJS draws; `sog` needs Node.js",
        ["glb"],
        read_by=TERRAIN,
        min_length=1,
        max_length=len(FORMATS),
    )


class Flat(ConfigModel):
    """A plain."""

    kind: Literal["flat"]


class Hills(ConfigModel):
    """Hills by noise."""

    kind: Literal["hills"]
    height: Annotated[float, Field(ge=0, le=100)] | Auto = key(
        "nothing is higher above the plain or deeper below it; `auto`: a quarter of the wavelength",
        "auto",
        unit="tile sides",
    )
    wavelength: Annotated[float, Field(ge=1, le=100_000)] | Auto = key(
        "from one large hill to the next, about; `auto`: 24 times the lowest height of the eye, from 16 to 32",
        "auto",
        unit="tile sides",
    )


class HeightMap(ConfigModel):
    """A height map from an image."""

    kind: Literal["image"]
    file: Text = key(
        "grey image of unsigned integers (16 bits: PNG, TIFF) or of floats (EXR, TIFF), at most 4096 pixels a side"
    )
    width: float = key(
        "of the whole image; its middle lies at the world's origin, and it is mirrored beyond its edge",
        unit="world units",
        ge=0.001,
        le=1e7,
    )
    height: float = key("height of white; black is 0, floats are multiplied by it", unit="world units", ge=-1e6, le=1e6)


class Sphere(ConfigModel):
    """A planet: the tiles cover a sphere."""

    kind: Literal["sphere"]
    radius: float = key("of the ground", unit="tile sides", ge=4, le=1e7)


Heights = Annotated[Flat | Hills | HeightMap, Field(discriminator="kind")]
Surface = Annotated[Flat | Hills | HeightMap | Sphere, Field(discriminator="kind")]


class SunPosition(ConfigModel):
    """The sun that shone on the photos."""

    elevation: float = key("above the horizon", unit="degrees", ge=3, le=90)
    azimuth: float = key(
        "clockwise from north; without GPS, from the y axis of the field", unit="degrees", ge=0, lt=360
    )


class NoiseClasses(ConfigModel):
    """The measured noise of the materials: their shares of the ground and the sizes of their patches."""

    kind: Literal["noise"]
    weight: Weight = key("of the noise among the terms", 1)


class RangeClasses(ConfigModel):
    """A material where the surface's height (tile sides) or slope (rise over run) lies in a range; rarer beyond."""

    kind: Literal["height", "slope"]
    material: Text = key("name of the material")
    low: float | None = key("lower bound", None, ge=-1e6, le=1e6)
    high: float | None = key("upper bound", None, ge=-1e6, le=1e6)
    soft: float = key("by how far beyond a bound the score falls by `weight`", gt=0, le=1e6)
    weight: Weight = key("of the range; noise lies between -1 and 1", 1)


class PaintedClasses(ConfigModel):
    """What was painted and set on the page, in the place of the other terms where it is painted."""

    kind: Literal["painted"]
    file: Text = key("file that the page's “Save” has saved")


ClassTerm = Annotated[NoiseClasses | RangeClasses | PaintedClasses, Field(discriminator="kind")]


class Preset(ConfigModel):
    """How much a fit may spend."""

    fit_size: PhotoSize = key(
        "longer side of the photos that the fit sees, or `native`: the scene's", unit="pixels", read_by=FITTING
    )
    spacing: float = key(
        "of the ground's discs, in sizes of a photo's pixel on the ground", read_by=FITTING, ge=0.5, le=16
    )
    max_gaussians: int = key(
        "most Gaussians in the field", read_by=(*FITTING, "prepare_external_field"), ge=1000, le=8_000_000
    )
    steps: int = key("optimiser steps of the coarse fit, to 8 photos or fewer", read_by=FITTING, ge=1, le=100_000)
    steps_per_photo: int = key(
        "optimiser steps for each photo more: beyond 8 of the coarse fit, and each new one of a round",
        read_by=FITTING,
        ge=1,
        le=100_000,
    )
    update: Literal["continue", "scratch"] = key(
        "how a round takes new photos: `continue`: the field is fitted on; `scratch`: all photos are fitted anew. "
        "Not read with `choose_with`",
        "continue",
        read_by=("update_field", *EVALUATING),
    )
    choose_with: Name | None = key(
        "preset whose rounds choose the photos; this one then fits all of them at once. Left out: its own",
        None,
        read_by=EVALUATING,
    )
    sh_degree: int = key(
        "of the spherical harmonics of colour; tiles show their constant part", 0, read_by=FITTING, ge=0, le=3
    )
    level_steps: int = key("optimiser steps for a coarser level", read_by=("make_levels",), ge=1, le=100_000)


class Prior(ConfigModel):
    """A diffusion prior, and how it samples."""

    samples: int = key("drawn for each pose", ge=2, le=100)
    steps: int = key("denoising steps of a sample", ge=1, le=1000)
    model: Literal["terrain", "zero123"] = key(
        "`terrain`: the project's own latent diffusion model of terrain; `zero123`: Zero-1-to-3, published weights"
    )
    weights: Text | None = key(
        "of `terrain`: other weights of the same network; of `zero123`: the folder of its weights, required "
        "(docs/prior.md)",
        None,
    )

    @model_validator(mode="after")
    def _require_weights(self) -> "Prior":
        if self.model == "zero123" and self.weights is None:
            raise ValueError("model zero123 needs `weights`, a folder: docs/prior.md")
        return self


class Tiling(ConfigModel):
    """How tiles are cut from the exemplar."""

    tile: Annotated[float, Field(ge=0.1, le=0.9)] | Auto = key("side of a tile, as a share of the exemplar's", "auto")
    strip: Annotated[float, Field(ge=0.05, le=0.19)] | Auto = key(
        "half-width of the strips along the edges, as a share of a tile's side", "auto"
    )
    candidates: int = key("places tried for each patch", 600, ge=1, le=100_000)
    variants: int = key("centres for each of the sixteen edge combinations", 2, ge=1, le=16)
    energy: Literal["none", "colour", "semantic", "semantic-nogamma"] = key(
        "cost of a cut: `none`, straight lines; `colour`, of colours; `semantic`, and of the kind of ground, "
        "the surer a patch the more its colours count (the paper's gamma); `semantic-nogamma`, both alike everywhere",
        "semantic",
    )
    replicate: int = key("another number, another draw of places", 0, ge=0, le=1000)
    sam2: Text | None = key("a folder with a checkpoint of SAM 2, whose masks separate objects", None)
