"""Serve a page folder to browsers on this machine: `python -m dav_gswt.terrain.serve DIR [--port N]`."""

import argparse
import errno
import re
import sys
from functools import partial
from http import HTTPStatus
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from dav_gswt.errors import InputError

HOST = "127.0.0.1"  # only this machine is served
CONTENT = ("davgswt.json", "trials.js")  # a terrain, or the trials of the forced-choice study
IDLE = 60.0  # seconds after which a connection that neither asks nor reads is closed
# names of this machine, at any port: a tunnel may have another. A page elsewhere whose name was pointed at this machine
# (DNS rebinding) asks for its own name
LOOPBACK = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])\.?(:\d{1,5})?", re.IGNORECASE)
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; worker-src 'self'; "
        "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-cache",
}


class _Handler(SimpleHTTPRequestHandler):
    """Serve regular files of one folder to requests for this machine: no listings, no symbolic links out of it, no
    caching."""

    protocol_version = "HTTP/1.1"
    server_version, sys_version = "DAV-GSWT", ""
    timeout = IDLE
    # fixed here: a system's MIME table may map .js to text/plain, which browsers refuse to run as a module
    extensions_map = {
        "": "application/octet-stream",
        ".html": "text/html; charset=utf-8",
        ".css": "text/css; charset=utf-8",
        ".js": "text/javascript; charset=utf-8",
        ".json": "application/json",
        ".bin": "application/octet-stream",
        ".png": "image/png",
        ".jpg": "image/jpeg",
    }

    def send_head(self):
        hosts = self.headers.get_all("Host", [])
        if len(hosts) != 1 or not LOOPBACK.fullmatch(hosts[0].strip()):
            self.send_error(HTTPStatus.MISDIRECTED_REQUEST, f"Ask for http://{HOST}:PORT/")
            return None
        if not self._is_served():
            self.send_error(HTTPStatus.NOT_FOUND, "File not found")
            return None
        return super().send_head()

    def _is_served(self) -> bool:
        """Whether the request is for the page itself, or a regular file in its folder."""
        root = Path(self.directory).resolve()
        try:
            asked = Path(self.translate_path(self.path)).resolve()
            if asked == root:
                asked = (root / "index.html").resolve()
            return asked.is_relative_to(root) and asked.is_file()
        except (OSError, ValueError):  # too long a name, a null byte, half of a surrogate pair
            return False

    def end_headers(self):
        for name, value in HEADERS.items():
            self.send_header(name, value)
        super().end_headers()

    def log_message(self, format, *arguments):
        """Log no requests: the terminal shows the address and errors only."""


class _Server(ThreadingHTTPServer):
    def handle_error(self, request, client_address):
        """Ignore connections that the browser closed or forgot; report everything else."""
        if not isinstance(sys.exception(), ConnectionError | TimeoutError):
            super().handle_error(request, client_address)


def create_server(folder: Path | str, port: int) -> ThreadingHTTPServer:
    """A server of a page folder, bound to the loopback address; port 0 takes any free port.

    Raises: InputError: the folder holds no page, or the port cannot be bound.
    """
    folder = Path(folder)
    for names in (("index.html",), CONTENT):
        if not any((folder / name).is_file() for name in names):
            raise InputError(f"{folder}: no page here ({names[0]} is missing); `make run` makes one")
    if not 0 <= port <= 65535:
        raise InputError(f"--port {port}: ports go from 1 to 65535 (0: any free one)")
    try:
        return _Server((HOST, port), partial(_Handler, directory=str(folder)))
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            why = "is taken; stop what uses it, or choose another"
        else:
            why = f"cannot be used ({error.strerror}); choose another"
        raise InputError(f"port {port} {why} with --port N (`make view PORT=N`; 0: any free one)") from error


def main(arguments: list[str] | None = None) -> int:
    """Serve until Ctrl-C. Returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m dav_gswt.terrain.serve", description=__doc__)
    parser.add_argument("dir", type=Path, help="a page folder, as make_page writes it")
    parser.add_argument("--port", type=int, default=8000)
    options = parser.parse_args(arguments)
    try:
        with create_server(options.dir, options.port) as http:
            print(f"Open http://{HOST}:{http.server_address[1]}/ in a browser. Ctrl-C stops.", flush=True)
            http.serve_forever()
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
