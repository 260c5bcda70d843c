"""The rasterizer in use beside the oracle in float64 (docs/research/numerics.md), and what follows from its weights."""

import numpy as np
from numpy import ndarray as Array

from dav_gswt.geometry import cameras
from dav_gswt.geometry.cameras import Camera
from dav_gswt.raster import Rasterizer, harmonics
from dav_gswt.study.stability.formula import LAW, Formula, Point, Tolerance
from dav_gswt.views import fisher

SIDE = 24
PINHOLE = cameras.pinhole((0.3, -4.0, 1.5), (0.0, 0.0, 0.0), SIDE, SIDE, 60.0)
MAP = cameras.top_down(-2.0, -2.0, SIDE, SIDE, 4 / SIDE, 5.0)
AHEAD = Camera(np.eye(3), np.zeros(3), 20.0, 20.0, SIDE / 2, SIDE / 2, SIDE, SIDE)
VIEWS = (("pinhole", PINHOLE), ("map", MAP))
RIM = 1 / 255  # what alpha jumps by where a splat ends
Arrays = dict[str, Array]


def cloud(n: int, seed: int = 0, channels: int = 3, **more) -> Arrays:
    """A cloud of radius 1 around the origin, of all opacities, anisotropic; `more` replaces arrays by name."""
    rng = np.random.default_rng(seed)
    arrays = {
        "means": rng.normal(0, 1, (n, 3)),
        "log_scales": rng.normal(-2, 0.7, (n, 3)),
        "quats": rng.normal(size=(n, 4)),
        "opacity_logits": rng.normal(0, 2, n),
        "colours": rng.uniform(0, 1, (n, channels)),
    }
    return {name: np.ascontiguousarray(a, np.float32) for name, a in (arrays | more).items()}


def drawn(arrays: Arrays, camera: Camera, near: float = 0.01, antialiased: bool = False) -> Array:
    """Colour and alpha."""
    seen = Rasterizer(near=near, antialiased=antialiased).forward(**arrays, camera=camera)
    return np.concatenate([seen.colour, seen.alpha[..., None]], -1)


def drawn_slowly(arrays: Arrays, camera: Camera, near: float = 0.01, antialiased: bool = False) -> Array:
    import torch

    from dav_gswt.raster import oracle

    tensors = {name: torch.tensor(a, dtype=torch.float64) for name, a in arrays.items()}
    colour, alpha, _ = oracle.forward(**tensors, camera=camera, near=near, antialiased=antialiased)
    return torch.cat([colour, alpha[..., None]], -1).numpy()


def in_all_views(at: str, arrays: Arrays) -> list[Point]:
    return [
        Point(f"{at}, {view}{', antialiased' * smooth}", (arrays, camera, 0.01, smooth))
        for view, camera in VIEWS
        for smooth in (False, True)
    ]


def sized(*scales: float) -> Arrays:
    """A cloud of 40 whose axes are all so long, of small opacity so that it stays a cloud."""
    return cloud(40, log_scales=np.tile(np.log(scales), (40, 1)), opacity_logits=np.full(40, -1.0))


def _usual() -> list[Point]:
    return in_all_views("a cloud of 200", cloud(200))


def _near_plane() -> list[Point]:
    found = []
    for near in (1e-3, 1.0, 10.0):
        for share in (-1.0, 0.0, 1e-8, 0.99, 1.0, 1.01):
            z = float(np.float32(near) * np.float32(share))
            one = cloud(1, means=[[0, 0, z]], log_scales=np.full((1, 3), np.log(0.1 * near)), opacity_logits=[1.0])
            found.append(Point(f"depth {share:g} of near {near:g}", (one, AHEAD, float(np.float32(near)), False)))
    return found


def _scales() -> list[Point]:
    return [p for s in (1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6) for p in in_all_views(f"scale {s:g}", sized(s, s, s))]


def _needles() -> list[Point]:
    shapes = (1e3, 1e-3, 1e-3), (1.0, 1e-6, 1e-6), (1e6, 1.0, 1.0), (1e6, 1e-12, 1e-12)
    return [p for shape in shapes for p in in_all_views(f"needles {shape[0]:g} x {shape[1]:g}", sized(*shape))]


def _opacities() -> list[Point]:
    logits = (-1e4, -100.0, -5.55, 0.0, 4.5, 17.0, 100.0, 1e4)
    return [p for x in logits for p in in_all_views(f"logit {x:g}", cloud(60, opacity_logits=np.full(60, x)))]


def _turns() -> list[Point]:
    quats = cloud(60)["quats"]
    sizes = (1e-30, 1e-12, -1.0, 7.0, 1e12, 1e30)
    return [p for s in sizes for p in in_all_views(f"quaternions times {s:g}", cloud(60, quats=quats * np.float32(s)))]


