# SPDX-License-Identifier: MIT
"""The server of the pages that show results, two results side by side, or a model before any run.

It listens on this machine only, answers reading requests only, and only those that bring the token of the address that
it prints, because other users of the machine reach its port, too.
"""

from __future__ import annotations

import html
import os
import secrets
import tempfile
import webbrowser
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Protocol
from urllib.parse import parse_qs, urlsplit

from ..errors import InputError, RockddaError
from ..frames import field_name
from ..plot.input_files import is_input
from ..results import Results
from .model_viewer import ModelViewer
from .pair import PairViewer
from .viewer import Viewer

__all__ = ["Answers", "serve", "view"]


class Answers(Protocol):
    """What a server asks: results or a model."""

    token: str

    def answer(self, path: str) -> tuple[str, bytes]: ...


def _handler(viewer: Answers, names: set[str]) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            # a page from elsewhere must not read results by giving this machine another name
            if (self.headers.get("Host") or "").lower() not in names:
                self._send(403, "text/plain", b"this server answers to 127.0.0.1 and localhost only")
                return
            token = parse_qs(urlsplit(self.path).query).get("token", [""])[0]
            if not secrets.compare_digest(token.encode(), viewer.token.encode()):
                self._send(
                    403, "text/plain", b"open the whole address that rockdda-post view has printed, with its token"
                )
                return
            try:
                kind, content = viewer.answer(self.path)
            except (KeyError, ValueError, IndexError):
                self._send(404, "text/plain", f"there is no {self.path}".encode())
            except RockddaError as error:
                self._send(503, "text/plain; charset=utf-8", str(error).encode())
            else:
                self._send(200, kind, content)

        def _send(self, status: int, kind: str, content: bytes) -> None:
            try:
                self.send_response(status)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(content)))
                self.send_header("Cache-Control", "no-store")
                self.send_header("X-Content-Type-Options", "nosniff")
                self.send_header("Referrer-Policy", "no-referrer")
                self.end_headers()
                self.wfile.write(content)
            except (BrokenPipeError, ConnectionResetError):  # the browser has requested another frame meanwhile
                self.close_connection = True

        def log_message(self, *_: object) -> None:
            pass

    return Handler


def serve(viewer: Answers, port: int = 0) -> ThreadingHTTPServer:
    """A server on 127.0.0.1 (port 0: any free one) that has not begun to answer yet."""
    try:
        server = ThreadingHTTPServer(("127.0.0.1", port), BaseHTTPRequestHandler)
    except OSError as error:
        raise InputError(f"port {port} cannot be used: {error.strerror}; --port 0 takes a free one") from error
    server.daemon_threads = True
    number = server.server_address[1]
    server.RequestHandlerClass = _handler(viewer, {f"127.0.0.1:{number}", f"localhost:{number}"})
    return server


def view(
    path: str | os.PathLike[str] | Results,
    port: int = 0,
    browser: bool = True,
    field: str = "displacement",
    units: str | None = None,
    ready: Callable[[str], None] | None = None,
    beside: Results | None = None,
) -> None:
    """Serve the page until interrupted (Ctrl-C); `ready` is called with its address, which holds the token.

    `path`: results, or a model before any run: a labelled file, its folder, a geometry or block file. `beside`: other
    results, which are shown beside them at the same moment.
    """
    viewer: Answers
    if not isinstance(path, Results) and (Path(path).is_dir() or is_input(path)):
        viewer = ModelViewer(Path(path))
    else:
        results = path if isinstance(path, Results) else Results(path)
        if beside is not None:
            viewer = PairViewer(results, beside, field_name(field), units)
        else:
            viewer = Viewer(results, field_name(field), units)
    server = serve(viewer, port)
    address = f"http://127.0.0.1:{server.server_address[1]}/?token={viewer.token}"
    with tempfile.TemporaryDirectory(prefix="rockdda-view-") as folder:
        try:
            if ready is not None:
                ready(address)
            if browser:
                webbrowser.open(_forwarding_page(Path(folder), address).as_uri())
            server.serve_forever(poll_interval=0.2)
        except KeyboardInterrupt:
            pass
        finally:
            server.server_close()


def _forwarding_page(folder: Path, address: str) -> Path:
    """A file that redirects to an address. All users can read the arguments of a browser, but not a private file."""
    path = folder / "open.html"
    path.touch(mode=0o600)
    place = html.escape(address, quote=True)
    text = (
        f'<!DOCTYPE html><meta http-equiv="refresh" content="0; url={place}"><a href="{place}">rockdda-post view</a>\n'
    )
    path.write_text(text, encoding="utf-8")
    return path
