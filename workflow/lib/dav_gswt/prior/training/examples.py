"""Examples that the prior learns from: what a field fitted from few photos shows of a world, beside the truth."""

import zipfile
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.files import UNREADABLE, whole
from dav_gswt.geometry import poses
from dav_gswt.geometry.cameras import Camera, look_at
from dav_gswt.geometry.poses import Pose
from dav_gswt.geometry.scene_frame import Extent
from dav_gswt.images import image_files
from dav_gswt.photos.synthetic import camera_layouts
from dav_gswt.photos.training_views import View
from dav_gswt.prior.conditions import Shown, nearest, relative, shown
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.training.worlds import FLYING_HEIGHT, World, world
from dav_gswt.raster import Rasterizer, to_raster_arrays
from dav_gswt.reconstruction import build
from dav_gswt.reconstruction.fitting.photo_colours import sampled

SIZE = 64  # pixels a side of an example
FIELD_OF_VIEW = 55.0  # degrees, as synthetic scenes have it
LEAST_SHOWN = 0.2  # share of the true picture that must not be sky
NEAREST = 0.35  # metres from a camera to the middle of any Gaussian
TRIES = 6  # poses drawn for each example that is asked for, at most
OTHER_EXTENT, EXTENTS = 0.4, (1.05, 1.7)  # share of fits with another extent than 1.25 exemplars: one between
ACROSS = (112, 160, 224)  # pixels of the photos that are fitted: one of these
STEPS = (40, 90)  # of the fit, from and to
MOST_GAUSSIANS = 50_000
POINTS = (150, 1500)  # triangulated points, from and to; their error in pixels:
OFF = 0.4
SHAPES = {  # of the stored arrays, behind the number of examples
    "colour": (SIZE, SIZE, 3),
    "alpha": (SIZE, SIZE),
    "inverse_depth": (SIZE, SIZE),
    "photo": (SIZE, SIZE, 3),
    "relative": (4,),
    "rgba": (SIZE, SIZE, 4),
    "true_inverse_depth": (SIZE, SIZE),
}
MOST_EXAMPLES = 10_000  # in a file
BYTES = "colour", "alpha", "photo", "rgba"  # all others are of half precision


@dataclass(frozen=True)
class Examples:
    """n views: what is known of them, and the truth. rgba: colours over black, and opacity; the sky is transparent.
    inverse_depth: as in Condition."""

    condition: Condition
    rgba: Float32[Array, "n s s 4"]
    inverse_depth: Float32[Array, "n s s"]

    def __len__(self) -> int:
        return len(self.rgba)


def examples(seed: int, count: int) -> Examples:
    """At most `count` views of the world of a seed; fewer where most poses show the sky or stand inside a thing."""
    made, rng = world(seed), np.random.default_rng([seed, 30_000])
    photos = taken(made, rng)
    field = fitted(made, photos, rng)
    small = [image_files.shrink_image(v.image, SIZE, SIZE) for v in photos]
    places = [poses.of_camera(v.name, v.camera, made.frame) for v in photos]
    found = []
    for _ in range(TRIES * count):
        if len(found) == count:
            break
        camera = some_camera(rng, places)
        if not stands_free(made.field, camera):
            continue
        truth = shown(made.field, camera, FLYING_HEIGHT)
        if truth.alpha.mean() >= LEAST_SHOWN:
            pose = poses.of_camera("", camera, made.frame)
            at = nearest(pose, places)
            known = shown(field, camera, FLYING_HEIGHT)
            found.append(_one(known, small[at], relative(places[at], pose, FLYING_HEIGHT), truth))
    return joined([none(), *found])


def stands_free(field: GaussianField, camera: Camera) -> bool:
    """Whether nothing of a field is so near to the camera that it would fill the picture."""
    return bool(((field.means - camera.centre) ** 2).sum(1).min() > NEAREST**2)


