"""What an agent knows of the place that it photographs."""

from dataclasses import dataclass
from pathlib import Path

from dav_gswt.capture.store import Store
from dav_gswt.geometry.scene_frame import SceneFrame


@dataclass(frozen=True)
class Site:
    """A scene to photograph.

    name, scene: its name and its entry in the config. frame: ground.json. photos: its photos/ folder. store: where
    photos by devices are kept; photos that people bring are dropped into store.folder / "drop". field: what is known
    of the scene so far, a .ply.
    """

    name: str
    scene: dict
    frame: SceneFrame
    photos: Path
    store: Store
    field: Path | str | None = None

    @property
    def burst(self) -> int:
        """Photos of each pose; every one counts against the budget."""
        return self.scene.get("burst", 1)

    @property
    def unit(self) -> float:
        """The flying height, in units of the world."""
        return self.frame.flying_height
