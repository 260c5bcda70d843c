"""Readers of artefacts: each returns the scene of one kind of file.

`@reader` names the file names and suffixes that a function opens. Its keyword arguments are the options of the command
line that it accepts. A folder is searched for the names in the order in which the readers are defined.
"""

import inspect
from collections.abc import Callable
from dataclasses import asdict, replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from jaxtyping import Float, UInt8
from numpy import ndarray as Array
from scipy.spatial.transform import Rotation
from scipy.special import expit

from dav_gswt.bundle import store as bundles
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, read_field
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import pose_offset
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.images import image_files
from dav_gswt.inspect.plot import BLACK, UNCERTAINTY_MAP, Colour, Scene, fit_bar, make_bar, map_colours, to_bytes
from dav_gswt.lod import store as levels
from dav_gswt.paths import decode_path, related_folder
from dav_gswt.photos.capture_record import read_capture_record
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction.ground import Ground, read_ground
from dav_gswt.tiles import store as tiles
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.layout import EDGES, LABELS, arrange_torus
from dav_gswt.views.policies import candidate_values
from dav_gswt.views.scores import apply_uncertainty, read_pose_maps, read_scores
from dav_gswt.views.selection import read_pose_selection

Reader = Callable[..., Scene]
READERS: dict[str, Reader] = {}
MIN_OPACITY = 0.1  # peak opacity below which a Gaussian is left out: solids would hide what lies behind it
FLAT_RATIO = 0.35  # a Gaussian whose least axis is shorter than this share of the middle one is drawn flat
GAP = 0.2  # between two fields or tiles, in their widths
COLOURS = ("colour", "uncertainty")
PATCH_COLOURS = [(187, 187, 187), (68, 119, 170), (238, 102, 119), (34, 136, 51), (204, 187, 68), (102, 204, 238)]
PATCH_COLOURS += [(170, 51, 119), (153, 102, 51), (0, 0, 0)]
TILES_PER_ROW = 4
HEXAGON = np.stack([np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3), np.zeros(6)], -1)
OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])
SIDES = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
DEPTH = 0.12  # flying heights from a camera to its picture
PHOTO_SIDE = 160  # pixels of a photo's longer side
BALL, CHOSEN_BALL, NUMBER = 0.018, 0.03, 0.07  # radii and height, in radii of the hemisphere
ROLES = {"start": (34, 136, 51), "pool": (68, 119, 170), "test": (238, 102, 119), "photo": (90, 90, 90)}
ROLES |= {"taken for a round": (170, 51, 119)}
GROUND_NAMES = {"exemplar": (230, 140, 0), "seen by a photo": (120, 120, 120)}
ASPECT, LETTER = 1.6, 0.05  # of all pictures side by side, width over height; height of letters, in picture widths
MAX_PICTURES, MAX_SIDE = 60, 1024  # pictures of a scene, and pixels of a picture's longer side

Vector = Float[Array, "3"]


def reader(*names: str) -> Callable[[Reader], Reader]:
    """Register a reader for file names, or for suffixes such as `.ply`."""

    def register(function: Reader) -> Reader:
        READERS.update(dict.fromkeys(names, function))
        return function

    return register


def read_scene(path: Path, most: int, **given: Any) -> Scene:
    """The scene of an artefact. most: Gaussians or cells that are drawn. given: options, None where not given.

    Raises: InputError: there is no such file, its kind is unknown, or it is damaged.
    """
    inside = [path / name for name in READERS if (path / name).is_file()]
    file = inside[0] if inside else path
    read = READERS.get(file.name) or READERS.get(file.suffix.lower())
    if not file.exists():
        raise InputError(f"{path}: there is no such file or folder")
    if read is None or not file.is_file():
        raise InputError(f"{path}: not understood; files that are understood: {', '.join(READERS)}")
    known = [name for name in inspect.signature(read).parameters if name not in ("path", "most")]
    given = {name: value for name, value in given.items() if value is not None}
    for name in given.keys() - known:
        accepted = ", ".join(f"--{option}" for option in known) or "no options"
        raise InputError(f"--{name}: means nothing for {path}, which knows {accepted}")
    try:
        return read(file, most=most, **given)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        why = f"{type(error).__name__}: {error}"
        raise InputError(f"{file}: not as the workflow writes it ({why}); make it again") from error