def some_rig(rng: np.random.Generator) -> list[tuple[camera_layouts.Place, Array]]:
    """3 to 12 places of photos and what each looks at: a ring, a cap, from one side, or along a flight."""
    n, turn, radius = int(rng.integers(3, 13)), rng.uniform(0, 360), FLYING_HEIGHT * rng.uniform(0.9, 1.05)
    kind = rng.choice(["ring", "cap", "side", "flight"])
    if kind == "ring":
        places = camera_layouts.start_ring(1, 90.0, radius) + camera_layouts.ring(
            n - 1, rng.uniform(45, 75), radius, turn
        )
    elif kind == "cap":
        places = camera_layouts.hemisphere(n, rng.uniform(35, 70), radius, turn)
    elif kind == "side":
        wide = rng.uniform(40, 150)
        places = [(rng.uniform(35, 80), turn + wide * rng.uniform(), radius) for _ in range(n)]
    else:
        places = [(rng.uniform(84, 90), rng.uniform(0, 360), radius) for _ in range(n)]
    far = 1.5 if kind == "flight" else 0.2
    return [(place, np.append(rng.uniform(-far, far, 2), 0)) for place in places]


def taken(made: World, rng: np.random.Generator) -> list[View]:
    """The start photos: noisy, each a little brighter or darker than the next."""
    size, noise, uneven = int(rng.choice(ACROSS)), rng.uniform(0.003, 0.02), rng.uniform(0, 0.05)
    found = []
    for i, (place, target) in enumerate(some_rig(rng)):
        camera = camera_layouts.orbit(*place, target, size, size, FIELD_OF_VIEW)
        truth = shown(made.field, camera, FLYING_HEIGHT)
        image = truth.colour + (1 - truth.alpha)[..., None] * made.sky.behind(camera)
        image = image * np.exp(uneven * rng.normal()) + noise * rng.normal(size=image.shape)
        image = np.clip(image, 0, 1).astype(np.float32)
        found.append(View(f"photo_{i}", camera, image, np.ones(image.shape[:2], np.float32)))
    return found


def matched(made: World, photos: list[View], rng: np.random.Generator) -> tuple[Float[Array, "n 3"], Array]:
    """What structure from motion would find: places that at least two photos see, a little off, and their colours."""
    least, most = np.log(POINTS)
    each = int(np.exp(rng.uniform(least, most))) // len(photos) + 1
    points, colours = [], []
    for view in photos:
        seen = Rasterizer().forward(**to_raster_arrays(made.field), camera=view.camera)
        rows, columns = rng.integers(0, seen.alpha.shape, (each, 2)).T
        solid = seen.alpha[rows, columns] > 0.9
        rows, columns = rows[solid], columns[solid]
        origins, steps = view.camera.rays()
        depth = (seen.depth / np.maximum(seen.alpha, 1e-6))[rows, columns]
        off = OFF / view.camera.fx * depth[:, None] * rng.normal(size=(len(rows), 3)) * [1, 1, 2]
        points.append(origins[rows, columns] + depth[:, None] * steps[rows, columns] + off)
        colours.append(view.image[rows, columns])
    points, colours = np.concatenate(points), np.concatenate(colours).astype(float)
    often = sum(sampled(points, view)[1].astype(int) for view in photos) >= 2
    return points[often], colours[often]


def fitted(made: World, photos: list[View], rng: np.random.Generator) -> GaussianField:
    """The program's own coarse fit of the photos, small and short; some of more or less ground than usual."""
    steps = int(rng.integers(*STEPS, endpoint=True))
    quality = build.Quality(photos[0].camera.width, 1.25, MOST_GAUSSIANS, steps, 0, 0)
    frame = made.frame
    if rng.uniform() < OTHER_EXTENT:
        share = rng.uniform(*EXTENTS) / 1.25
        extent = Extent(*(share * at for at in astuple(frame.extent)))
        frame = replace(frame, extent=extent)
    return build.fit(frame, photos, *matched(made, photos, rng), quality, rng, margin=0.5 * (EXTENTS[1] - 1)).field


def some_camera(rng: np.random.Generator, places: list[Pose]) -> Camera:
    """A camera over the exemplar: anywhere from 10 degrees up, or near a photo; it may look past the middle."""
    radius, azimuth = FLYING_HEIGHT * rng.uniform(0.5, 1.1), rng.uniform(0, 360)
    elevation = rng.uniform(10, 90)
    if rng.uniform() < 0.4:
        elevation = np.degrees(np.arcsin(rng.uniform(np.sin(np.radians(25)), 1)))
    if rng.uniform() < 0.2:
        photo = places[rng.integers(len(places))]
        azimuth, elevation = photo.azimuth + 8 * rng.normal(), np.clip(photo.elevation + 8 * rng.normal(), 10, 90)
        radius = photo.radius * rng.uniform(0.85, 1.1)
    target = np.zeros(3)
    if rng.uniform() < 0.4:
        target[:2] = rng.uniform(-2.5, 2.5, 2)
    camera = camera_layouts.orbit(elevation, azimuth, radius, np.zeros(3), SIZE, SIZE, FIELD_OF_VIEW)
    return camera if not target.any() else turned(camera, target)


