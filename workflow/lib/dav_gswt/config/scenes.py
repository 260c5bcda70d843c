"""Scenes: what there is to make a terrain of, and how further photos of it are taken."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, FiniteFloat, field_validator, model_validator

from dav_gswt.capture.agents import list_agents
from dav_gswt.config.base import ConfigModel, Name, PhotoSize, Seed, Text, key
from dav_gswt.images.file_kinds import BY_SUFFIX, advise_conversion

if TYPE_CHECKING:
    SyntheticAgent = PhotoAgent = str
else:
    SyntheticAgent, PhotoAgent = Literal[list_agents("synthetic")], Literal[list_agents("photos")]
Range = Annotated[tuple[float, float], Field(description="lowest and highest", strict=False)]
Coordinate = Annotated[float, Field(ge=-100, le=100)]
Corner = Annotated[tuple[FiniteFloat, FiniteFloat, FiniteFloat], Field(strict=False)]
GroundPlace = Annotated[tuple[Coordinate, Coordinate], Field(strict=False)]

# What the keys' `read_by` and `agents` share. Rules that read `agent` get some keys for some agents only.
SCORING = ("score_coarse", "score_round")
CAPTURING = ("capture_views", "request_views")
ASKING = ("select_poses", *CAPTURING)
POSE_READERS = (*SCORING, *ASKING)
POSED = ("render", "serial", "plan", "handheld")  # agents that take photos anywhere, and do not only choose from a pool
FITTING = ("fit_coarse", "update_field", "fit_chosen_photos")
REGISTERED, RENDERED = ("register_photos",), ("render_photos",)


class Axes(ConfigModel):
    """Ranges of a rig's axes."""

    pan: Range = key("rotation about the vertical", unit="degrees")
    tilt: Range = key("rotation about the horizontal", unit="degrees")
    radius: Range = key("distance from the exemplar's centre", unit="mm")


class SerialRig(ConfigModel):
    """A motorised camera rig on a serial port (docs/rig-protocol.md), for `agent: serial`."""

    port: Text = key("the serial port: `/dev/ttyUSB0`, or a URL that pyserial knows (`socket://rig:4000`)")
    inbox: Text = key("the folder into which the tethered camera's software saves photos")
    millimetres: float = key(
        "in one unit of the scene's world (`ground.json`)", unit="mm", read_by=SCORING, ge=0.001, le=1e6
    )
    limits: Axes = key(
        "`pan`, `tilt` and `radius`: lowest and highest that the rig may be sent to; no obstacle may lie within",
        read_by=SCORING,
    )
    dry_run: bool = key("`true`: print each move, move nothing, take nothing", True)


class Drone(ConfigModel):
    """How a drone flies, for `agent: plan`."""

    min_altitude: float = key("no photo is taken below", 2, unit="m above ground", read_by=SCORING, ge=0, le=100)
    clearance: float = key("below it the drone only climbs and sinks", 5, unit="m above ground", ge=1, le=100)


class Route(ConfigModel):
    """Stops along a path, as a walker or a drone in a corridor has them; four headings at each."""

    places: list[GroundPlace] = key(
        "corners of the path, east and north of the exemplar's middle",
        unit="sides of the exemplar",
        min_length=2,
        max_length=1000,
    )
    height: float = key("above the plane of the ground", unit="flying heights", ge=0.01, le=10)
    down: float = key("how far below the horizon the camera looks", 35, unit="degrees", ge=1, le=89)


class _Scene(ConfigModel):
    preset: Name = key("an entry of `presets`", "standard")
    tiling: Name = key("an entry of `tilings`", "auto")


class _PhotographedScene(_Scene):
    candidates: int = key("poses that may be asked for", 250, read_by=POSE_READERS, agents=POSED, ge=1, le=10_000)
    poses: Literal["orbit", "free"] | Route = key(
        "which poses these are: `orbit`, all at the flying height from the exemplar's middle, and looking there; "
        "`free`, any direction, aim point and distance (0.4 to 1.5 flying heights for `agent: render`, else 0.4 to 1); "
        "or a path",
        "orbit",
        read_by=POSE_READERS,
        agents=POSED,
    )
    exemplar: Literal["focus", "whole"] = key(
        "what the last fit of a preset with `choose_with` spends its Gaussians on: `focus`, the windows of the ground "
        "that tiles and objects are cut from, at the resolution of the photos; `whole`, all of the exemplar, for the "
        "reconstruction itself. Ground that is tiled as one (`materials: one`) or inpainted is always fitted whole",
        "focus",
    )


def _materials(default: str):
    return key(
        "`auto`: materials and objects are told apart, each material has its own tiles, and shade and what is rare or "
        "cut off is shown nowhere; `one`: all that was photographed is tiled as one texture; or mask images by "
        "name, as `{lawn: lawn.png, road: road.png, exclude: other.png}`: those materials and no others, and `exclude` "
        "nowhere (docs/photos.md)",
        default,
    )


Materials = Literal["one", "auto"] | Annotated[dict[Name, Text], Field(min_length=1, max_length=9)]