def find_above(path: Path, name: str, why: str, folders: int | None = None) -> Path:
    """A file of this name in the nearest folder above a path. folders: how many are searched.

    The files of a fit lie in the folder of its scores or in the one above: `folders` is 2 for them.
    Raises: InputError: there is none; why: what it is needed for.
    """
    files = (folder / name for folder in path.resolve().parents[:folders])
    found = next((file for file in files if file.is_file()), None)
    if found is None:
        raise InputError(f"{path}: {name} is in no folder above it, {why}; leave it in its result tree")
    return found


def choose(option: str, value: str | None, names: tuple[str, ...], path: Path) -> str:
    """The value of an option, by default the first of names. Raises: InputError: it is none of names."""
    if value is not None and value not in names:
        raise InputError(f"--{option} {value}: {path} has {', '.join(names[:20])}")
    return value or names[0]


@reader("levels.json")
def read_levels(path: Path, *, most: int, colour: str | None = None, level: int | None = None) -> Scene:
    """All levels of detail side by side, the finest in the west, or one of them."""
    fields = levels.read_levels(path.parent).fields
    known = tuple(f"{number}" for number in range(len(fields)))
    numbers = range(len(fields)) if level is None else [int(choose("level", f"{level}", known, path))]
    step = (1 + GAP) * float(np.ptp(np.quantile(fields[0].means[:, 0], [0.002, 0.998])))
    placed = {f"level {k}": (fields[k], np.array([i * step, 0, 0])) for i, k in enumerate(numbers)}
    scene = show_fields(path, placed, choose("colour", colour, COLOURS, path), most)
    scene.notes.append(f"{', '.join(placed)} of {len(fields)} levels")
    return scene


@reader("field.ply", ".ply")
def read_one_field(path: Path, *, most: int, colour: str | None = None) -> Scene:
    """A field of the workflow, or of another program."""
    return show_fields(path, {"": (read_field(path), np.zeros(3))}, choose("colour", colour, COLOURS, path), most)