def turned(camera: Camera, target: Float[Array, "3"]) -> Camera:
    """The camera where it is, looking elsewhere."""
    rotation, translation = look_at(camera.centre, target, -camera.rotation[1])
    return replace(camera, rotation=rotation, translation=translation)


def _one(known: Shown, photo: Array, apart: Array, truth: Shown) -> Examples:
    told = known.colour, known.alpha, known.inverse_depth, photo, apart
    rgba = np.concatenate([truth.colour, truth.alpha[..., None]], -1)
    return Examples(Condition(*(a[None] for a in told)), rgba[None], truth.inverse_depth[None])


def none() -> Examples:
    """No example."""
    blank = {name: np.zeros((0, *shape), np.float32) for name, shape in SHAPES.items()}
    return _of_arrays(blank)


def joined(parts: list[Examples]) -> Examples:
    """All examples of all parts, in their order."""
    names = [f.name for f in fields(Condition)]
    condition = Condition(*(np.concatenate([getattr(p.condition, n) for p in parts]) for n in names))
    rest = (np.concatenate([getattr(p, n) for p in parts]) for n in ("rgba", "inverse_depth"))
    return Examples(condition, *rest)


def write(path: Path | str, made: Examples) -> None:
    """Write examples: colours and opacities in bytes, all else in half precision. Raises: ValueError: see check."""
    if len(made):
        made.condition.check()
    with whole(path) as part, part.open("wb") as file:
        np.savez_compressed(file, **{name: _packed(name, a) for name, a in _arrays(made).items()})


def read(path: Path | str) -> Examples:
    """Read what `write` wrote.

    Raises: InputError: not such a file, an array that is missing, of another type or shape, or not finite, by name.
    """
    try:
        with zipfile.ZipFile(path) as stored:
            _check_headers(stored)
        with np.load(path, allow_pickle=False) as stored:
            found = {name: stored[name] for name in SHAPES}
    except UNREADABLE as error:
        raise InputError(f"{path}: not readable as examples ({error}); make them again") from error
    if bad := [name for name, a in found.items() if not np.isfinite(a).all()]:
        raise InputError(f"{path}: {bad[0]} holds numbers that are not finite")
    return _of_arrays({name: _unpacked(name, a) for name, a in found.items()})


def _check_headers(stored: zipfile.ZipFile) -> None:
    """Raises: ValueError: types and shapes that are not those of examples, before anything is allocated for them."""
    count = None
    for name, shape in SHAPES.items():
        if f"{name}.npy" not in stored.namelist():
            raise ValueError(f"{name} is missing")
        with stored.open(f"{name}.npy") as file:
            np.lib.format.read_magic(file)
            found, _, kind = np.lib.format.read_array_header_1_0(file)
        count = found[0] if count is None and found else count
        wanted = np.uint8 if name in BYTES else np.float16
        if found != (count, *shape) or kind != wanted or count > MOST_EXAMPLES:
            raise ValueError(f"{name} is {kind} of shape {found}, not {np.dtype(wanted)} of {(count, *shape)}")


def _arrays(made: Examples) -> dict[str, Array]:
    known = {f.name: getattr(made.condition, f.name) for f in fields(Condition)}
    return known | {"rgba": made.rgba, "true_inverse_depth": made.inverse_depth}


def _of_arrays(values: dict[str, Array]) -> Examples:
    known = {f.name: values[f.name] for f in fields(Condition)}
    return Examples(Condition(**known), values["rgba"], values["true_inverse_depth"])


def _packed(name: str, a: Array) -> Array:
    return np.round(255 * np.clip(a, 0, 1)).astype(np.uint8) if name in BYTES else a.astype(np.float16)


def _unpacked(name: str, a: Array) -> Float32[Array, "*shape"]:
    return a.astype(np.float32) / np.float32(255) if name in BYTES else a.astype(np.float32)
