"""Matching of the photos in a folder with the images of an imported model, by their names."""

import logging
import unicodedata
from collections import defaultdict
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path, PurePosixPath

import pycolmap

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.importers.checks import ImportedImage, ImportedModel
from dav_gswt.photos.importers.lens_models import fit_camera_to_photo
from dav_gswt.photos.photo_files import name_pictures, split_stem
from dav_gswt.photos.photo_listing import Source, drop_twins, list_photos

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class MatchedPhoto:
    """A photo and its image in the model. lens: upright, at the photo's size.

    turns: quarter turns clockwise from the picture that the model speaks of to the upright one.
    """

    path: Path
    key: str
    image: ImportedImage
    lens: pycolmap.Camera
    turns: int


class PhotoFolder:
    """The photos below a folder (`list_photos`), by their path relative to it with composed letters (NFC)."""

    def __init__(self, source: Source):
        listing = list_photos(source)
        self.folder = Path(source if isinstance(source, Path | str) else source[0])
        for note in listing.notes:
            _log.warning("%s", note)
        self.photos = listing.photos
        if not self.photos:
            raise InputError(f"{listing.where}: no photos in this folder; put .jpg, .png or .tif files into it")
        self._stems: dict[str, list[str]] = defaultdict(list)
        for name in self.photos:
            self._stems[split_stem(name)].append(name)

    def find(self, name: str) -> str | None:
        """The photo of that name: the same path, else the one of that stem whose last folders and suffix agree best.

        None: there is none, or several agree equally.
        """
        name = unicodedata.normalize("NFC", name)
        if name in self.photos:
            return name
        found = self._stems.get(split_stem(name), [])
        ranks = [_compare_paths(PurePosixPath(photo), PurePosixPath(name)) for photo in found]
        best = [photo for photo, rank in zip(found, ranks, strict=True) if rank == max(ranks)]
        return best[0] if len(best) == 1 else None

    def stored_size(self, name: str) -> tuple[int, int] | None:
        """Width and height of a photo as stored, without EXIF's orientation; None where there is no such photo."""
        found = self.find(name)
        return None if found is None else image_files.read_stored_size(self.photos[found])[:2]


def _compare_paths(one: PurePosixPath, other: PurePosixPath) -> tuple[int, bool]:
    """How many of the last folders are equal, and whether the file names are."""
    pairs = zip(reversed(one.parent.parts), reversed(other.parent.parts), strict=False)
    return len([*takewhile(lambda pair: pair[0] == pair[1], pairs)]), one.name == other.name


def match_photos_to_images(
    given: ImportedModel, folder: PhotoFolder, source: Path
) -> tuple[list[MatchedPhoto], tuple[tuple[str, str], ...]]:
    """The photos that have a camera, by their pictures' names; and the others, and images without photo, with reasons.

    A photo without a camera is reported where another photo of the same folder has one.
    Raises: InputError: a photo that does not fit its camera, or is that of two images.
    """
    owners: dict[str, ImportedImage] = {}
    left_out = []
    for image in given.images:
        found = folder.find(image.name)
        if found is None:
            left_out.append((image.name, f"{folder.folder} has no photo of this name (or several of this file name)"))
        elif found in owners:
            raise InputError(f"{source}: {owners[found].name} and {image.name} are one photo: {found}")
        else:
            owners[found] = image
    homes = {PurePosixPath(name).parent for name in owners}
    for name in folder.photos:
        if name not in owners and PurePosixPath(name).parent in homes:
            left_out.append((name, "the model has no camera for it"))
    out = []
    kept, twins = drop_twins({name: folder.photos[name] for name in owners})
    left_out += [(name, f"a copy of {twin}, which counts once") for name, twin in twins.items()]
    names = sorted(kept)
    for name, key in zip(names, name_pictures(names), strict=True):
        image, path = owners[name], folder.photos[name]
        width, height, orientation = image_files.read_stored_size(path)
        lens, turns = fit_camera_to_photo(image.lens, (width, height), orientation, f"{source}: {image.name}")
        out.append(MatchedPhoto(path, key, image, lens, turns))
    return sorted(out, key=lambda p: p.key), tuple(left_out)
