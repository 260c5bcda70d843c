"""Capture agents: the one that a scene's entry names takes the photos of a round.

render and replay answer at once. The others are devices and people (`DEVICES`): each has a function take(site, asked)
that puts photos into the store, or says what is to be done until they are there.
"""

from importlib import import_module
from pathlib import Path

from dav_gswt.capture import render, replay, shots
from dav_gswt.capture.shots import Asked, Shot
from dav_gswt.capture.site import Site
from dav_gswt.images import image_files
from dav_gswt.photos import lenses
from dav_gswt.photos.synthetic import scene
from dav_gswt.views import candidates

DEVICES = {"serial": "serial_rig", "plan": "drone", "handheld": "handheld"}  # the module of each agent


def capture(site: Site, split: dict, before: list, chosen: list[dict], folder: Path) -> None:
    """Fill `folder` with the photos of the chosen poses and capture.json, their record.

    before: the capture folders of earlier rounds. Where no pose was chosen no agent is asked for anything.
    """
    pool = candidates.list_remaining(site.scene, site.frame, site.photos / "sparse", split, before)
    asked = candidates.select_by_name(pool, chosen)
    folder.mkdir(parents=True, exist_ok=True)
    agent = site.scene["agent"]
    if not asked:
        taken = []
    elif agent == "replay":
        frames = {pose.name: camera for pose, camera in pool}
        taken = replay.take(site.photos, frames, asked, site.burst, folder, site.unit)
    elif agent == "render":
        world = scene.of_config(site.scene)
        taken = render.take(lambda camera, i: scene.render(world, camera, again=i), asked, site.burst, folder)
    else:
        taken = _by_device(site, asked, folder)
    shots.write(folder, agent, taken)


def _by_device(site: Site, asked: list[Asked], folder: Path) -> list[Shot]:
    """Have the poses taken that the store does not hold yet, then develop all of them into `folder`."""
    with site.store.locked():
        missing = [(pose, camera) for pose, camera in asked if len(site.store.of(camera)) < site.burst]
        if missing:
            import_module(f"dav_gswt.capture.{DEVICES[site.scene['agent']]}").take(site, missing)
        return [shot for pose, camera in asked for shot in _developed(site, pose, camera, folder)]


def _developed(site: Site, pose, camera, folder: Path) -> list[Shot]:
    """Stored photos as the pictures that the scene's pinhole cameras would have taken."""
    found = []
    for i, stored in enumerate(site.store.of(camera)[: site.burst]):
        name = f"{pose.name}.png" if site.burst == 1 else f"{pose.name}_{i}.png"
        image_files.write_png(
            folder / name, lenses.developed(image_files.read_photo(stored.photo), site.photos, stored.got)
        )
        found.append(Shot(name, pose, camera, stored.got, shots.apart(camera, stored.got, site.unit), stored.taken))
    return found
