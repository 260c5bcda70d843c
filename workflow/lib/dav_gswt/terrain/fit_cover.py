"""Fit what a bundle says of its materials and objects: the rule of classes, and the scatter of objects.

The rule gives every material its measured share of the ground and, as far as possible, its patch scale, and borders
that fray and bend as the photographed ones do. The scatter gives every object its measured density.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.content import BundleContent
from dav_gswt.bundle.land_cover import ClassesEntry, JitterEntry, NoiseTerm, ObjectEntry, RiseEntry, ScatterEntry
from dav_gswt.errors import InputError
from dav_gswt.materials.borders import measure_bend
from dav_gswt.materials.store import read_objects, read_report
from dav_gswt.terrain.classes import LATTICE, Classes
from dav_gswt.terrain.fit_variation import fit_variation
from dav_gswt.terrain.scatter import Scatter
from dav_gswt.tiles.build import TileSet

SHORTEST, WIDEST = 4.0, 4096.0  # lattice steps: wavelengths of noise that the lattice shows
MAX_OCTAVES = 5
SAMPLES, LINES, LINE = 60_000, 48, 2048  # lattice points; lines of them, and points of a line
PASSES, STEPS = 3, 150
WINDOWS, WINDOW, FINE = 6, 10, 24  # places in which bends are measured; their sides in tile sides; cells of one
TYPICAL = 0.6  # mean difference of two jitters, in amplitudes

FRAY = 0.06  # tile sides: how far the jitter typically moves a border, where no border was seen
LEAST_FRAY = 1.0  # ground cells: finer jitter is not drawn
WAVES = 3.0  # wavelength of the widest jitter, as a multiple of that
FINEST = 3.0  # ground cells: wavelength of the finest jitter
LEAN = 1.0  # how far something reaches over a border, as a multiple of its height above the ground
MOST_LEAN = 0.04  # tile sides
CLEARANCE = 2.0  # standard deviations of the ground's own relief

TURN, SIZE = 15.0, 0.15  # largest turn in degrees, since sunlight is part of the colours, and change of size
CANDIDATES = 3.0  # a wanted object
MAX_CELLS = 64  # of the scatter along a tile's side
WANTED, MAX_WINDOW = 600.0, 96  # objects that a probability is measured with; tiles along a side of the window
SCATTER_PASSES = 5


def gather_content(
    tiles: list[TileSet], materials: Path | str | None, salt: int, variation: float = 1.0
) -> BundleContent:
    """What a bundle is made of.

    Args:   materials: the folder of rule `find_materials`; None: one material, without objects. variation: the key.
    Raises: InputError: tiles of another number of materials; see also `materials.store`.
    """
    if materials is None:
        content = BundleContent.of_one_material(tiles[0])
        return replace(content, variation=fit_variation(tiles[:1], variation, salt))
    report = read_report(materials)
    if len(tiles) != len(report.materials):
        raise InputError("materials: this tiling is of the first one alone; choose another or `materials: one`")
    objects = read_objects(materials, len(tiles[0].fields), tiles[0].spacing)
    waves = fit_variation(tiles, variation, salt)
    return fit_cover(BundleContent(tiles, [*report.materials], objects, variation=waves), salt)


def fit_cover(content: BundleContent, salt: int) -> BundleContent:
    """The content with classes, if there are several materials, and with a scatter, if there are objects."""
    if len(content.materials) > 1:
        content = replace(content, classes=fit_classes(content, salt))
    if content.objects:
        scatter, probabilities = fit_scatter(content, content.classes, salt)
        content = replace(content, scatter=scatter, probabilities=probabilities)
    return content


def fit_classes(content: BundleContent, salt: int) -> ClassesEntry:
    """The rule that gives every material its share of the ground and, as far as possible, its patch scale.

    Where borders were seen, the noise has as many octaves as make its borders bend most nearly as much.
    """
    side, seen = content.side, [each.bend for each in content.materials if each.bend is not None]
    entry, steepness = _fit_noise(content, salt, 1 if seen else MAX_OCTAVES)
    if seen:
        choices = [(entry, steepness)]
        while len(choices) < MAX_OCTAVES and (more := _fit_noise(content, salt, len(choices) + 1)) != choices[-1]:
            choices.append(more)  # as long as the lattice shows another octave
        bends = [measure_bends(Classes(each, len(content.materials), side), salt) for each, _ in choices]
        wanted = float(np.mean([bend / side for bend in seen]))
        entry, steepness = choices[int(np.abs(np.array(bends) - wanted).argmin())]
    return replace(entry, jitter=_fit_jitter(content, steepness), rise=_fit_rise(content, steepness / side))


def measure_bends(classes: Classes, salt: int) -> float:
    """Mean of `borders.measure_bend` over materials and some places of the terrain, in tile sides; without jitter."""
    rng, found = np.random.default_rng([salt, 2]), []
    for corner in rng.integers(-(2**20), 2**20, (WINDOWS, 2)).tolist():
        x, y = (v.ravel() for v in np.meshgrid(*[(np.arange(WINDOW * FINE) + 0.5) / FINE] * 2))
        i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        scores = classes.scores_at(i + corner[0], j + corner[1], x - i, y - j)
        material = scores.argmax(1).reshape(WINDOW * FINE, WINDOW * FINE)
        every = np.ones(material.shape, bool)
        found += [measure_bend(material == number, every, float(FINE)) for number in range(classes.materials)]
    seen = [bend for bend in found if bend is not None]
    return float(np.mean(seen)) / FINE if seen else 0.0


def _fit_noise(content: BundleContent, salt: int, most: int) -> tuple[ClassesEntry, float]:
    """Classes by noise of at most so many octaves, and how steeply their scores cross, per tile side.

    Wavelengths are in proportion to the patch scales; one factor brings the mean length of stretches on straight lines
    to the measured one. Biases give the shares. Both are measured on the noise itself and repeated, since wavelengths
    decide how many octaves the lattice shows.
    """
    side = content.side
    wanted = np.maximum([material.patch_scale / side for material in content.materials], 1 / LATTICE)
    shares = np.array([material.share for material in content.materials])
    shares, waves = shares / shares.sum(), wanted.copy()
    entry = ClassesEntry(salt, [], JitterEntry(1, 1, 0.0), RiseEntry(0.0, 0.0, *2 * [[0.0] * len(shares)]))
    steepness = 1.0
    for _ in range(PASSES):
        waves = np.clip(waves, SHORTEST / LATTICE, WIDEST / LATTICE)
        octaves = [_count_octaves(wave * LATTICE, SHORTEST, most) for wave in waves.tolist()]
        noise = NoiseTerm("noise", 1.0, waves.tolist(), octaves, [0.0] * len(waves))
        plain = Classes(replace(entry, rule=[noise]), len(waves), side)
        points = np.random.default_rng(salt).integers(-(2**30), 2**30, (2, SAMPLES))
        noise = replace(noise, biases=fit_biases(plain.lattice_scores(*points), shares).tolist())
        entry = replace(entry, rule=[noise])
        stretches, steepness = measure_lines(Classes(entry, len(waves), side), salt)
        waves = waves * np.exp(shares @ np.log(wanted / stretches))
    return entry, steepness


def fit_biases(scores: Float[Array, "n m"], shares: Float[Array, "m"]) -> Float[Array, "m"]:
    """What to add to scores so that each is the highest in its share of the samples; the mean is 0.

    The gradient of a convex function of the biases is the difference of shares: it is followed in ever smaller steps.
    """
    biases, spread = np.zeros(len(shares)), float(scores.std())
    for step in range(STEPS):
        best = (scores + biases).argmax(1)
        reached = np.bincount(best, minlength=len(shares)) / len(scores)
        biases += 3 * spread / (1 + 0.1 * step) * (shares - reached)
    return biases - biases.mean()


def measure_lines(classes: Classes, salt: int) -> tuple[Float[Array, "m"], float]:
    """Mean length of each material's stretches on straight lines, in tile sides, and how steeply scores cross.

    The latter is the mean change of the difference of the two scores where one material gives way to another, per tile
    side. A material that no line meets has the length of a lattice step.
    """
    rng = np.random.default_rng([salt, 1])
    rows, starts = rng.integers(-(2**30), 2**30, (2, LINES))
    along = np.arange(LINE)[None] + starts[:, None]
    i, j = along.ravel(), np.repeat(rows, LINE)
    half = len(i) // 2  # half of the lines go north
    i, j = np.concatenate([i[:half], j[half:]]), np.concatenate([j[:half], i[half:]])
    scores = classes.lattice_scores(i, j).reshape(LINES, LINE, classes.materials)
    best = scores.argmax(-1)
    change = best[:, 1:] != best[:, :-1]
    counts = np.bincount(best.ravel(), minlength=classes.materials)
    runs = np.bincount(np.concatenate([best[:, 0], best[:, 1:][change]]), minlength=classes.materials)
    before, after = scores[:, :-1][change], scores[:, 1:][change]
    own, new, k = best[:, :-1][change], best[:, 1:][change], np.arange(change.sum())
    turn = (after[k, new] - after[k, own]) - (before[k, new] - before[k, own])
    steepness = LATTICE * float(turn.mean()) if len(turn) else 1.0
    return np.maximum(counts, 1) / np.maximum(runs, 1) / LATTICE, steepness


def _count_octaves(widest: float, finest: float, most: int) -> int:
    """Octaves of a noise from a widest to a finest wavelength, at least one."""
    return int(np.clip(1 + np.floor(np.log2(widest / finest)), 1, most))


def _fit_jitter(content: BundleContent, steepness: float) -> JitterEntry:
    """The jitter that moves borders as far as those that were seen stray; less where patches are small.

    steepness: of scores, per tile side.
    """
    smallest = max(min(material.patch_scale for material in content.materials) / content.side, 1 / LATTICE)
    seen = [material.fray / content.side for material in content.materials if material.fray is not None]
    wanted = max(float(np.mean(seen)), LEAST_FRAY * content.spacing / content.side) if seen else FRAY
    fray = min(wanted, 0.15 * smallest)
    cells = int(np.clip(np.rint(1 / (WAVES * fray)), 1, 4096))
    octaves = _count_octaves(content.side / cells, FINEST * content.spacing, 4)
    return JitterEntry(cells, octaves, float(fray * steepness / TYPICAL))


def _fit_rise(content: BundleContent, steepness: float) -> RiseEntry:
    """steepness: of scores, per unit of length."""
    grounds = []
    for tiles in content.tiles:
        heights = [f.means[f.ground, 2].astype(float) for f in tiles.fields[0] if f.ground.any()]
        grounds.append(np.concatenate(heights or [f.means[:, 2].astype(float) for f in tiles.fields[0]]))
    return RiseEntry(
        LEAN * steepness,
        MOST_LEAN * content.side * steepness,
        [float(z.mean()) for z in grounds],
        [float(CLEARANCE * z.std()) for z in grounds],
    )


def fit_scatter(content: BundleContent, classes: ClassesEntry | None, salt: int) -> tuple[ScatterEntry, list[float]]:
    """The scatter grid, and the probability of each object with which it has its density, losses included.

    Candidates are lost to others that overlap them and to borders of materials. They are counted in a window of the
    terrain, and the probabilities are corrected by what is missing.
    """
    side, number = content.side, len(content.objects)
    densities, material = (np.array([getattr(each, k) for each in content.objects]) for k in ("density", "material"))
    shares = np.array([content.materials[m].share for m in material])
    fullest = max(densities[material == m].sum() for m in range(len(content.materials)))
    cells = int(np.clip(np.ceil(side * np.sqrt(CANDIDATES * fullest)), 1, MAX_CELLS))
    rarest = float((densities * shares)[densities > 0].min(initial=np.inf)) * side**2
    window = int(np.clip(np.ceil(np.sqrt(WANTED / rarest)), 8, MAX_WINDOW))
    i, j = (v.ravel() for v in np.mgrid[:window, :window].astype(np.int64) - window // 2)
    entry, cover = ScatterEntry(cells, TURN, SIZE, salt), classes and Classes(classes, len(content.materials), side)
    probabilities = _cap(densities * (side / cells) ** 2, material)
    for _ in range(SCATTER_PASSES):
        objects = [
            ObjectEntry(each.name, each.radius, [0.0, 0.0], 0.0, each.material, each.density, float(p), [], [])
            for each, p in zip(content.objects, probabilities, strict=True)
        ]
        found = Scatter(entry, objects, side, cover).instances_in(i, j)
        reached = np.bincount(found.number, minlength=number) / (window**2 * side**2 * shares)
        probabilities = _cap(probabilities * np.clip(densities / np.maximum(reached, 1e-300), 0.5, 2), material)
    return entry, probabilities.tolist()


def _cap(probabilities: Float[Array, "objects"], material: Array) -> Float[Array, "objects"]:
    """Probabilities of which those of one material's objects sum to 1 at most."""
    sums = np.bincount(material, probabilities)[material]
    return probabilities / np.maximum(sums, 1)
