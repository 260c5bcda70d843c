"""The scene that an agent photographs."""

from dataclasses import dataclass
from pathlib import Path

from dav_gswt.capture.store import PhotoStore
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame


@dataclass(frozen=True)
class Site:
    """A scene to photograph.

    name, scene: its name and entry in the config. photos: its photos/ folder. store: photos taken by devices and
    people. field: the reconstruction so far, a .ply. shot_list_template: of the page that `handheld` writes.
    requested: the cameras that this round and the earlier ones ask for: a dropped photo stored for one is in use.
    """

    name: str
    scene: dict
    frame: SceneFrame
    photos: Path
    store: PhotoStore
    field: Path | str | None = None
    shot_list_template: Path | str | None = None
    requested: tuple[Camera, ...] = ()

    @property
    def burst(self) -> int:
        """Photos per pose; each counts against the budget."""
        return self.scene.get("burst", 1)

    @property
    def unit(self) -> float:
        """The flying height in world units."""
        return self.frame.flying_height

    def missing_photos(self, camera: Camera) -> int:
        """Number of photos of a pose that the store lacks."""
        return self.burst - len(self.store.photos_of(camera))