def show_fields(
    path: Path, placed: dict[str, tuple[GaussianField, Vector]], by: str, most: int, cut: TileSet | None = None
) -> Scene:
    """Fields by name, each with the place of its origin. cut: the tile set, if `by` is patch: fields are its tiles."""
    scene = Scene(str(path), [], bars={"uncertainty": make_bar(0.0, 1.0)} if by == "uncertainty" else {})
    boxes, drawn = [], 0
    for name, (field, corner) in placed.items():
        kept = thin_field(field, most // len(placed))
        if not len(kept):
            continue
        colours = compute_colours(kept, by) if cut is None else colour_patches(kept, cut, int(name))
        kept = replace(kept, means=kept.means + corner.astype(np.float32))
        add_solids(scene, kept, colours)
        low, high = np.quantile(kept.means, [0.002, 0.998], axis=0)  # outliers are left out of the first view
        size = high[0] - low[0]
        if len(placed) > 1:
            scene.add_label(name, np.array([(low[0] + high[0]) / 2, low[1] - 0.6 * GAP * size, low[2]]), 0.1 * size)
        boxes.append((low, high))
        drawn += len(kept)
    if not boxes:
        raise InputError(f"{path}: no Gaussian is more opaque than {MIN_OPACITY:g}; there is nothing to draw")
    total = sum(len(field) for field, _ in placed.values())
    scene.notes.append(f"{drawn} of {total} Gaussians, by {by}")
    scene.box = np.array([np.min([low for low, _ in boxes], 0), np.max([high for _, high in boxes], 0)])
    return scene


def thin_field(field: GaussianField, most: int) -> GaussianField:
    """At most `most` of the Gaussians that are opaque enough to be visible, evenly by their order in the file.

    They are enlarged so that they cover as much.
    """
    visible = field[expit(field.opacity_logits) >= MIN_OPACITY]
    if len(visible) <= most:
        return visible
    kept = visible[np.linspace(0, len(visible) - 1, max(1, most)).astype(int)]
    return replace(kept, log_scales=kept.log_scales + np.float32(0.5 * np.log(len(visible) / len(kept))))


def compute_colours(field: GaussianField, by: str) -> UInt8[Array, "n 3"]:
    """A colour for each Gaussian. by: one of COLOURS."""
    return map_colours(make_bar(0.0, 1.0), field.uncertainty) if by == "uncertainty" else to_bytes(field.base_colours)


def add_solids(scene: Scene, field: GaussianField, colours: UInt8[Array, "n 3"]) -> None:
    """Add Gaussians at one standard deviation.

    A flat one is a hexagon of the ellipse's area, another one an octahedron of the ellipsoid's volume.
    """
    scales = np.exp(field.log_scales.astype(float))
    order = np.argsort(-scales, axis=1, kind="stable")
    scales = np.take_along_axis(scales, order, 1)
    rotations = Rotation.from_quat(field.quats[:, [1, 2, 3, 0]].astype(float)).as_matrix()
    axes = np.take_along_axis(rotations, order[:, None], 2) * scales[:, None]  # columns are the axes, longest first
    flat = field.ground | (scales[:, 2] < FLAT_RATIO * scales[:, 1])
    disc, ball = (np.pi / (1.5 * 3**0.5)) ** 0.5, np.pi ** (1 / 3)  # scales of equal area and volume
    for rows, shape, faces in ((flat, disc * HEXAGON, np.arange(6)[None]), (~flat, ball * OCTAHEDRON, SIDES)):
        points = field.means[rows][:, None] + np.einsum("nij,vj->nvi", axes[rows], shape)
        if len(points):
            cells = (faces + len(shape) * np.arange(len(points))[:, None, None]).reshape(-1, faces.shape[1])
            mesh = pv.PolyData.from_regular_faces(points.reshape(-1, 3).astype(np.float32), cells)
            scene.add(mesh, np.repeat(colours[rows], len(faces), 0))


@reader("seams.json", "labels.npz")
def read_tile_set(path: Path, *, most: int, colour: str | None = None, level: int = 0) -> Scene:
    """A set of tiles, with --colour patch in the colours of the patches that they are cut from."""
    seams = path.parents[1] / "seams.json" if path.name == "labels.npz" else path
    cut = tiles.read_tiles(seams.parent / "tiles", seams, seams.parents[1] / "levels")
    by = choose("colour", colour, (*COLOURS, "patch"), path)
    scene = _show_tiles(seams, cut.fields, cut.side, by, level, most, cut if by == "patch" else None)
    scene.names = dict(zip(LABELS, PATCH_COLOURS, strict=True)) if by == "patch" else {}
    return scene


@reader("davgswt.json")
def read_bundle(path: Path, *, most: int, colour: str | None = None, level: int = 0) -> Scene:
    """The quantized tiles of a bundle."""
    bundle = bundles.read_bundle(path.parent)
    by = choose("colour", colour, COLOURS, path)
    return _show_tiles(path, bundle.fields(), bundle.manifest.tile_side, by, level, most)


def _show_tiles(
    path: Path,
    fields: list[list[GaussianField]],
    side: float,
    by: str,
    level: int,
    most: int,
    cut: TileSet | None = None,
) -> Scene:
    """All tiles of a level, so that neighbours match."""
    shown = fields[int(choose("level", f"{level}", tuple(f"{number}" for number in range(len(fields))), path))]
    placed = {f"{tile}": (shown[tile], corner) for tile, corner in place_tiles(len(shown), side * (1 + GAP))}
    scene = show_fields(path, placed, by, most, cut)
    scene.notes.append(f"{len(shown)} tiles, {len(fields)} levels, {side:.4g} wide; level {level}")
    scene.viewer = (-0.25, -1.0, 1.3)
    return scene


def place_tiles(count: int, step: float) -> list[tuple[int, Float[Array, "3"]]]:
    """Tiles and their south-western corners: each variant's sixteen four by four, neighbours' edges of one colour."""
    return [
        (int(tile), np.array([(TILES_PER_ROW * variant + column) * step, row * step, 0.0]))
        for variant in range(count // EDGES)
        for (row, column), tile in np.ndenumerate(arrange_torus(variant)[1:-1, 1:-1])
    ]


def colour_patches(field: GaussianField, cut: TileSet, tile: int) -> UInt8[Array, "n 3"]:
    """The colour of the patch that each Gaussian lies over; of the nearest one beyond the tile."""
    last = cut.labels.shape[1] - 1
    column, row = np.clip(field.means[:, :2] / cut.spacing, 0, last).astype(int).T
    return np.array(PATCH_COLOURS, np.uint8)[cut.labels[tile][row, column]]


@reader("ground.json", "views.json", "capture.json")
def read_photos(path: Path, *, most: int) -> Scene:
    """photos/ and its model; views.json: by what each photo is for; capture.json: with the photos of a round."""
    from dav_gswt.photos.colmap_model import read_colmap_model  # here, not above: it loads pycolmap

    scene, (frame, folder) = Scene(str(path), []), find_frame(path)
    model, depth = read_colmap_model(folder / "sparse"), DEPTH * frame.flying_height
    split = asdict(read_view_split(path)) if path.name == "views.json" else {}
    roles = {name: role for role, names in split.items() for name in names}
    shots = [
        (camera, roles.get(name, "photo"), folder / "images" / name)
        for name, camera in zip(model.names, model.cameras, strict=True)
    ]
    if path.name == "capture.json":
        taken = read_capture_record(path.parent)
        shots += [(photo.camera, "taken for a round", path.parent / photo.name) for photo in taken]
    for camera, role, file in shots:
        scene.names[role] = ROLES[role]
        add_frustum(scene, camera, depth, ROLES[role], file)
    if len(model.points):
        scene.add(pv.PolyData(model.points.astype(np.float32)), to_bytes(model.colours), style="points", point_size=3.0)
    _add_ground(scene, frame, np.array([camera.centre for camera, _, _ in shots]).reshape(-1, 3))
    scene.notes = [f"{len(shots)} cameras, {len(model.points)} points; unit: {frame.unit[:40]}"]
    return scene


def find_frame(path: Path) -> tuple[SceneFrame, Path]:
    """The frame of the scene that a file belongs to, and its folder photos/. Raises: InputError: there is none."""
    if path.name != "ground.json":
        path = find_above(path, "photos/ground.json", "which says where its scene lies")
    return read_scene_frame(path), path.parent


def _add_ground(scene: Scene, frame: SceneFrame, eyes: Float[Array, "n 3"]) -> None:
    """Add the borders of the exemplar and of all visible ground. The first view shows the exemplar and the eyes."""
    square = frame.exemplar
    for area, colour in zip((square, frame.extent), GROUND_NAMES.values(), strict=True):
        border = pv.Box((area.west, area.east, area.south, area.north, 0.0, 0.0)).extract_all_edges()
        scene.add(border, colour, line_width=3.0)
    points = np.concatenate([eyes, [[square.west, square.south, 0.0], [square.east, square.north, 0.0]]])
    scene.box = np.array([points.min(0), points.max(0)])
    scene.names |= GROUND_NAMES


def add_frustum(scene: Scene, camera: Camera, depth: float, colour: Colour, photo: Path | None = None) -> None:
    """Add a camera as the pyramid of its view, `depth` deep, with its photo as the base, if the file exists."""
    w, h = camera.width, camera.height
    pixels = np.array([[0, 0], [w, 0], [w, h], [0, h]])
    rays = np.c_[(pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy], np.ones(4)] @ camera.rotation
    corners = camera.centre + depth * rays
    points = np.concatenate([corners, camera.centre[None]])
    scene.add(pv.Pyramid(points).extract_all_edges(), colour, line_width=2.0)
    if photo is not None and photo.is_file():
        small = image_files.shrink_to(image_files.read_photo(photo), PHOTO_SIDE)
        scene.add_picture(to_bytes(small), corners[0], corners[1] - corners[0], corners[3] - corners[0])


@reader("poses.json", "scores.csv")
def read_poses(path: Path, *, most: int, colour: str | None = None) -> Scene:
    """The candidates by their scores; of poses.json those by which its poses were chosen, and these are marked."""
    source = find_scores(path) if path.name == "poses.json" else path
    (frame, _), table = find_frame(source), read_scores(source)
    if not len(table):
        raise InputError(f"{source}: no candidate is in it: none was left to choose from")
    label, values = candidate_values(table, float(decode_path(path.resolve()).get("lam", 0.0)))
    if colour is not None:
        label = choose("colour", colour, tuple(table.terms), source)
        values = table.terms[label]
    title, _, unit = label.partition(", ")
    bar, middle = fit_bar(values), frame.exemplar.centre
    tint, at = map_colours(bar, values), middle + np.array([pose_offset(pose) for pose in table.poses])
    radius = float(np.median(np.linalg.norm(at - middle, axis=1)))
    names = [pose.name for pose in read_pose_selection(path).poses] if path.name == "poses.json" else []
    if unknown := set(names) - set(table.names):
        raise InputError(f"{path}: {min(unknown)} is not among the scored poses; give the poses of the round after")
    chosen = [table.names.index(name) for name in names]
    notes = [f"{len(table)} candidates; {len(chosen)} chosen, numbered in order"]
    scene = Scene(str(path), notes + ([f"{title}: {unit}"] if unit else []), bars={title: bar})
    rest = np.setdiff1d(np.arange(len(table)), chosen)
    for rows, size in ((rest, BALL), (np.array(chosen, int), CHOSEN_BALL)):
        if len(rows):
            ball = pv.Icosphere(radius=size * radius, nsub=2)
            balls = pv.PolyData(at[rows].astype(np.float32)).glyph(geom=ball, scale=False, orient=False)
            scene.add(balls, np.repeat(tint[rows], ball.n_points, 0))
    for number, k in enumerate(chosen, 1):
        scene.add(pv.Line(middle, at[k]), BLACK, line_width=2.0)
        scene.add_label(f"{number}", at[k] + [0, 0, (CHOSEN_BALL + NUMBER) * radius], NUMBER * radius, upright=True)
    field = thin_field(read_field(find_above(source, "field.ply", "which was scored", folders=2)), most)
    add_solids(scene, field, compute_colours(field, "colour"))
    _add_ground(scene, frame, at)
    return scene


def find_scores(poses: Path) -> Path:
    """The scores that a round's poses were chosen by, of another preset if that chose them.

    Raises: InputError: they are not where the workflow puts them.
    """
    poses = poses.resolve()
    number = int(decode_path(poses).get("t", 0))
    if not number:
        raise InputError(f"{poses}: lies in no round of the result tree; give its scores.csv")
    by = read_pose_selection(poses).chosen_with
    of = ({"preset": by} if by else {}) | ({} if number == 1 else {"t": number - 1})
    return related_folder(poses, "scored" if number == 1 else "round", **of) / "scores.csv"


@reader("maps.npz")
def read_map_file(
    path: Path, *, most: int, colour: str | None = None, part: str | None = None, channel: str | None = None
) -> Scene:
    """The field by the uncertainty that its maps gave it; with --part or --channel the maps themselves."""
    maps, uncertainty = read_pose_maps(path)
    if part is not None or channel is not None:
        known = {"opacity": maps.opacity} | ({} if maps.w2_sq is None else {"w2_sq": maps.w2_sq})
        parts = {name: {key: values[i] for key, values in known.items()} for i, name in enumerate(maps.names)}
        return _show_pictures(path, parts, part, channel)
    field = read_field(find_above(path, "field.ply", "whose Gaussians it describes", folders=2))
    field = apply_uncertainty(field, uncertainty.astype(np.float32))
    by = choose("colour", colour or "uncertainty", COLOURS, path)
    return show_fields(path, {"": (field, np.zeros(3))}, by, most)


@reader("materials.json", ".exr")
def read_exr(path: Path, *, most: int, part: str | None = None, channel: str | None = None) -> Scene:
    """A ground grid, or the part `above` if it is named, as a surface; anything else as pictures.

    The pictures of materials.json say which material, object and excluded ground each cell of the exemplar belongs to.
    """
    path = path.with_suffix(".exr")
    parts = image_files.read_exr_parts(path)
    first, facts = next(iter(parts.values()))
    if len(parts) == 1 and "ground_west" in facts:
        return _show_surface(path, read_ground(path), first, channel, most)
    if part == "above" and part in parts:
        grid = read_ground(find_above(path, "ground.exr", f"on which its part {part} is drawn", folders=2))
        return _show_surface(path, grid, parts[part][0], channel, most)
    return _show_pictures(path, {name: channels for name, (channels, _) in parts.items()}, part, channel)


def _show_pictures(path: Path, parts: dict[str, dict[str, Array]], part: str | None, channel: str | None) -> Scene:
    """Each selected channel of each selected part, in rows from the top left, with one scale for each channel."""
    selected = parts if part is None else {part: parts[choose("part", part, tuple(parts), path)]}
    if channel is not None:
        choose("channel", channel, tuple(sorted({name for each in selected.values() for name in each})), path)
    found = [(name, key, values) for name, channels in selected.items() for key, values in channels.items()]
    shown = [each for each in found if channel in (None, each[1]) and each[2].ndim == 2][:MAX_PICTURES]
    if not shown:
        raise InputError(f"{path}: has no pictures")
    values = {key: np.concatenate([v.ravel() for _, other, v in shown if other == key]) for _, key, _ in shown}
    bars = {key: fit_bar(each, _choose_map(key)) for key, each in values.items()}
    notes = [f"parts: {len(parts)}; pictures: {len(shown)} of {len(found)}; grey: not a number"]
    scene = Scene(str(path), notes, bars=bars, viewer=(0.0, 0.0, 1.0))
    aspect = max(values.shape[0] / values.shape[1] for _, _, values in shown)
    columns = min(len(shown), ceil((len(shown) * ASPECT * aspect) ** 0.5))
    for i, (name, key, values) in enumerate(shown):
        at = np.array([(i % columns) * 1.12, -(i // columns) * (aspect + 0.12 + LETTER), 0.0])
        height, step = values.shape[0] / values.shape[1], ceil(max(values.shape) / MAX_SIDE)
        picture = map_colours(bars[key], values[::step, ::step])
        scene.add_picture(picture, at, np.array([1.0, 0, 0]), np.array([0.0, -height, 0]))
        scene.add_label(f"{name} {key}".strip(), at + [0.5, -height - LETTER, 0.0], LETTER)
    return scene


def _choose_map(channel: str) -> str:
    return UNCERTAINTY_MAP if channel in ("opacity", "w2_sq", "uncertainty") else "viridis"


def _show_surface(path: Path, grid: Ground, channels: dict[str, Array], channel: str | None, most: int) -> Scene:
    """The ground's surface, coloured by a channel. Rows of a channel run from the north, as in the file."""
    first = next((name for name in ("Z", "uncertainty") if name in channels), next(iter(channels)))
    name = choose("channel", channel, (first, *sorted(set(channels) - {first})), path)
    values = channels[name]
    bar = make_bar(0.0, 1.0) if name in ("uncertainty", "seen") else fit_bar(values, _choose_map(name))
    step = ceil((values.size / most) ** 0.5) if values.size > most else 1
    notes = [f"{grid.shape[1]} x {grid.shape[0]} cells of {grid.spacing:.4g}, by {name}"]
    scene = Scene(str(path), notes, bars={name: bar})
    scene.add(make_surface(grid, step), map_colours(bar, values[::-1][::step, ::step].ravel()))
    return scene


def make_surface(grid: Ground, step: int) -> pv.PolyData:
    """The heights of every `step`-th cell in both ways, as a mesh whose points are their middles, row by row."""
    rows, columns = (np.arange(count)[::step] + 0.5 for count in grid.shape)
    x, y = np.meshgrid(grid.west + columns * grid.spacing, grid.south + rows * grid.spacing)
    heights = np.nan_to_num(grid.heights[::step, ::step])
    return pv.StructuredGrid(x.T, y.T, heights.T).extract_surface(algorithm=None)
