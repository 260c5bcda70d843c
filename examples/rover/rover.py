"""A rover drives over an exported ground in MuJoCo; what its camera sees is drawn by our renderer on the CPU.

    .venv/bin/pip install mujoco
    .venv/bin/dav-gswt export results/desert --columns 14 --rows 14 --formats ply ground -o out
    .venv/bin/python examples/rover/rover.py out rover.webp

MuJoCo has the height field and the objects' hulls of out/ground; the pictures are the Gaussians of out/terrain. Both
are in one frame, z up, so a camera of MuJoCo is one of ours but for the directions of its axes.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
from PIL import Image

from dav_gswt.export.axes import AXES, turn_field
from dav_gswt.field import GaussianField, read_field, rgb_to_sh
from dav_gswt.geometry.cameras import Camera, pinhole
from dav_gswt.raster import render

ROVER = Path(__file__).with_name("rover.xml")
WIDTH, HEIGHT, RATE = 360, 240, 10  # of a picture, pixels; pictures a second
SPEED, TURN, PERIOD = 7.0, 2.5, 7.0  # of the wheels, rad/s: mean, and half the difference of the sides; s
SKY = np.array([0.62, 0.73, 0.84], np.float32)
LIGHT = np.array([0.35, -0.45, 0.82])
CELL = 0.012  # metres between the Gaussians that the rover is drawn with


def build_model(ground: Path, start: tuple[float, float]) -> mujoco.MjModel:
    """The exported ground with the rover on it, its wheels just above the ground at a place."""
    world = mujoco.MjSpec.from_file(str(ground / "ground.xml"))
    bare = world.compile()
    data = mujoco.MjData(bare)
    mujoco.mj_forward(bare, data)
    above = np.array([*start, 100.0])
    down = mujoco.mj_ray(bare, data, above, np.array([0.0, 0.0, -1.0]), None, 1, -1, np.zeros(1, np.int32))
    frame = world.worldbody.add_frame(pos=[*start, 100.0 - down + 0.3])
    world.attach(mujoco.MjSpec.from_file(str(ROVER)), prefix="rover_", frame=frame)
    return world.compile()


def drive(model: mujoco.MjModel, seconds: float) -> Iterator[mujoco.MjData]:
    """The state at the time of each picture: the rover winds its way ahead."""
    data = mujoco.MjData(model)
    steps = round(1 / RATE / model.opt.timestep)
    for _ in range(round(seconds * RATE)):
        turn = TURN * np.sin(2 * np.pi * data.time / PERIOD)
        data.ctrl[:] = [SPEED - turn] * 3 + [SPEED + turn] * 3
        mujoco.mj_step(model, data, steps)
        yield data


def camera_of(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> Camera:
    """A camera of MuJoCo (x right, y up, looks along -z) as one of ours (x right, y down, looks along z)."""
    number = model.camera(name).id
    rotation = np.diag([1.0, -1.0, -1.0]) @ data.cam_xmat[number].reshape(3, 3).T
    focal = 0.5 * HEIGHT / np.tan(0.5 * np.radians(model.cam_fovy[number]))
    where = -rotation @ data.cam_xpos[number]
    return Camera(rotation, where, focal, focal, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT)


def follow(data: mujoco.MjData, heading: np.ndarray) -> Camera:
    """A camera behind and above the rover; heading: where it looks, which turns more slowly than the rover."""
    middle = data.body("rover_chassis").xpos
    ahead = data.body("rover_chassis").xmat.reshape(3, 3)[:2, 0]
    heading += 0.12 * (ahead / np.linalg.norm(ahead) - heading)
    eye = middle + [-3.0 * heading[0] - 1.2 * heading[1], -3.0 * heading[1] + 1.2 * heading[0], 1.9]
    return pinhole(eye, middle + [0.0, 0.0, 0.3], WIDTH, HEIGHT, 60.0)


def cover(model: mujoco.MjModel, data: mujoco.MjData) -> GaussianField:
    """The rover's geoms, with Gaussians all over them, lit from one side."""
    points, colours = [], []
    for number in range(model.ngeom):
        if model.geom_bodyid[number] == 0:  # the ground and its objects
            continue
        place, normal = _cover_geom(int(model.geom_type[number]), model.geom_size[number])
        turn = data.geom_xmat[number].reshape(3, 3)
        shade = 0.55 + 0.45 * np.clip(normal @ turn.T @ LIGHT, -1, 1)
        points.append(place @ turn.T + data.geom_xpos[number])
        colours.append(np.clip(shade[:, None] * model.geom_rgba[number, :3], 0, 1))
    means, n = np.concatenate(points).astype(np.float32), sum(map(len, points))
    sizes = np.full((n, 3), np.log(0.6 * CELL), np.float32)
    upright = np.tile(np.float32([1, 0, 0, 0]), (n, 1))
    sh = rgb_to_sh(np.concatenate(colours).astype(np.float32))
    return GaussianField(
        means, sizes, upright, np.full(n, 4, np.float32), sh, np.zeros(n, np.float32), np.zeros(n, bool)
    )


