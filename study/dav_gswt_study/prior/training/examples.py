"""Training examples: what a field fitted from few photos of a procedural world shows of a view, and the true view."""

from dataclasses import astuple, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.camera_layouts import Place
from dav_gswt.geometry.cameras import Camera, look_at
from dav_gswt.geometry.poses import Pose, pose_of_camera
from dav_gswt.geometry.scene_frame import Extent
from dav_gswt.images import image_files
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.prior.interface import Condition, RenderedView, find_nearest, relative_pose, render_view
from dav_gswt.raster import make_rasterizer, to_raster_arrays
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.photo_colours import sample_colours
from dav_gswt_study.prior.training.example_files import SIZE, Examples, concatenate, empty_examples
from dav_gswt_study.prior.training.worlds import FLYING_HEIGHT, World, make_world

FIELD_OF_VIEW = 55.0  # degrees, as of synthetic scenes
LEAST_COVER = 0.2  # share of the true picture that must not be sky
CLEARANCE = 0.35  # metres from a camera to the centre of any Gaussian
TRIES = 6  # poses drawn per requested example, at most
OTHER_EXTENT, EXTENTS = 0.4, (1.05, 1.7)  # share of fits whose extent is not 1.25 exemplars, and its range then
PHOTO_SIZES = (112, 160, 224)  # pixels per side of the fitted photos
STEPS = (40, 90)  # of the fit, least and most
MOST_GAUSSIANS = 50_000
POINTS = (150, 1500)  # triangulated points, least and most
POINT_ERROR = 0.4  # pixels


def make_examples(seed: int, count: int) -> Examples:
    """At most `count` views of the world of a seed; fewer if most poses see the sky or stand inside an object."""
    world, rng = make_world(seed), np.random.default_rng([seed, 30_000])
    photos = take_photos(world, rng)
    field = fit_field(world, photos, rng)
    small = [image_files.shrink_image(v.image, SIZE, SIZE) for v in photos]
    references = [pose_of_camera(v.name, v.camera, world.frame) for v in photos]
    examples = []
    for _ in range(TRIES * count):
        if len(examples) == count:
            break
        camera = draw_camera(rng, references)
        if not is_clear(world.field, camera):
            continue
        truth = render_view(world.field, camera, FLYING_HEIGHT)
        if truth.alpha.mean() >= LEAST_COVER:
            pose = pose_of_camera("", camera, world.frame)
            at = find_nearest(pose, references)
            render = render_view(field, camera, FLYING_HEIGHT)
            relative = relative_pose(references[at], pose, FLYING_HEIGHT)
            examples.append(_make_example(render, small[at], relative, truth))
    return concatenate([empty_examples(), *examples])


def _make_example(render: RenderedView, photo: Array, relative: Array, truth: RenderedView) -> Examples:
    condition = render.colour, render.alpha, render.inverse_depth, photo, relative
    rgba = np.concatenate([truth.colour, truth.alpha[..., None]], -1)
    return Examples(Condition(*(a[None] for a in condition)), rgba[None], truth.inverse_depth[None])


def is_clear(field: GaussianField, camera: Camera) -> bool:
    """Whether no Gaussian is so near to the camera that it would fill the picture."""
    return bool(((field.means - camera.centre) ** 2).sum(1).min() > CLEARANCE**2)


def draw_rig(rng: np.random.Generator) -> list[tuple[Place, Float[Array, "3"]]]:
    """3 to 12 camera places and their targets: a ring, a cap, a sector, or a flight."""
    n, turn, radius = int(rng.integers(3, 13)), rng.uniform(0, 360), FLYING_HEIGHT * rng.uniform(0.9, 1.05)
    kind = rng.choice(["ring", "cap", "side", "flight"])
    if kind == "ring":
        top = camera_layouts.start_ring(1, 90.0, radius)
        places = top + camera_layouts.ring(n - 1, rng.uniform(45, 75), radius, turn)
    elif kind == "cap":
        places = camera_layouts.hemisphere(n, rng.uniform(35, 70), radius, turn)
    elif kind == "side":
        width = rng.uniform(40, 150)
        places = [(rng.uniform(35, 80), turn + width * rng.uniform(), radius) for _ in range(n)]
    else:
        places = [(rng.uniform(84, 90), rng.uniform(0, 360), radius) for _ in range(n)]
    spread = 1.5 if kind == "flight" else 0.2
    return [(place, np.append(rng.uniform(-spread, spread, 2), 0)) for place in places]


