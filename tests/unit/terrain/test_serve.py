"""The server: this machine only, this folder only, and one clear message where it cannot start."""

import http.client
import os
import re
import socket
import threading
from pathlib import Path

import pytest

from dav_gswt.errors import InputError
from dav_gswt.terrain import serve


@pytest.fixture
def folder(tmp_path):
    page = tmp_path / "page"
    (page / "chunks").mkdir(parents=True)
    for name in ("index.html", "davgswt.json", "main.js", "style.css", "chunks/a.bin"):
        (page / name).write_text(name)
    (tmp_path / "secret.txt").write_text("secret")
    (page / "way-out.txt").symlink_to(tmp_path / "secret.txt")
    (page / "folder-out").symlink_to(tmp_path)
    os.mkfifo(page / "pipe.bin")
    return page


@pytest.fixture
def running(folder):
    """The server, answering in a thread."""
    with serve.create_server(folder, 0) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.fixture
def ask(running):
    """Ask the server for a path as it stands; returns status, headers and body."""

    def get(path, method="GET", host=None):
        connection = http.client.HTTPConnection(*running.server_address, timeout=5)
        connection.request(method, path, headers={} if host is None else {"Host": host})
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return answer.status, answer.headers, body

    return get


def ask_by_lines(running, *lines: str) -> bytes:
    """The first line of the answer to a request that is sent as it stands."""
    with socket.create_connection(running.server_address, timeout=5) as connection:
        connection.sendall("\r\n".join([*lines, "Connection: close", "", ""]).encode("latin-1"))
        return connection.makefile("rb").readline()


@pytest.mark.parametrize(
    "path, kind",
    [
        ("/", "text/html; charset=utf-8"),
        ("/main.js?still", "text/javascript; charset=utf-8"),
        ("/style.css", "text/css; charset=utf-8"),
        ("/davgswt.json", "application/json"),
        ("/chunks/a.bin", "application/octet-stream"),
    ],
)
def test_files_have_the_type_that_browsers_ask_of_them(ask, path, kind):
    status, headers, body = ask(path)
    assert (status, headers["Content-Type"]) == (200, kind)
    assert int(headers["Content-Length"]) == len(body) > 0


@pytest.mark.parametrize(
    "path",
    [
        *("/../secret.txt", "/%2e%2e/secret.txt", "/chunks/../../secret.txt", "/..%2fsecret.txt", "/way-out.txt"),
        *("/folder-out/secret.txt", "/..\\secret.txt", "/..%5csecret.txt", "/%252e%252e/secret.txt"),
        *("//secret.txt", "/%2e%2e%2fsecret.txt", "/chunks/..%2f..%2fsecret.txt", "http://127.0.0.1/../secret.txt"),
        *("/%00", "/secret.txt%00.bin", "/%ed%a0%80", "/" + "x" * 5000, "/pipe.bin"),
    ],
    ids=lambda path: path[:40],
)
def test_no_path_leads_out_of_the_folder(ask, path, capfd):
    status, _, body = ask(path)
    assert status == 404 and b"secret" not in body.lower().replace(b"secret.txt", b"")
    assert capfd.readouterr().err == "", "nothing was raised"


@pytest.mark.parametrize(
    "host", ["localhost", "LOCALHOST:8000", "localhost.:80", "127.0.0.1", "127.0.0.1:65535", "[::1]:8000"]
)
def test_requests_for_this_machine_are_answered(ask, host):
    assert ask("/main.js", host=host)[0] == 200


@pytest.mark.parametrize(
    "host",
    [
        *("evil.example", "evil.example:8000", "localhost.evil.example", "127.0.0.1.evil.example", "evil-localhost"),
        *("", "0.0.0.0", "192.168.1.7:8000", "[fe80::1]", "127.0.0.1@evil.example", "localhost:80:90", "localhost/x"),
    ],
)
@pytest.mark.parametrize("method", ["GET", "HEAD"])
def test_requests_for_other_names_are_refused(ask, host, method):
    """A name that points at this machine (DNS rebinding) would let any web page read what is served."""
    status, _, body = ask("/main.js", method, host)
    assert status == 421 and b"main.js" not in body


@pytest.mark.parametrize("lines", [(), ("Host: evil.example", "Host: localhost"), ("Host: localhost", "Host: evil")])
def test_requests_without_one_name_are_refused(running, lines):
    assert b" 421 " in ask_by_lines(running, "GET /main.js HTTP/1.1", *lines)


def test_answers_carry_the_policy_of_the_page(ask, root):
    page = (root / "workflow/viewer/index.html").read_text(encoding="utf-8")
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert policy
    for path in ("/", "/main.js", "/nothing"):
        _, headers, _ = ask(path)
        assert headers["Content-Security-Policy"] == policy[1] + "; frame-ancestors 'none'"
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert headers["Server"].strip() == "DAV-GSWT", "no versions of what runs here"


@pytest.mark.parametrize("page", ["workflow/viewer/index.html", "workflow/forced_choice/index.html"])
def test_pages_run_no_inline_script_and_no_eval(root: Path, page):
    text = (root / page).read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy and policy[1].startswith("default-src 'none'; ")
    assert "unsafe" not in policy[1] and "*" not in policy[1] and "http" not in policy[1]
    assert not re.search(r"<script(?![^>]*\bsrc=)|\son\w+=|\sstyle=|javascript:", text)


@pytest.mark.parametrize(
    "path, method, status",
    [
        *(("/chunks/", "GET", 404), ("/chunks", "GET", 404), ("//chunks", "GET", 404), ("/nothing", "GET", 404)),
        *(("/", "POST", 501), ("/", "PUT", 501), ("/", "OPTIONS", 501)),
    ],
)
def test_listings_missing_files_and_writes_are_refused(ask, path, method, status):
    assert ask(path, method)[0] == status


def test_it_listens_on_loopback_alone(folder):
    with serve.create_server(folder, 0) as running:
        assert running.server_address[0] == "127.0.0.1"


def test_a_taken_port_is_named(folder, capsys):
    with serve.create_server(folder, 0) as running:
        port = running.server_address[1]
        assert serve.main([str(folder), "--port", str(port)]) == 1
    assert f"port {port} is taken" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["index.html", "davgswt.json"])
def test_a_folder_without_a_page_is_named(folder, name, capsys):
    (folder / name).unlink()
    assert serve.main([str(folder)]) == 1
    said = capsys.readouterr().err
    assert f"{folder}: no page here ({name} is missing)" in said and len(said.splitlines()) == 1


def test_a_port_that_is_none_is_refused(folder):
    with pytest.raises(InputError, match="--port 70000"):
        serve.create_server(folder, 70000)