def _turned_slowly(arrays: Arrays, *how) -> Array:
    quats = arrays["quats"].astype(np.float64)
    unit = quats / np.linalg.norm(quats / np.abs(quats).max(), axis=1, keepdims=True) / np.abs(quats).max()
    return drawn_slowly(arrays | {"quats": unit}, *how)


def _ties() -> list[Point]:
    means = cloud(60)["means"]
    means[:, 2] = 0.5
    return [Point("60 at one depth, map", (cloud(60, means=means), MAP, 0.01, False))]


def _around() -> list[Point]:
    found = []
    for elevation in (90.0, -90.0, 0.0, 45.0):
        for azimuth in (0.0, 360.0, 359.999999):
            e, a = np.radians(elevation), np.radians(azimuth)
            eye = 4 * np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
            camera = cameras.pinhole(eye, (0.0, 0.0, 0.0), SIDE, SIDE, 60.0)
            found.append(Point(f"elevation {elevation:g}, azimuth {azimuth:g}", (cloud(100), camera, 0.01, False)))
    return found


def _clear() -> list[Point]:
    white = np.ones((200, 3))
    shapes = {"a cloud": cloud(200, colours=white), "needles": sized(1e6, 1e-6, 1e-6) | {"colours": white[:40]}}
    return [Point(f"{name}, {view}", (arrays, camera)) for name, arrays in shapes.items() for view, camera in VIEWS]


def _whole(arrays: Arrays, camera: Camera) -> Array:
    """White over white: what is taken and what is left."""
    seen = Rasterizer().forward(**{k: np.ascontiguousarray(v, np.float32) for k, v in arrays.items()}, camera=camera)
    return seen.colour + (1 - seen.alpha)[..., None]


def _gradient_points() -> list[Point]:
    """No axes alike: the turn of a ball has the gradient 0, and an error over that says nothing."""
    shapes = {f"scales about {s:g}": sized(s, 0.5 * s, 2 * s) for s in (1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6)}
    shapes["a cloud"] = cloud(60)
    return [Point(f"{name}, {view}", (arrays, camera)) for name, arrays in shapes.items() for view, camera in VIEWS]


def _gradients(arrays: Arrays, camera: Camera) -> Array:
    raster = Rasterizer()
    raster.forward(**arrays, camera=camera)
    found = raster.backward(_towards())
    return np.concatenate([_unit(getattr(found, name), arrays, camera, name) for name in arrays])


def _unit(values: Array, arrays: Arrays, camera: Camera, name: str) -> Array:
    """A parameter's gradient over its length."""
    length = np.linalg.norm(_slow_gradients(arrays, camera)[name])
    return np.ravel(values).astype(np.float64) / (length if length > 0 else 1.0)


def _gradients_slowly(arrays: Arrays, camera: Camera) -> Array:
    return np.concatenate([_unit(g, arrays, camera, name) for name, g in _slow_gradients(arrays, camera).items()])


def _slow_gradients(arrays: Arrays, camera: Camera) -> Arrays:
    import torch

    from dav_gswt.raster import oracle

    leaves = {name: torch.tensor(a, dtype=torch.float64, requires_grad=True) for name, a in arrays.items()}
    colour, _, _ = oracle.forward(**leaves, camera=camera)
    (colour * torch.from_numpy(_towards()).double()).sum().backward()
    return {name: leaf.grad.numpy() for name, leaf in leaves.items()}


def _towards() -> Array:
    return np.random.default_rng(1).standard_normal((SIDE, SIDE, 3)).astype(np.float32)


def _known() -> list[Point]:
    return [
        Point(f"{view}, {know:g} known before", (cloud(60), camera, know))
        for view, camera in VIEWS
        for know in (1.0, 1e6)
    ]


def _information(arrays: Arrays, camera: Camera, know: float) -> float:
    raster = Rasterizer()
    raster.forward(**arrays, camera=camera)
    return fisher.information_gain(raster.contributions(), np.full(len(arrays["means"]), know))


def _information_slowly(arrays: Arrays, camera: Camera, know: float) -> float:
    import torch

    from dav_gswt.raster import oracle

    tensors = {name: torch.tensor(a, dtype=torch.float64) for name, a in arrays.items()}
    splats = oracle.project(**tensors, camera=camera, view=oracle.moved(camera, None, tensors["means"]))
    x, y = np.meshgrid(np.arange(SIDE) + 0.5, np.arange(SIDE) + 0.5)
    weight = oracle.weights(splats, torch.from_numpy(np.stack([x.ravel(), y.ravel()], 1)))
    return float((weight**2).sum() / know)


