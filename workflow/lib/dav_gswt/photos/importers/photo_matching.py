"""Matching of the photos in a folder with the images of an imported model, by their names."""

import re
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np
import pycolmap
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.importers import lens_models
from dav_gswt.photos.importers.checks import ImportedModel
from dav_gswt.photos.importers.lens_models import fit_camera_to_photo
from dav_gswt.photos.photo_files import name_pictures, split_stem


@dataclass(frozen=True)
class MatchedPhoto:
    """A photo and its place. lens: upright, at the photo's size. index: of the shot in the model.

    turns: quarter turns clockwise from the picture that the model speaks of to the upright one; rotation and
    translation are the upright camera's.
    """

    path: Path
    key: str
    index: int
    lens: pycolmap.Camera
    turns: int
    rotation: Float[Array, "3 3"]
    translation: Float[Array, "3"]


class PhotoFolder:
    """The photos below a folder, by their path relative to it."""

    def __init__(self, folder: Path):
        if not folder.is_dir():
            raise InputError(f"{folder}: there is no such folder of photos")
        self.folder = folder
        files = (path for path in sorted(folder.rglob("*")) if path.is_file())
        found = (path for path in files if path.suffix.lower() in image_files.SUFFIXES)
        names = {path.relative_to(folder).as_posix(): path for path in found}
        self.photos = {name: path for name, path in names.items() if not re.search(r"(^|/)\.", name)}
        if not self.photos:
            raise InputError(f"{folder}: no photos in this folder; put .jpg, .png or .tif files into it")
        self._stems: dict[str, list[str]] = defaultdict(list)
        for name in self.photos:
            self._stems[split_stem(name)].append(name)

    def find(self, name: str) -> str | None:
        """The photo of that name: the same path, else the only one with that stem."""
        if name in self.photos:
            return name
        found = self._stems.get(split_stem(name), [])
        return found[0] if len(found) == 1 else None

    def stored_size(self, name: str) -> tuple[int, int] | None:
        """Width and height of a photo as stored, without EXIF's orientation; None where there is no such photo."""
        found = self.find(name)
        return None if found is None else image_files.read_stored_size(self.photos[found])[:2]


def match_photos_to_images(
    given: ImportedModel, folder: PhotoFolder, source: Path
) -> tuple[list[MatchedPhoto], tuple[tuple[str, str], ...]]:
    """The photos that have a camera, by their pictures' names; and the others, and images without photo, with reasons.

    A photo without a camera is reported where another photo of the same folder has one.
    Raises: InputError: a photo that does not fit its camera, or is that of two images.
    """
    owners: dict[str, int] = {}
    left_out = []
    for i, shot in enumerate(given.shots):
        found = folder.find(shot.name)
        if found is None:
            left_out.append((shot.name, f"{folder.folder} has no photo of this name (or several of this file name)"))
        elif found in owners:
            raise InputError(f"{source}: {given.shots[owners[found]].name} and {shot.name} are one photo: {found}")
        else:
            owners[found] = i
    homes = {PurePosixPath(name).parent for name in owners}
    for name in folder.photos:
        if name not in owners and PurePosixPath(name).parent in homes:
            left_out.append((name, "the model has no camera for it"))
    out = []
    names = sorted(owners)
    for name, key in zip(names, name_pictures(names), strict=True):
        shot, path = given.shots[owners[name]], folder.photos[name]
        width, height, orientation = image_files.read_stored_size(path)
        assert shot.lens is not None  # its photo is there, so its size is known
        lens, turns = fit_camera_to_photo(shot.lens, (width, height), orientation, f"{source}: {shot.name}")
        turn = np.linalg.matrix_power(lens_models.QUARTER, turns)
        out.append(MatchedPhoto(path, key, owners[name], lens, turns, turn @ shot.rotation, turn @ shot.translation))
    return sorted(out, key=lambda p: p.key), tuple(left_out)
