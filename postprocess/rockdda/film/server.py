# SPDX-License-Identifier: MIT
"""The server of the pages that show results, two results side by side, or a model before any run.

It listens on this machine only, answers reading requests only, and only those that bring the token of the address that
it prints, because other users of the machine reach its port, too.
"""

from __future__ import annotations

import contextlib
import html
import math
import secrets
import socket
import sys
import tempfile
import threading
import time
import webbrowser
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import parse_qs, urlsplit

from ..errors import InputError, RockddaError
from ..frames import field_name
from ..plot.input_files import is_input
from ..results import Results
from ..text import PathLike
from .model_data import ModelViewer
from .viewer import PairViewer, Viewer

MOST_CONNECTIONS = 32  # at a time; a browser makes six
MOST_SECONDS = 20.0  # for a request
MOST_SECONDS_OF_ANSWER = 600.0  # a large page through a slow tunnel


class Answers(Protocol):
    """What a server requests: results or a model."""

    token: str

    def answer(self, path: str) -> tuple[str, bytes]: ...


def _handler(viewer: Answers, names: set[str]) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        timeout = MOST_SECONDS  # of each reading; `_Server.service_actions` limits the whole
        server: _Server

        def parse_request(self) -> bool:
            if not super().parse_request():
                return False
            if self.request_version == "HTTP/0.9":
                self.send_error(400)
                return False
            return True

        def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
            self.request_version = self.protocol_version  # answers to HTTP/0.9 have no status
            super().send_error({501: 405, 505: 400}.get(code, code), message, explain)  # the request is at fault

        def do_GET(self) -> None:
            self.server.set_answering(self.connection, True)
            self.connection.settimeout(MOST_SECONDS_OF_ANSWER)
            try:
                self._answer()
            finally:
                self.connection.settimeout(self.timeout)
                self.server.set_answering(self.connection, False)

        def _answer(self) -> None:
            # a page from elsewhere must not read results by giving this machine another name
            if (self.headers.get("Host") or "").lower() not in names:
                self._send(403, "text/plain", b"this server answers to 127.0.0.1 and localhost only")
                return
            try:
                token = parse_qs(urlsplit(self.path).query).get("token", [""])[0]
            except ValueError:
                self._send(400, "text/plain", b"this is no address of a page")
                return
            if not secrets.compare_digest(token.encode(), viewer.token.encode()):
                self._send(
                    403, "text/plain", b"open the whole address that rockdda-post view has printed, with its token"
                )
                return
            try:
                kind, content = viewer.answer(self.path)
            except (RockddaError, ImportError) as error:  # an InputError is a ValueError, too
                self._send(503, "text/plain; charset=utf-8", str(error).encode())
            except (LookupError, ValueError, OverflowError):
                self._send(404, "text/plain", f"there is no {self.path}".encode())
            except Exception as error:
                text = f"internal error: {type(error).__name__}: {error}"
                self._send(500, "text/plain; charset=utf-8", text.encode())
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


class _Server(ThreadingHTTPServer):
    """A server with a bounded number of connections, and so of threads: a new one ends the one that waits longest."""

    daemon_threads = False  # one that reads results while the interpreter ends would end it with a crash
    request_queue_size = 128  # the system lets further connections wait for seconds

    def __init__(self, port: int) -> None:
        self._lock = threading.Lock()
        self._since: dict[socket.socket, float] = {}  # connections: since when a request is waited for; inf: answering
        super().__init__(("127.0.0.1", port), BaseHTTPRequestHandler)

    def process_request(self, request: Any, client_address: Any) -> None:
        with self._lock:
            if len(self._since) >= MOST_CONNECTIONS:
                oldest = min(self._since, key=lambda connection: self._since[connection])
                if math.isinf(self._since[oldest]):
                    with contextlib.suppress(OSError):
                        request.settimeout(1)
                        request.sendall(b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\n\r\n")
                    self.shutdown_request(request)
                    return
                self._end(oldest)
            self._since[request] = time.monotonic()
        super().process_request(request, client_address)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            with self._lock:
                self._since.pop(request, None)

    def set_answering(self, connection: socket.socket, answering: bool) -> None:
        """Note that a connection gets its answer, or waits for the next request."""
        with self._lock:
            if connection in self._since:
                self._since[connection] = math.inf if answering else time.monotonic()

    def service_actions(self) -> None:
        """End connections whose request does not come."""
        with self._lock:
            for connection, since in list(self._since.items()):
                if time.monotonic() - since > MOST_SECONDS:
                    self._end(connection)

    def server_close(self) -> None:
        """End all connections, and wait for the answers that are being made."""
        with self._lock:
            for connection in list(self._since):
                self._end(connection)
        super().server_close()

    def _end(self, connection: socket.socket) -> None:
        with contextlib.suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)  # its thread ends
        del self._since[connection]

    def handle_error(self, request: Any, client_address: Any) -> None:
        error = sys.exc_info()[1]
        if not isinstance(error, OSError):  # a connection has ended
            print(f"rockdda-post view: internal error: {type(error).__name__}: {error}", file=sys.stderr)


def serve(viewer: Answers, port: int = 0) -> ThreadingHTTPServer:
    """A server on 127.0.0.1 (port 0: any free one) that has not begun to answer yet."""
    try:
        server = _Server(port)
    except OSError as error:
        raise InputError(f"port {port} cannot be used: {error.strerror}; --port 0 takes a free one") from error
    number = server.server_address[1]
    server.RequestHandlerClass = _handler(viewer, {f"127.0.0.1:{number}", f"localhost:{number}"})
    return server


def view(
    path: PathLike | Results, port: int = 0, browser: bool = True, field: str = "displacement",
    units: str | None = None, ready: Callable[[str], None] | None = None, beside: Results | None = None,
) -> None:  # fmt: skip
    """Serve the page until interrupted (Ctrl-C); `ready` is called with its address, which holds the token.

    `path`: results, or a model before any run: a labelled file, its folder, a geometry or block file. `beside`: other
    results, which are shown beside them at the same moment."""
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
