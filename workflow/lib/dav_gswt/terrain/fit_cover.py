"""Fit what a bundle says of its materials and objects: the rule of classes, and the scatter of objects.

The rule gives every material its measured share of the ground and, as far as possible, its patch scale, and borders
that stray as the photographed ones do. The scatter gives every object its measured density.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import map_coordinates

from dav_gswt.bundle.content import BundleContent
from dav_gswt.bundle.land_cover import ClassesEntry, JitterEntry, NoiseTerm, ObjectEntry, RiseEntry, ScatterEntry
from dav_gswt.errors import InputError
from dav_gswt.materials.borders import WIDTHS, measure_strays
from dav_gswt.materials.store import read_objects, read_report
from dav_gswt.terrain.classes import CONTRAST, LATTICE, Classes
from dav_gswt.terrain.heights import GAIN
from dav_gswt.terrain.scatter import Scatter
from dav_gswt.terrain.variation import fit_variation
from dav_gswt.tiles.build import TileSet

SHORTEST, WIDEST = 4.0, 4096.0  # lattice steps: wavelengths of noise that the lattice shows
WIDER = (1.0,)  # gains of octaves wider than the one that patches follow: patches of many sizes
MAX_OCTAVES = 5  # from that on
LEAST_GAIN, MOST_GAIN = 0.03, 0.7  # octaves that count; ratio of one to the last
SAMPLES, LINES, LINE = 60_000, 48, 2048  # lattice points; lines of them, and points of a line
PASSES, STEPS = 5, 150
LONGEST = 1.4  # stretches over measured ones, for borders that were photographed straighter than those of noise
WINDOWS, WINDOW, FINE = 6, 6, 80.0  # places in which borders are measured; their sides in tile sides; cells of one

STRAY, FALL, FALLS = 0.025, 0.6, (0.25, 0.75)  # at the widest width, where none was seen; of each width over the last
STEEPEST = 2.0  # power of the width that strays grow by, at most
JITTER, MAX_JITTER = 4, 5  # cells of the widest jitter along a tile's side; octaves
FINEST = 3.0  # ground cells: wavelength of the finest jitter
TYPICAL = 0.09  # how far jitter of one octave makes a border stray at its width, in heights of its noise
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
    ratio = tiles[0].side / (report.tile_side * tiles[0].spacing) if report.tile_side else 1.0
    known = [replace(own, strays=own.strays and resample_strays(own.strays, ratio)) for own in report.materials]
    return fit_cover(BundleContent(tiles, [*known], objects, variation=waves), salt)


def resample_strays(strays: list[float], ratio: float) -> list[float]:
    """Strays at `borders.WIDTHS` of tiles that are `ratio` times as wide as those by which they were measured.

    Around each width they follow a power of it, as between its neighbours.
    """
    known = np.log(np.maximum(strays, 1e-9))
    power = np.gradient(known, np.log(WIDTHS[: len(strays)])) if len(strays) > 1 else -np.log2(FALL)
    return (np.array(strays) * ratio ** np.clip(power, 0, STEEPEST)).tolist()


def fit_cover(content: BundleContent, salt: int) -> BundleContent:
    """The content with classes, if there are several materials, and with a scatter, if there are objects."""
    if len(content.materials) > 1:
        content = replace(content, classes=fit_classes(content, salt))
    if content.objects:
        scatter, probabilities = fit_scatter(content, content.classes, salt)
        content = replace(content, scatter=scatter, probabilities=probabilities)
    return content


def fit_classes(content: BundleContent, salt: int) -> ClassesEntry:
    """The rule that gives every material its share of the ground, as far as possible its patch scale, and borders that
    stray as photographed ones do: bends by the noise's finer octaves, the rest by jitter.
    """
    wanted, seen = _find_strays(content), any(each.strays for each in content.materials)
    entry, steepness, strays = _fit_noise(content, salt, float(wanted[0]) if seen else None)
    jitter = _fit_jitter(content, steepness, wanted, strays)
    return replace(entry, jitter=jitter, rise=_fit_rise(content, steepness / content.side))


def _find_strays(content: BundleContent) -> Float[Array, "widths"]:
    """How far borders stray at half a width of `borders.WIDTHS` after the other, in tile sides, as far as jitter goes.

    It is the mean of the materials', and below the widths that were resolved it falls on as fast as before.
    """
    seen = [each.strays for each in content.materials if each.strays]
    least = min([len(each) for each in seen], default=0)
    strays = (np.mean([each[:least] for each in seen], 0) / content.side).tolist() if seen else [STRAY]
    fall = float(np.clip(strays[-1] / max(strays[-2], 1e-9), *FALLS)) if len(strays) > 1 else FALL
    while len(strays) <= MAX_JITTER:
        strays.append(strays[-1] * fall)
    return np.array(strays[: MAX_JITTER + 1])


def measure_strays_of(classes: Classes, salt: int) -> Float[Array, "widths"] | None:
    """Mean of `borders.measure_strays` over materials and some places of the terrain, in tile sides; without jitter.

    None where no border is met.
    """
    rng, found = np.random.default_rng([salt, 2]), []
    number = classes.materials if classes.materials > 2 else 1  # two have the same borders
    at = np.meshgrid(*[(np.arange(int(WINDOW * FINE)) + 0.5) * LATTICE / FINE] * 2, indexing="ij")
    for corner in rng.integers(-(2**20), 2**20, (WINDOWS, 2)):
        i, j = np.meshgrid(*(start * LATTICE + np.arange(WINDOW * LATTICE + 1) for start in corner))
        lattice = classes.lattice_scores(i.ravel(), j.ravel()).reshape(*i.shape, classes.materials)
        material = np.argmax([map_coordinates(layer, at, order=1) for layer in np.moveaxis(lattice, -1, 0)], 0)
        every = np.ones(material.shape, bool)
        found += [measure_strays((material == k).astype(float), every, FINE) for k in range(number)]
    seen = [strays for strays in found if strays is not None]
    return np.mean(seen, 0) / FINE if seen else None


def _fit_noise(
    content: BundleContent, salt: int, bent: float | None
) -> tuple[ClassesEntry, float, Float[Array, "widths"]]:
    """Classes by noise, how steeply their scores cross, per tile side, and how far their borders stray.

    Wavelengths are in proportion to the patch scales; one factor brings the mean length of stretches on straight lines
    to the measured one. Biases give the shares, and the ratio of each octave to the last gives `bent`, how far borders
    stray at the widest of `borders.WIDTHS`; where they were photographed straighter than any noise of such patches,
    stretches may be LONGEST times as long. All are measured on the noise itself and repeated. bent: None: not seen.
    """
    side = content.side
    wanted = np.maximum([material.patch_scale / side for material in content.materials], 1 / LATTICE)
    shares = np.array([material.share for material in content.materials])
    shares, waves, ratio, longer = shares / shares.sum(), wanted.copy(), GAIN, 1.0
    entry = ClassesEntry(salt, [], JitterEntry(1, [1.0], 0.0), RiseEntry(0.0, 0.0, *2 * [[0.0] * len(shares)]))
    steepness, strays, classes = 1.0, np.zeros(1), Classes(entry, len(waves), side)
    for _ in range(PASSES):
        waves = np.clip(waves, SHORTEST / LATTICE, WIDEST / LATTICE)
        most = int(np.clip(np.floor(np.log(LEAST_GAIN) / np.log(ratio)), 0, MAX_OCTAVES - 1))
        finer = [min(most, int(np.log2(wave * LATTICE / SHORTEST))) for wave in waves.tolist()]
        gains = [[*WIDER, *(ratio**k for k in range(number + 1))] for number in finer]
        noise = NoiseTerm("noise", 1.0, (waves * 2 ** len(WIDER)).tolist(), gains, [0.0] * len(waves))
        plain = Classes(replace(entry, rule=[noise]), len(waves), side)
        points = np.random.default_rng(salt).integers(-(2**30), 2**30, (2, SAMPLES))
        noise = replace(noise, biases=fit_biases(plain.lattice_scores(*points), shares).tolist())
        entry = replace(entry, rule=[noise])
        classes = Classes(entry, len(waves), side)
        stretches, steepness = measure_lines(classes, salt)
        waves = waves * np.exp(shares @ np.log(longer * wanted / stretches))
        if bent is not None and (measured := measure_strays_of(classes, salt)) is not None:
            strays = measured
            missing = bent / max(float(strays[0]), 1e-9)
            ratio = float(np.clip(ratio * np.clip(missing, 0.25, 2), LEAST_GAIN / 2, MOST_GAIN))
            longer = float(np.clip(longer / max(missing, 1e-9), 1, LONGEST))
    if bent is None and (measured := measure_strays_of(classes, salt)) is not None:
        strays = measured
    return entry, steepness, strays


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


def _fit_jitter(
    content: BundleContent, steepness: float, wanted: Float[Array, "k"], strays: Float[Array, "widths"]
) -> JitterEntry:
    """The jitter that makes borders stray as wanted at the narrower widths, where the noise of classes does not.

    Args:   steepness: of scores, per tile side. strays: without jitter, from the widest width on.
    """
    octaves = int(np.clip(1 + np.log2(content.side / (JITTER * FINEST * content.spacing)), 1, MAX_JITTER))
    own = [*strays, *(strays[-1] / 4**k for k in range(1, octaves + 1))][: octaves + 1]  # a smooth line
    missing = np.maximum(wanted[: octaves + 1] ** 2 - np.square(own), 0)[1:]
    heights = np.sqrt(missing) * steepness / TYPICAL
    most = float(heights.max())
    return JitterEntry(JITTER, (heights / most).tolist() if most else [1.0], float(heights.sum()) / CONTRAST)


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