def take_photos(world: World, rng: np.random.Generator) -> list[TrainingView]:
    """The start photos: noisy, each with an exposure of its own."""
    size, noise, exposure = int(rng.choice(PHOTO_SIZES)), rng.uniform(0.003, 0.02), rng.uniform(0, 0.05)
    photos = []
    for i, (place, target) in enumerate(draw_rig(rng)):
        camera = camera_layouts.orbit(*place, target, size, size, FIELD_OF_VIEW)
        truth = render_view(world.field, camera, FLYING_HEIGHT)
        image = truth.colour + (1 - truth.alpha)[..., None] * world.sky.render(camera)
        image = image * np.exp(exposure * rng.normal()) + noise * rng.normal(size=image.shape)
        image = np.clip(image, 0, 1).astype(np.float32)
        photos.append(TrainingView(f"photo_{i}", camera, image, np.ones(image.shape[:2], np.float32)))
    return photos


def simulate_points(
    world: World, photos: list[TrainingView], rng: np.random.Generator
) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
    """Points as of structure from motion, and their colours: surface points seen by two photos or more, with errors."""
    least, most = np.log(POINTS)
    each = int(np.exp(rng.uniform(least, most))) // len(photos) + 1
    points, colours = [], []
    for view in photos:
        render = make_rasterizer().forward(**to_raster_arrays(world.field), camera=view.camera)
        rows, columns = rng.integers(0, render.alpha.shape, (each, 2)).T
        solid = render.alpha[rows, columns] > 0.9
        rows, columns = rows[solid], columns[solid]
        origins, steps = view.camera.rays()
        depth = (render.depth / np.maximum(render.alpha, 1e-6))[rows, columns]
        error = POINT_ERROR / view.camera.fx * depth[:, None] * rng.normal(size=(len(rows), 3)) * [1, 1, 2]
        points.append(origins[rows, columns] + depth[:, None] * steps[rows, columns] + error)
        colours.append(view.image[rows, columns])
    points, colours = np.concatenate(points), np.concatenate(colours).astype(float)
    matched = np.sum([sample_colours(points, view)[1].astype(int) for view in photos], axis=0) >= 2
    return points[matched], colours[matched]


def fit_field(world: World, photos: list[TrainingView], rng: np.random.Generator) -> GaussianField:
    """The coarse fit of the reconstruction, small and short; in some worlds of more or less ground than usual."""
    steps = int(rng.integers(*STEPS, endpoint=True))
    settings = FitSettings(fit_size=photos[0].camera.width, spacing=1.25, max_gaussians=MOST_GAUSSIANS, steps=steps)
    frame = world.frame
    if rng.uniform() < OTHER_EXTENT:
        share = rng.uniform(*EXTENTS) / 1.25
        extent = Extent(*(share * at for at in astuple(frame.extent)))
        frame = replace(frame, extent=extent)
    points, colours = simulate_points(world, photos, rng)
    given = StartViews(frame, photos, points, colours, margin=0.5 * (EXTENTS[1] - 1))
    return fit_coarse_field(given, settings, rng).field


def draw_camera(rng: np.random.Generator, photos: list[Pose]) -> Camera:
    """A random camera over the exemplar, at elevations from 10 degrees, sometimes near a photo or looking aside."""
    radius, azimuth = FLYING_HEIGHT * rng.uniform(0.5, 1.1), rng.uniform(0, 360)
    elevation = rng.uniform(10, 90)
    if rng.uniform() < 0.4:
        elevation = np.degrees(np.arcsin(rng.uniform(np.sin(np.radians(25)), 1)))
    if rng.uniform() < 0.2:
        photo = photos[rng.integers(len(photos))]
        azimuth, elevation = photo.azimuth + 8 * rng.normal(), np.clip(photo.elevation + 8 * rng.normal(), 10, 90)
        radius = photo.radius * rng.uniform(0.85, 1.1)
    target = np.zeros(3)
    if rng.uniform() < 0.4:
        target[:2] = rng.uniform(-2.5, 2.5, 2)
    camera = camera_layouts.orbit(elevation, azimuth, radius, np.zeros(3), SIZE, SIZE, FIELD_OF_VIEW)
    return camera if not target.any() else aim_camera(camera, target)


def aim_camera(camera: Camera, target: Float[Array, "3"]) -> Camera:
    """The camera at the same place, looking at another target."""
    rotation, translation = look_at(camera.centre, target, -camera.rotation[1])
    return replace(camera, rotation=rotation, translation=translation)