def _directions() -> list[Point]:
    rng = np.random.default_rng(0)
    along = np.concatenate([np.eye(3), -np.eye(3), rng.standard_normal((60, 3))])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return [
        Point(
            f"coefficients of {size:g}, degree {k**0.5 - 1:g}",
            (rng.standard_normal((66, k, 3)).astype(np.float32) * np.float32(size), along),
        )
        for size in (1e-12, 1.0, 1e6)
        for k in (1, 4, 9, 16)
    ]


def _harmonic_slowly(sh: Array, along: Array) -> Array:
    import torch

    from dav_gswt.raster import oracle

    basis = oracle.basis(torch.from_numpy(along), sh.shape[1]).numpy()
    return np.maximum(0.5 + (basis[:, :, None] * sh.astype(np.float64)).sum(1), 0) / _size(sh)


def _size(sh: Array) -> float:
    """The largest coefficient, 1 if that is less: what colours are measured by."""
    return max(1.0, float(np.abs(sh).max()))


def _harmonic(sh: Array, along: Array) -> Array:
    return harmonics.colours(sh, along.astype(np.float32)) / _size(sh)


RASTER, ITEM = "rasterizer in use, oracle in float64", "Renderer at the extremes"
STEEP = Tolerance(0.0, 2e-2, "along a needle terms of 1e4 cancel in the exponent: alpha is off where it is steep")
AT_RIM = Tolerance(0.0, 3 * RIM, "at a splat's rim alpha jumps by 1/255, and it may be blended over two others")
FORMULAS = [
    Formula(
        ITEM,
        "a usual picture",
        RASTER,
        "200 Gaussians, both cameras, antialiased or not",
        "float32",
        _usual,
        drawn,
        drawn_slowly,
        Tolerance(0.0, 2e-5, "some hundred roundings of 6e-8 a pixel"),
    ),
    Formula(
        ITEM,
        "near plane",
        RASTER,
        "depths -1, 0, 1e-8, 0.99, 1, 1.01 of near",
        "float32",
        _near_plane,
        drawn,
        drawn_slowly,
        Tolerance(0.0, 2e-5, "some hundred roundings of 6e-8 a pixel"),
    ),
    Formula(ITEM, "scales", RASTER, "1e-12 to 1e6", "float32", _scales, drawn, drawn_slowly, AT_RIM),
    Formula(ITEM, "needles", RASTER, "ratios 1e6 to 1e18", "float32", _needles, drawn, drawn_slowly, STEEP),
    Formula(ITEM, "opacity 0 and 1", RASTER, "logits -1e4 to 1e4", "float32", _opacities, drawn, drawn_slowly, AT_RIM),
    Formula(
        ITEM,
        "quaternions of any length and sign",
        RASTER,
        "lengths 1e-30 to 1e30",
        "float32",
        _turns,
        drawn,
        _turned_slowly,
        AT_RIM,
    ),
    Formula(ITEM, "equal depths, by index", RASTER, "60 at one depth", "float32", _ties, drawn, drawn_slowly, AT_RIM),
    Formula(
        ITEM,
        "all around",
        RASTER,
        "elevation -90 to 90, azimuth 0 and 360",
        "float32",
        _around,
        drawn,
        drawn_slowly,
        AT_RIM,
    ),
    Formula(
        ITEM,
        "alpha and what is left make 1",
        RASTER,
        "clouds, needles",
        "float32",
        _clear,
        _whole,
        lambda arrays, camera: np.ones((SIDE, SIDE, 3)),
        Tolerance(0.0, 5e-6, "the sum of weights against the product of 1 - alpha"),
    ),
    Formula(
        ITEM,
        "gradients, each over its length",
        RASTER,
        "scales 1e-12 to 1e6",
        "float32",
        _gradient_points,
        _gradients,
        _gradients_slowly,
        Tolerance(0.0, 1e-3, "a pixel at a splat's rim that one of the two leaves out"),
    ),
    Formula(
        ITEM,
        "Fisher information of a photo",
        "Jiang et al. 2024",
        "60 Gaussians, 1 and 1e6 known before",
        "float32",
        _known,
        _information,
        _information_slowly,
        Tolerance(1e-4, 0.0, "pixels at rims, one in some thousand"),
    ),
    Formula(
        ITEM,
        "spherical harmonics, over the largest coefficient",
        "3DGS",
        "degrees 0 to 3, coefficients 1e-12 to 1e6, along the axes",
        "float32",
        _directions,
        _harmonic,
        _harmonic_slowly,
        Tolerance(0.0, *LAW),
    ),
]
