"""A made-up patch of ground with a known look, and photos of it."""

from dataclasses import replace

import numpy as np

from dav_gswt import cameras, views
from dav_gswt.active import poses
from dav_gswt.coarse import discs, ground, underlay
from dav_gswt.field import joined
from dav_gswt.raster import render

FRAME = {
    "kind": "photos",
    "unit": "metre",
    "flying_height": 6.0,
    "exemplar": {"west": 0.0, "south": 0.0, "side": 3.2},
    "extent": {"west": 0.0, "south": 0.0, "east": 3.2, "north": 3.2},
}


def look(x, y):
    """Colours of a place: stripes to the north, a gradient to the east."""
    return np.stack([0.3 + 0.1 * x, 0.5 + 0.2 * np.sin(4 * y), 0.4 + 0 * x], -1).astype(np.float32)


def grid(spacing=0.1):
    flat = ground.lay(FRAME, np.zeros((0, 3)), spacing, cap=10**6, block=32, margin=0.0)
    return replace(flat, seen=np.ones(flat.shape, bool))


def field(of=None):
    """The discs and their underlay."""
    of = of or grid()
    layer = discs.ground_discs(of, look(*of.centres[:, :2].T))
    return joined([layer, underlay.beneath(of, layer)])


def pool(count, turn):
    """Candidate poses around the patch, `turn` radians from one to the next."""
    found = []
    for i in range(count):
        eye = [1.6 + 2.5 * np.cos(turn * i), 1.6 + 2.5 * np.sin(turn * i), 3.0]
        camera = cameras.pinhole(eye, [1.6, 1.6, 0.0], 96, 96, 45.0)
        found.append((poses.of_camera(f"p{i}.png", camera, FRAME), camera))
    return found


def photos(count=3, size=48):
    """Pictures of the field from above, over black."""
    found = []
    for i in range(count):
        eye = [1.6 + 0.8 * np.cos(2.1 * i), 1.6 + 0.8 * np.sin(2.1 * i), 4.0]
        camera = cameras.pinhole(eye, [1.6, 1.6, 0], size, size, 40.0)
        image = np.clip(render(field(), camera).colour, 0, 1).astype(np.float32)
        found.append(views.View(f"photo_{i}", camera, image, np.ones((size, size), np.float32)))
    return found