class SyntheticScene(_PhotographedScene):
    """A scene that is rendered, with exact poses."""

    kind: Literal["synthetic"]
    family: Literal["desert", "meadow", "flowers", "grass", "planet", "oasis"] = key(
        "which generator", read_by=(*RENDERED, *CAPTURING), agents=("render",)
    )
    seed: Seed = key("which scene of the family", read_by=(*RENDERED, *CAPTURING), agents=("render",))
    photo_count: int = key("photos that are rendered beforehand", read_by=(*RENDERED, "split_views"), ge=3, le=200)
    start: int | None = key(
        "photos to start from, with `agent: replay`; all if left out", None, read_by=("split_views",), ge=2, le=200
    )
    test: int = key("views that only test", read_by=(*RENDERED, "split_views"), ge=0, le=200)
    min_elevation: float = key(
        "lowest elevation of candidates and of test views",
        30,
        unit="degrees",
        read_by=(*RENDERED, *POSE_READERS),
        agents=("render",),
        ge=5,
        le=85,
    )
    size: int = key(
        "width and height of the photos",
        unit="pixels",
        read_by=(*RENDERED, *POSE_READERS),
        agents=("render",),
        ge=64,
        le=4096,
    )
    materials: Materials = _materials("one")
    agent: SyntheticAgent = key(
        "`render`: photos are rendered at the chosen poses; `replay`: chosen from those rendered beforehand",
        read_by=POSE_READERS,
    )


class PhotoScene(_PhotographedScene):
    """A folder of photos."""

    kind: Literal["photos"]
    folder: Text | Annotated[list[Text], Field(min_length=1)] = key(
        "a folder of photos with its subfolders, or several, or a video (MP4, MOV); from the working directory or the "
        "repository",
        read_by=REGISTERED,
    )
    model: Text | None = key(
        "known cameras: a COLMAP folder, `transforms.json` (nerfstudio) or `reconstruction.json` (OpenSfM)",
        None,
        read_by=REGISTERED,
    )
    size: PhotoSize = key(
        "longer side of undistorted photos, or `native`: their own; none is enlarged",
        1024,
        unit="pixels",
        read_by=REGISTERED,
    )
    start: int | None = key(
        "photos to start from, after test photos were set aside; all if left out, and `agent: replay` then has no "
        "rounds. Else the remaining photos are the pool that its rounds choose from",
        None,
        read_by=("split_views",),
        ge=2,
        le=1000,
    )
    test: int | None = key(
        "photos that are set aside to judge the result; if left out one in ten, and none of fewer than twelve",
        None,
        read_by=("split_views",),
        ge=0,
        le=1000,
    )
    whole: bool = key(
        "`true`: all ground in the photos is fitted and scored, not only the exemplar and a margin",
        False,
        read_by=("split_views", *FITTING),
    )
    focal: float | None = key(
        "where EXIF has none or is wrong", None, unit="mm (35 mm equivalent)", read_by=REGISTERED, ge=4, le=2000
    )
    materials: Materials = _materials("auto")
    masks: Text | None = key(
        "a folder of masks named as the photos: black pixels are not ground. Left out: NAME_mask.* beside a photo, and "
        "a folder `masks` in the photos' folder or beside one called `images`",
        None,
        read_by=REGISTERED,
    )
    agent: PhotoAgent = key(
        "who takes further photos: `replay` takes them from the photos of the folder that are left; `serial` is a "
        "camera rig, `plan` a drone, `handheld` a person",
        "replay",
        read_by=POSE_READERS,
    )
    rig: SerialRig | None = key("the camera rig of `agent: serial`", None, read_by=CAPTURING, agents=("serial",))
    drone: Drone = key("how a drone flies, for `agent: plan`", Drone(), read_by=CAPTURING, agents=("plan",))

    @model_validator(mode="after")
    def _require_rig(self) -> "PhotoScene":
        if self.agent == "serial" and self.rig is None:
            raise ValueError("agent serial needs `rig`: docs/capture.md")
        return self


class FieldScene(_Scene):
    """A finished Gaussian splat instead of photos."""

    kind: Literal["field"]
    field: Text = key("a finished splat: `.ply` of any trainer, plain or compressed, or `.spz`")
    up: Corner | None = key(
        "a direction that points roughly up in the file; the side on which things stand if left out",
        None,
        read_by=("import_field",),
    )
    crop: Annotated[tuple[Corner, Corner], Field(strict=False)] | None = key(
        "lowest and highest corner of the scene in the file, as `[[-5, -5, -1], [5, 5, 2]]`; what is outside is "
        "dropped. If left out, the dense part is the scene",
        None,
        read_by=("import_field",),
    )

    @field_validator("field")
    @classmethod
    def _require_splat(cls, path: str) -> str:
        suffix = Path(path).suffix.lower()
        if suffix == ".sog" or suffix in BY_SUFFIX:
            raise ValueError(advise_conversion(Path(path), BY_SUFFIX.get(suffix, "sog")))
        if suffix not in (".ply", ".spz"):
            raise ValueError("a finished splat ends in .ply or .spz")
        return path

    @model_validator(mode="after")
    def _order_corners(self) -> "FieldScene":
        if self.crop and not all(low < high for low, high in zip(*self.crop, strict=True)):
            raise ValueError("crop: its first corner must be the lower one on every axis")
        return self


SCENES: dict[str, type[_Scene]] = {"synthetic": SyntheticScene, "photos": PhotoScene, "field": FieldScene}
Scene = Annotated[SyntheticScene | PhotoScene | FieldScene, Field(discriminator="kind")]
