"""The studio on this machine: one page, and the design with the files that it names, to this machine's browser alone."""

from __future__ import annotations

import json
import os
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files

from ..base.files import read_text
from ..design import load
from ..errors import DesignError, Refused

__all__ = ["Studio", "page"]

#: Where the server listens.
HOME = "127.0.0.1"


def page() -> bytes:
    """The page. Raises Refused where the package was built without it."""
    built = files(__package__).joinpath("studio.html")
    if not built.is_file():
        raise Refused(
            "this package was built from sources without the studio's page; `make studio` there (it needs Rust's target "
            "wasm32-unknown-unknown) makes it for the next `pip install .`, and wheels of `make wheels` have it. "
            "`trabecula report DESIGN -o part.html` makes a page with the part to turn"
        )
    return built.read_bytes()


def given(design: str) -> tuple[dict, list[str]]:
    """What the page has of a design, and the paths of the files that it names, in order. A design with an error is
    shown with it; then its files are not known. Raises OSError for a file that cannot be read.
    """
    text = read_text(design)
    try:
        named = [path for path in load(design).files() if os.path.isfile(path)]
    except DesignError:
        named = []
    folder = os.path.dirname(os.path.abspath(design))
    listed = [{"name": os.path.relpath(path, folder).replace(os.sep, "/"), "url": f"files/{i}"} for i, path in enumerate(named)]
    name = os.path.splitext(os.path.basename(design))[0]
    return {"name": name, "text": text, "files": listed}, named


class Studio(ThreadingHTTPServer):
    """A server of the page, and of one design if it is named, on a port of this machine (0: any that is free).

    Raises Refused without a page and for a port that is in use, OSError for a design that cannot be read.
    """

    daemon_threads = True

    def __init__(self, design: str | None = None, port: int = 0):
        self.page = page()
        self.design = design
        if design is not None:
            given(design)
        try:
            super().__init__((HOME, port), Handler)
        except OSError as error:
            raise Refused(f"port {port} cannot be had ({error.strerror}); name another with --port, or none") from None

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"http://{HOME}:{self.server_port}/" + ("?design" if self.design is not None else "")

    def handle_error(self, request: object, client_address: object) -> None:
        """A browser that went away is nothing to report."""

    def found(self, path: str) -> tuple[bytes, str] | None:
        """The bytes and the type of what is at a path; the design is read anew each time."""
        if path == "/":
            return self.page, "text/html; charset=utf-8"
        if self.design is None:
            return None
        described, named = given(self.design)
        if path == "/design.json":
            return json.dumps(described).encode(), "application/json"
        number = path.removeprefix("/files/")
        if number != path and number.isdecimal() and int(number) < len(named):
            with open(named[int(number)], "rb") as file:
                return file.read(), "application/octet-stream"
        return None


class Handler(BaseHTTPRequestHandler):
    """Answers GET."""

    server: Studio

    def do_GET(self) -> None:
        # A page of another site whose name leads here is not this machine's user.
        host = self.headers.get("Host", "").rsplit(":", 1)[0]
        if host not in (HOME, "localhost"):
            return self.send_error(HTTPStatus.FORBIDDEN)
        try:
            found = self.server.found(self.path.split("?", 1)[0])
        except (OSError, Refused):
            found = None
        if found is None:
            return self.send_error(HTTPStatus.NOT_FOUND)
        body, kind = found
        self.send_response(HTTPStatus.OK)
        for name, value in (("Content-Type", kind), ("Content-Length", str(len(body))), ("Cache-Control", "no-store")):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Says nothing of each request."""
