"""The server: this machine only, this folder only, and a taken port is named."""

import http.client
import os
import re
import socket
import threading

import pytest

from dav_gswt.cli.main import main
from dav_gswt.errors import InputError
from dav_gswt.terrain import serve


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    outside = tmp_path_factory.mktemp("served")
    page = outside / "page"
    (page / "parts").mkdir(parents=True)
    for name in ("index.html", "davgswt.json", "main.js", "style.css", "parts/a.bin"):
        (page / name).write_text(name)
    (outside / "secret.txt").write_text("secret")
    (page / "way-out.txt").symlink_to(outside / "secret.txt")
    (page / "folder-out").symlink_to(outside)
    os.mkfifo(page / "pipe.bin")
    return page


@pytest.fixture(scope="module")
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


def test_files_have_the_type_that_browsers_ask_of_them(ask):
    for path, kind in (
        ("/", "text/html; charset=utf-8"),
        ("/main.js?still", "text/javascript; charset=utf-8"),
        ("/style.css", "text/css; charset=utf-8"),
        ("/davgswt.json", "application/json"),
        ("/parts/a.bin", "application/octet-stream"),
    ):
        status, headers, body = ask(path)
        assert (status, headers["Content-Type"]) == (200, kind)
        assert int(headers["Content-Length"]) == len(body) > 0


@pytest.mark.parametrize(
    "path",
    [
        *("/../secret.txt", "/%2e%2e/secret.txt", "/parts/../../secret.txt", "/..%2fsecret.txt", "/way-out.txt"),
        *("/folder-out/secret.txt", "/..\\secret.txt", "/%252e%252e/secret.txt", "http://127.0.0.1/../secret.txt"),
        *("/%00", "/secret.txt%00.bin", "/%ed%a0%80", "/" + "x" * 5000, "/pipe.bin"),
        *("/parts/", "/parts", "//parts", "/nothing"),
    ],
    ids=lambda path: path[:40],
)
def test_nothing_but_files_of_the_folder_is_served(ask, path, capfd):
    status, _, body = ask(path)
    assert status == 404 and b"secret" not in body.lower().replace(b"secret.txt", b"")
    assert capfd.readouterr().err == "", "nothing was raised"


def test_requests_for_this_machine_are_answered(ask):
    hosts = "LOCALHOST:8000", "localhost.:80", "127.0.0.1", "[::1]:8000"
    assert [ask("/main.js", host=host)[0] for host in hosts] == [200] * 4


@pytest.mark.parametrize(
    "host",
    [
        *("evil.example:8000", "localhost.evil.example", "127.0.0.1.evil.example", "evil-localhost", ""),
        *("0.0.0.0", "192.168.1.7:8000", "127.0.0.1@evil.example", "localhost:80:90", "localhost/x"),
    ],
)
def test_requests_for_other_names_are_refused(ask, host):
    """A name that points at this machine (DNS rebinding) would let any web page read what is served."""
    status, _, body = ask("/main.js", "GET", host)
    assert status == 421 and b"main.js" not in body
    assert ask("/main.js", "HEAD", host)[0] == 421


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


def test_writes_are_refused(ask):
    assert [ask("/", method)[0] for method in ("POST", "PUT", "OPTIONS")] == [501] * 3


def test_it_listens_on_loopback_alone_and_names_a_taken_port(folder, running, capsys):
    host, port = running.server_address
    assert host == "127.0.0.1"
    assert main(["serve", str(folder), "--port", str(port)]) == 1
    assert f"--port {port}: [Errno 98] Address already in use" in capsys.readouterr().err
    with pytest.raises(InputError, match="--port 70000"):
        serve.create_server(folder, 70000)
