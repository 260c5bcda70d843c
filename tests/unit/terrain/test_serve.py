"""The server: this machine only, this folder only, and one clear message where it cannot start."""

import http.client
import threading

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
    return page


@pytest.fixture
def ask(folder):
    """Ask the server for a path as it stands; returns status, headers and body."""
    with serve.create_server(folder, 0) as running:
        thread = threading.Thread(target=running.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()

        def get(path, method="GET"):
            connection = http.client.HTTPConnection(*running.server_address, timeout=5)
            connection.request(method, path)
            answer = connection.getresponse()
            body = answer.read()
            connection.close()
            return answer.status, answer.headers, body

        yield get
        running.shutdown()
        thread.join()


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
    "path", ["/../secret.txt", "/%2e%2e/secret.txt", "/chunks/../../secret.txt", "/..%2fsecret.txt", "/way-out.txt"]
)
def test_no_path_leads_out_of_the_folder(ask, path):
    status, _, body = ask(path)
    assert status == 404 and b"secret" not in body.lower().replace(b"secret.txt", b"")


@pytest.mark.parametrize(
    "path, method, status", [("/chunks/", "GET", 404), ("/nothing", "GET", 404), ("/", "POST", 501)]
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
