"""Serve the examples on this machine: /webgl2/, /three_spark/; the page folder as /page/, exports as /exports/.

.venv/bin/python examples/serve.py [PAGE] [--exports FOLDER] [--port 8001]
"""

import argparse
from contextlib import suppress
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

EXAMPLES = Path(__file__).parent
NAMES = ("webgl2", "three_spark")


class Handler(SimpleHTTPRequestHandler):
    """The examples' folder, with two other folders in it."""

    protocol_version = "HTTP/1.1"
    extensions_map = SimpleHTTPRequestHandler.extensions_map | {".js": "text/javascript"}

    def __init__(self, *arguments, folders: dict[str, Path], **keywords):
        self.folders = folders
        super().__init__(*arguments, directory=str(EXAMPLES), **keywords)

    def translate_path(self, path: str) -> str:
        own = self.directory
        head, _, rest = path.lstrip("/").partition("/")
        if head in self.folders:
            self.directory, path = str(self.folders[head]), f"/{rest}"
        try:
            return super().translate_path(path)
        finally:
            self.directory = own

    def log_message(self, format, *arguments):
        """The terminal shows the addresses only."""


def create_server(page: Path, exports: Path, port: int) -> ThreadingHTTPServer:
    """A server on the loopback address; port 0: any free one."""
    return ThreadingHTTPServer(("127.0.0.1", port), partial(Handler, folders={"page": page, "exports": exports}))


def find_page(results: Path) -> Path:
    """The newest page folder. Raises: SystemExit: there is none."""
    pages = sorted(results.rglob("terrain/page/davgswt.json"), key=lambda path: path.stat().st_mtime)
    if not pages:
        raise SystemExit(f"there is no terrain in {results} yet: `make run` makes one")
    return pages[-1].parent


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("page", nargs="?", type=Path, help="a page folder (default: the newest of results/)")
    parser.add_argument("--exports", type=Path, default=EXAMPLES / "exports", help="what `dav-gswt export` wrote")
    parser.add_argument("--port", type=int, default=8001)
    options = parser.parse_args()
    page = options.page or find_page(EXAMPLES.parent / "results")
    with create_server(page, options.exports, options.port) as server:
        for name in NAMES:
            print(f"http://127.0.0.1:{server.server_address[1]}/{name}/", flush=True)
        with suppress(KeyboardInterrupt):
            server.serve_forever()


if __name__ == "__main__":
    main()
