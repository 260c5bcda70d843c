"""The agent of synthetic scenes: photos are taken exactly where they were asked for."""

from collections.abc import Callable
from pathlib import Path

from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.capture.shots import Asked, Shot
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files
from dav_gswt.logs import progress


def take(
    picture: Callable[[Camera, int], Float32[Array, "h w 3"]], asked: list[Asked], burst: int, folder: Path
) -> list[Shot]:
    """`burst` photos of each pose. picture: a photo, and which of its burst it is (they differ in their noise)."""
    shots = []
    for pose, camera in progress(asked, "render photos"):
        for i in range(burst):
            name = f"{pose.name}.png" if burst == 1 else f"{pose.name}_{i}.png"
            image_files.write_png(folder / name, picture(camera, i))
            shots.append(Shot(name, pose, camera, camera, 0.0))
    return shots