def _cover_geom(kind: int, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points on a box or a cylinder about its own middle, and the normals there."""
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        radius, half = size[:2]
        rim, disc = _spread(np.pi * radius), _grid(radius, radius)
        angle, z = (v.ravel() for v in np.meshgrid(rim / radius, _spread(half)))
        wall = np.stack([np.cos(angle), np.sin(angle), 0 * z], 1)
        disc = disc[np.hypot(*disc.T) <= radius]
        sides = [(wall * [radius, radius, 0] + np.stack([0 * z, 0 * z, z], 1), wall)]
        for end in (-1.0, 1.0):
            normal = np.tile([0, 0, end], (len(disc), 1))
            sides.append((np.column_stack([disc, np.full(len(disc), end * half)]), normal))
    else:
        sides = []
        for axis in range(3):
            across = [k for k in range(3) if k != axis]
            flat = _grid(*size[across])
            for end in (-1.0, 1.0):
                place, normal = np.zeros((len(flat), 3)), np.zeros((len(flat), 3))
                place[:, across], place[:, axis], normal[:, axis] = flat, end * size[axis], end
                sides.append((place, normal))
    return np.concatenate([place for place, _ in sides]), np.concatenate([normal for _, normal in sides])


def _spread(half: float) -> np.ndarray:
    return np.linspace(-half, half, max(2, int(np.ceil(2 * half / CELL)) + 1))


def _grid(a: float, b: float) -> np.ndarray:
    return np.stack([v.ravel() for v in np.meshgrid(_spread(a), _spread(b))], 1)


def take_picture(terrain: GaussianField, rover: GaussianField, camera: Camera, far: np.ndarray) -> np.ndarray:
    """Terrain and rover, whichever is nearer at each pixel, before sky and far ground."""
    rise = camera.rays()[1][..., 2:]
    behind = np.where(rise > 0, SKY, far)
    ground, body = render(terrain, camera), render(rover, camera)
    picture = ground.colour + (1 - ground.alpha[..., None]) * behind
    depth = [seen.depth / np.maximum(seen.alpha, 1e-3) for seen in (body, ground)]
    nearer = (body.alpha > 0.02) & ((depth[0] < depth[1]) | (ground.alpha < 0.5))
    over = np.where(nearer, body.alpha, 0)[..., None]
    return np.where(nearer[..., None], body.colour, 0) + (1 - over) * picture


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("exports", type=Path, help="the folder that `dav-gswt export` wrote")
    parser.add_argument("out", type=Path, help="a .webp or .gif")
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--start", type=float, nargs=2, default=(-5.0, 0.0), metavar=("X", "Y"))
    options = parser.parse_args()
    facts = json.loads((options.exports / "terrain/terrain.json").read_text())
    if facts["unit"] != "metre":
        raise SystemExit(
            f"{options.exports}: lengths are in {facts['unit']}; a rover in metres needs a terrain in metres"
        )
    terrain = turn_field(read_field(options.exports / "terrain/terrain.ply"), AXES[facts["files"]["ply"]].T)
    far = np.clip(terrain.sh[:, 0].mean(0) * 0.28209479 + 0.5, 0, 1)
    model, heading, pictures = build_model(options.exports / "ground", tuple(options.start)), np.array([1.0, 0.0]), []
    for data in drive(model, options.seconds):
        rover = cover(model, data)
        views = [follow(data, heading), camera_of(model, data, "rover_eye")]
        picture = np.concatenate([take_picture(terrain, rover, view, far) for view in views], 1)
        pictures.append(Image.fromarray(np.uint8(np.rint(255 * np.clip(picture, 0, 1)))))
    first, *rest = pictures
    options.out.parent.mkdir(parents=True, exist_ok=True)
    first.save(options.out, save_all=True, append_images=rest, duration=1000 // RATE, loop=0, quality=60, method=4)
    x, y, z = data.body("rover_chassis").xpos
    print(f"{options.out}: {len(pictures)} pictures; the rover stands at {x:.2f}, {y:.2f}, {z:.2f}")


if __name__ == "__main__":
    main()
