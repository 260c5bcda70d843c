"""The agent of a photo set: for each pose the nearest frame that was not used yet."""

import shutil
from pathlib import Path

from dav_gswt.capture.shots import Asked, Shot, apart
from dav_gswt.geometry.cameras import Camera


def take(
    photos: Path, pool: dict[str, Camera], asked: list[Asked], burst: int, folder: Path, unit: float
) -> list[Shot]:
    """The `burst` nearest frames of each pose (`shots.apart`, ties by name); fewer where the pool ends."""
    left, shots = dict(pool), []
    for pose, camera in asked:
        for _ in range(min(burst, len(left))):
            far = {name: apart(camera, other, unit) for name, other in left.items()}
            name = min(far, key=lambda n: (far[n], n))
            shutil.copyfile(photos / "images" / name, folder / name)
            shots.append(Shot(name, pose, camera, left.pop(name), far[name]))
    return shots
