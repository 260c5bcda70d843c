"""docs/formats.md as a specification: a reader written from the page alone agrees with the library."""

import json
import math
import re
import struct

import numpy as np
import pytest
from fixtures.bundles import Ground, write_bundle

from dav_gswt.bundle import chunks
from dav_gswt.bundle.chunks import ChunkEntry
from dav_gswt.bundle.encoding import Encoding

SMALL = Ground(discs=4, levels=2, variants=2)


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundle")
    return folder, write_bundle(folder, SMALL)


@pytest.fixture(scope="module")
def page(root):
    return (root / "docs/formats.md").read_text(encoding="utf-8")


def record(data, encoding):
    """A Gaussian as the page says: centre, deviations, quaternion w x y z, colour, opacity."""
    x, y, z, *rest = struct.unpack("<3H10B", data)
    centre = [o + s * p for o, s, p in zip(encoding["origin"], encoding["step"], (x, y, z), strict=True)]
    low, rise = encoding["log_scale"]
    xyz = [math.sin(math.pi / 8) * (r - 127) / 127 for r in rest[3:6]]
    w = math.sqrt(max(0, 1 - sum(t * t for t in xyz)))
    return centre, [math.exp(low + rise * s) for s in rest[:3]], [w, *xyz], [c / 255 for c in rest[6:9]], rest[9] / 255


def test_a_chunk_is_read_as_the_page_says(bundle):
    folder, manifest = bundle
    entry = manifest["tiles"][5]["chunks"][0]
    data, count = (folder / entry["file"]).read_bytes(), entry["count"]
    field, orders = chunks.read_chunk(folder, ChunkEntry(**entry), Encoding(**manifest["encoding"]))
    assert len(data) == entry["bytes"] == count * (16 + 2 * len(entry["orders"]))
    for n in range(count):
        centre, deviations, quat, colour, opacity = record(data[16 * n : 16 * n + 16], manifest["encoding"])
        np.testing.assert_allclose(field.means[n], centre, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(np.exp(field.log_scales[n]), deviations, rtol=1e-5)
        np.testing.assert_allclose(field.quats[n], quat, atol=1e-6)
        np.testing.assert_allclose(field.base_colours[n], colour, atol=1e-6)
        assert 1 / (1 + math.exp(-field.opacity_logits[n])) == pytest.approx(opacity, abs=0.5 / 255 + 1e-6)
    for k, order in enumerate(orders):
        start = 16 * count + 2 * k * count
        assert list(struct.unpack(f"<{count}H", data[start : start + 2 * count])) == order.tolist()


def test_orders_run_from_back_to_front(bundle):
    folder, manifest = bundle
    entry = manifest["tiles"][0]["chunks"][0]
    field, orders = chunks.read_chunk(folder, ChunkEntry(**entry), Encoding(**manifest["encoding"]))
    for k, order in zip(entry["orders"], orders, strict=True):
        depth = (field.means @ np.array(manifest["directions"][k]))[order]
        assert (np.diff(depth) < 1e-3 * np.ptp(depth) + 1e-6).all()


def test_tiles_are_placed_as_the_page_says(root):
    """Written from the page's text, against the golden file."""
    mask = 0xFFFFFFFF
    golden = json.loads((root / "tests/golden/tile_choice.json").read_text())

    def mix(h):
        h = ((h ^ (h >> 16)) * 0x85EBCA6B) & mask
        h = ((h ^ (h >> 13)) * 0xC2B2AE35) & mask
        return h ^ (h >> 16)

    def hashed(i, j, axis, salt):
        first = mix(((i * 0x8DA6B343) ^ (axis * 0xCB1AB31F) ^ salt) & mask)
        return mix((first + j * 0xD8163841) & mask)

    def edges(i, j, salt):
        west, east = hashed(i, j, 0, salt) & 1, hashed(i + 1, j, 0, salt) & 1
        south, north = hashed(i, j, 1, salt) & 1, hashed(i, j + 1, 1, salt) & 1
        return 8 * west + 4 * north + 2 * east + south

    def variant(i, j, salt, variants):
        return (hashed(i, j, 2, salt) >> 1) % variants

    def tile(i, j, salt, variants):
        chosen = variant(i, j, salt, variants)
        if (i + j) % 2:
            near = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
            taken = {variant(*n, salt, variants) for n in near if edges(*n, salt) == edges(i, j, salt)}
            chosen = next((c for c in ((chosen + s) % variants for s in range(variants)) if c not in taken), chosen)
        return 16 * chosen + edges(i, j, salt)

    assert golden["cells"]
    for cell in golden["cells"]:
        assert tile(cell["i"], cell["j"], cell["salt"], cell["variants"]) == cell["tile"]


def test_the_page_names_every_key_of_the_manifest(root, page):
    schema = json.loads((root / "workflow/schemas/davgswt.schema.json").read_text())
    named = set(re.findall(r"`(\w+)`", page))

    def keys(node):
        for key, value in node.get("properties", {}).items():
            yield key
            yield from keys(value)
        if "items" in node:
            yield from keys(node["items"])
        for part in node.get("$defs", {}).values():
            yield from keys(part)

    assert set(keys(schema)) <= named
