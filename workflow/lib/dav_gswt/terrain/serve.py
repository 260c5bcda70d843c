"""Serve a page folder to browsers on this machine: `dav-gswt serve DIR`."""

import re
import sys
from contextlib import suppress
from functools import partial
from http import HTTPStatus
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from dav_gswt.errors import InputError

HOST = "127.0.0.1"  # only this machine is served
# Names of this machine, at any port, since a tunnel may use another one. A web page whose name was pointed at this
# machine (DNS rebinding) asks for its own name and is refused.
LOOPBACK = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])\.?(:\d{1,5})?", re.IGNORECASE)
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "worker-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-cache",
}


class _Handler(SimpleHTTPRequestHandler):
    """Serve the regular files of one folder: no listings and no symbolic links that lead out of it."""

    protocol_version = "HTTP/1.1"
    server_version, sys_version = "DAV-GSWT", ""
    timeout = 60.0  # seconds after which an idle connection is closed
    # A system's MIME table may map .js to text/plain, which browsers refuse to run as a module.
    extensions_map = {f".{end}": f"text/{kind}; charset=utf-8" for end, kind in
                      (("html", "html"), ("css", "css"), ("js", "javascript"))}  # fmt: skip

    def send_head(self):
        hosts = self.headers.get_all("Host", [])
        if len(hosts) != 1 or not LOOPBACK.fullmatch(hosts[0].strip()):
            self.send_error(HTTPStatus.MISDIRECTED_REQUEST, f"Ask for http://{HOST}:PORT/")
            return None
        root = Path(self.directory).resolve()
        try:
            asked = Path(self.translate_path(self.path)).resolve()
            asked = (root / "index.html").resolve() if asked == root else asked
            served = asked.is_relative_to(root) and asked.is_file()
        except (OSError, ValueError):  # the name is too long, or has a null byte or half of a surrogate pair
            served = False
        if not served:
            self.send_error(HTTPStatus.NOT_FOUND, "File not found")
            return None
        return super().send_head()

    def end_headers(self):
        for name, value in HEADERS.items():
            self.send_header(name, value)
        super().end_headers()

    def log_message(self, format, *arguments):
        """Log no requests: the terminal shows the address and errors only."""


class _Server(ThreadingHTTPServer):
    def handle_error(self, request, client_address):
        """Ignore connections that the browser closed, and report everything else."""
        if not isinstance(sys.exception(), ConnectionError | TimeoutError):
            super().handle_error(request, client_address)


def create_server(folder: Path | str, port: int) -> ThreadingHTTPServer:
    """Bind a server of a page folder to the loopback address; port 0 takes any free port.

    Raises: InputError: the folder has no page, or the port cannot be bound.
    """
    if not (Path(folder) / "index.html").is_file():
        raise InputError(f"{folder}: no page here (index.html is missing); `dav-gswt make PHOTOS` makes one")
    try:
        return _Server((HOST, port), partial(_Handler, directory=str(folder)))
    except (OSError, OverflowError) as error:
        raise InputError(f"--port {port}: {error}; choose another one with --port N (0: any free one)") from error


def serve(folder: Path, port: int) -> None:
    """Serve until Ctrl-C. Raises: InputError: see `create_server`."""
    with create_server(folder, port) as http:
        print(f"Open http://{HOST}:{http.server_address[1]}/ in a browser. Ctrl-C stops.", flush=True)
        with suppress(KeyboardInterrupt):
            http.serve_forever()
