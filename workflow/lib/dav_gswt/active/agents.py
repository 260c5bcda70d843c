"""The agent that a scene's entry names takes the photos of a round."""

from pathlib import Path

from dav_gswt.active import candidates
from dav_gswt.active import capture as captures
from dav_gswt.photos import synthetic


def capture(
    scene: dict, frame: dict, split: dict, photos: Path, before: list, chosen: list[dict], folder: Path
) -> None:
    """Fill `folder` with the photos of the chosen poses and capture.json, their record.

    photos: the scene's photos/ folder. before: the capture folders of earlier rounds.
    """
    pool = candidates.left(scene, frame, photos / "sparse", split, before)
    asked = candidates.as_asked(pool, chosen)
    folder.mkdir(parents=True, exist_ok=True)
    if scene["agent"] == "replay":
        frames = {pose.name: camera for pose, camera in pool}
        shots = captures.replay(photos, frames, asked, folder, frame["flying_height"])
    else:
        world = synthetic.of_config(scene)
        shots = captures.render(lambda camera: synthetic.render(world, camera), asked, folder)
    captures.write(folder, scene["agent"], asked, shots)
