"""Where runs put what they make, and the configs they are made with."""

from dataclasses import dataclass
from pathlib import Path

USUAL, TINY = "config/config.yaml", "config/test/config.yaml"


@dataclass(frozen=True)
class Made:
    """Where a run put what: one folder a stage. out: what Snakemake said."""

    folder: Path
    scene: str
    fit: str  # seed and quality
    active: str  # the branch of the last round
    out: str

    @property
    def photos(self) -> Path:
        return self.folder / "results" / self.scene / "photos"

    @property
    def start(self) -> Path:
        return self.folder / "results" / self.scene / self.fit.split("/")[0]

    @property
    def coarse(self) -> Path:
        return self.folder / "results" / self.scene / self.fit / "coarse"

    @property
    def round(self) -> Path:
        return self.folder / "results" / self.scene / self.fit / self.active

    @property
    def tiles(self) -> Path:
        return self.round / "tiles_semantic"

    @property
    def bundle(self) -> Path:
        return self.tiles / "bundle_tau0.6"

    @property
    def terrain(self) -> Path:
        return self.bundle / "terrain"
