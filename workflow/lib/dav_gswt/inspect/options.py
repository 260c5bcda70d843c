"""Options of the command line for a scene."""

from dataclasses import dataclass
from pathlib import Path

from dav_gswt.errors import InputError

MAX_DRAWN = 300_000  # Gaussians or pixels that are drawn: what a browser without a GPU still turns


@dataclass(frozen=True)
class ViewOptions:
    """Options of a scene; None is the artefact's default.

    Attributes:
        colour: what to colour by.
        level: of levels and tiles.
        part, channel: of maps.
        poses: a poses.json whose poses are marked.
        most: Gaussians, or pixels of a map, at most.
    """

    colour: str | None = None
    level: int | None = None
    part: str | None = None
    channel: str | None = None
    poses: Path | None = None
    most: int = MAX_DRAWN

    def reject_others(self, path: Path, *known: str) -> None:
        """Raises: InputError: an option is set that the artefact does not have."""
        for name in ("colour", "level", "part", "channel", "poses"):
            if getattr(self, name) is not None and name not in known:
                accepted = ", ".join(f"--{k}" for k in known) or "none of its options"
                raise InputError(f"--{name}: means nothing for {path}; it knows {accepted}")

    def choose_colour(self, names: tuple[str, ...], what: str) -> str:
        """What to colour by; by default the first of names. Raises: InputError: another name."""
        if self.colour is not None and self.colour not in names:
            raise InputError(f"--colour {self.colour}: {what} has {', '.join(names)}")
        return self.colour or names[0]

    def choose_levels(self, count: int, path: Path) -> list[int]:
        """All levels, or the selected one. Raises: InputError: there is no such level."""
        if self.level is None:
            return list(range(count))
        if not 0 <= self.level < count:
            raise InputError(f"--level {self.level}: {path} has the levels 0 to {count - 1}")
        return [self.level]
