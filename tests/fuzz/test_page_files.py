"""Files that are dropped onto the page, mutated: its own modules read them in Node.js, as the page does."""

import base64
import hashlib
import json
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import pytest
from fixtures import bundles, fuzzing
from fixtures.bundles import Ground
from fixtures.compositions import Composed
from fixtures.fuzzing import FACTOR, FLOOR, SECONDS, fuzz, mutate_bytes, mutate_json, mutate_zip, randoms
from fixtures.land_covers import write_cover_bundle
from hypothesis import given

pytestmark = pytest.mark.slow
VIEWER = Path(__file__).parents[2] / "workflow/viewer"

COMPOSED = Composed()


@pytest.fixture(scope="module")
def page():
    """Have the page's modules read files; asserts that they do, or refuse them with one message."""
    node = shutil.which("node")
    if not node:
        pytest.skip("needs Node.js 20 or newer")
    command = [node, "--expose-gc", "--max-old-space-size=2048", str(Path(__file__).with_name("open_files.mjs"))]
    process = subprocess.Popen([*command, str(VIEWER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdin and process.stdout

    def read(name: str, size: int, **request) -> dict:
        outcomes = fuzzing.tried.setdefault(name, Counter())
        outcomes["tried"] += 1
        process.stdin.write(json.dumps(request) + "\n")
        process.stdin.flush()
        answer = json.loads(process.stdout.readline() or '{"failed": "the reader ended"}')
        assert "failed" not in answer, answer["failed"]
        assert answer["seconds"] <= SECONDS and answer["grown"] <= FLOOR + FACTOR * size, answer
        if "read" in answer:
            assert answer["read"]["finite"], answer
            outcomes["read"] += 1
        else:
            assert 0 < len(answer["refused"]) < fuzzing.LONGEST and "\n" not in answer["refused"]
            outcomes["refused"] += 1
        return answer

    yield read
    process.stdin.close()
    process.wait(10)


def encode(data: bytes) -> str:
    return base64.b64encode(data).decode()


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The files of a small bundle, and its manifest."""
    folder = tmp_path_factory.mktemp("bundle") / "bundle"
    manifest = bundles.write_bundle(folder, Ground(discs=4))
    surface = {"kind": "hills", "height": 0.3, "wavelength": 9.0, "octaves": 3, "salt": 5}
    data = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*.bin"))}
    return data, manifest | {"heights": surface}


def test_the_bundle_itself_is_read(page, files):
    data, manifest = files
    named = {name: encode(content) for name, content in data.items()}
    found = page("page: as it is", 20_000, files=named | {"davgswt.json": encode(json.dumps(manifest).encode())})
    assert found["read"]["count"] > 100


@fuzz
@given(random=randoms)
def test_manifests(page, files, random):
    data, manifest = files
    named = {name: encode(content) for name, content in data.items()}
    text = mutate_json(random, manifest)
    page("page: davgswt.json", len(text) + 20_000, files=named | {"davgswt.json": encode(text)})


@pytest.fixture(scope="module")
def cover(tmp_path_factory):
    """The files of a bundle of two materials with an object, and its manifest."""
    folder = tmp_path_factory.mktemp("bundle") / "bundle"
    write_cover_bundle(folder)
    data = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*.bin"))}
    return data, json.loads((folder / "davgswt.json").read_text())


@fuzz
@given(random=randoms)
def test_materials_and_objects(page, cover, random):
    data, manifest = cover
    named = {name: encode(content) for name, content in data.items()}
    keys = ("materials", "classes", "objects", "scatter")
    rest = json.dumps({key: value for key, value in manifest.items() if key not in keys}).encode()
    text = rest[:-1] + b", " + mutate_json(random, {key: manifest[key] for key in keys})[1:]
    page("page: materials and objects", len(text) + 600_000, files=named | {"davgswt.json": encode(text)})


@fuzz
@given(random=randoms)
def test_parts(page, random):
    """A part of a bundle of recipes is changed, unpacked or packed, and mostly its entry in the manifest with it."""
    name = random.choice(sorted(COMPOSED.parts))
    content = mutate_bytes(random, COMPOSED.parts[name], 300)
    files = COMPOSED.files(**({name: content} if content else {}))
    manifest, file = json.loads(files["davgswt.json"]), f"parts/{name}.bin"
    if random.random() < 0.3:
        files[file] = mutate_bytes(random, files[file], 300)
        entry = next(part for part in manifest["parts"] if part["file"] == file)
        entry |= {"bytes": len(files[file]), "sha256": hashlib.sha256(files[file]).hexdigest()}
        if random.random() < 0.3:
            entry["size"] = random.choice((0, 1, 19, 2**20, 2**40))
    files["davgswt.json"] = json.dumps(manifest).encode()
    page("page: parts", 2**21, files={name: encode(content) for name, content in files.items()})


@pytest.mark.parametrize("kind", ["zip of a bundle", "gswt.zip"])
@fuzz
@given(random=randoms)
def test_zips(page, files, set_of_tiles, kind, random):
    data, manifest = files
    bundle = {"a/davgswt.json": json.dumps(manifest).encode()} | {f"a/{n}": c for n, c in data.items()}
    zipped = mutate_zip(random, bundle if kind == "zip of a bundle" else set_of_tiles)
    page(f"page: {kind}", len(zipped) + 40_000, zip=encode(zipped))
