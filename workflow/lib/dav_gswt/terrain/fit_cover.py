"""Fit what a bundle says of its materials and objects: the rule of classes and the scatter."""

from dataclasses import fields, replace
from pathlib import Path

from dav_gswt.bundle.content import BundleContent
from dav_gswt.errors import InputError
from dav_gswt.materials.model import MaterialInfo
from dav_gswt.materials.store import read_objects, read_report
from dav_gswt.terrain.fit_classes import fit_classes
from dav_gswt.terrain.fit_scatter import fit_scatter
from dav_gswt.tiles.build import TileSet


def gather_content(tiles: list[TileSet], materials: Path | str | None, salt: int) -> BundleContent:
    """What a bundle is made of. materials: the folder of rule `find_materials`; None: one material, without objects.

    Raises: InputError: see `BundleContent`, `materials.store`.
    """
    if materials is None:
        return BundleContent.of_one_material(tiles[0])
    report = read_report(materials)
    if len(tiles) != len(report.materials):
        raise InputError("materials: this tiling is of the first one alone; choose another or `materials: one`")
    names = [own.name for own in fields(MaterialInfo)]
    infos = [MaterialInfo(**{name: getattr(each, name) for name in names}) for each in report.materials]
    objects = read_objects(materials, len(tiles[0].fields), tiles[0].spacing)
    return fit_cover(BundleContent(tiles, infos, objects), salt)


def fit_cover(content: BundleContent, salt: int) -> BundleContent:
    """The content with classes, if there are several materials, and with a scatter, if there are objects."""
    if len(content.materials) > 1:
        content = replace(content, classes=fit_classes(content, salt))
    if content.objects:
        scatter, probabilities = fit_scatter(content, content.classes, salt)
        content = replace(content, scatter=scatter, probabilities=probabilities)
    return content
