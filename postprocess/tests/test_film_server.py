# SPDX-License-Identifier: MIT
"""The viewer's server: damaged and slow requests, texts of files in its pages, faults."""

import html
import json
import random
import re
import socket
import threading
import time

import pytest
import rockdda
from rockdda.film import server as server_module
from rockdda.film.page import page
from rockdda.film.server import serve
from rockdda.film.viewer import Viewer
from synthetic import write_wall


@pytest.fixture
def served(tmp_path):
    viewer = Viewer(rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2, frames=2)))
    server = serve(viewer)
    server.viewer = viewer
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    yield server
    server.shutdown()
    server.server_close()


def connect(server):
    return socket.create_connection(server.server_address[:2], timeout=20)


def exchange(server, request):
    """Everything that the server answers to some bytes until it ends the connection."""
    with connect(server) as connection:
        connection.sendall(request)
        connection.shutdown(socket.SHUT_WR)
        found = b""
        while part := connection.recv(65536):
            found += part
        return found


def status_of(server, request):
    answer = exchange(server, request)
    assert re.match(rb"HTTP/1\.[01] \d{3} ", answer), (request, answer)
    return int(answer[9:12])


HOST = b"Host: 127.0.0.1:%d\r\n\r\n"
#: Requests that raised outside the handler, got no answer, or one without a status or with 5xx.
MALFORMED = [
    b"GET http://[x]/ HTTP/1.1\r\n", b"GET //[/ HTTP/1.1\r\n", b"GET /?token=%ff[ HTTP/1.1\r\n", b"GET /\r\n",
    b"GET\r\n", b"\x00\x01\x02\r\n", b"GET / HTTP/9.9\r\n", b"GET / HTTP/x\r\n", b"GET / HTTP/2.0\r\n",
    b"POST / HTTP/1.1\r\nContent-Length: 3\r\n", b"BREW / HTTP/1.1\r\n", b"get / HTTP/1.1\r\n",
    b"GET / " + b"x" * 70000 + b"\r\n", b"GET / HTTP/1.1\r\nX: " + b"y" * 70000 + b"\r\n",
    b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 200, b"GET / HTTP/1.1\r\nno colon\r\n",
    b"GET http://[x]/?token=\xff HTTP/1.0\r\n",
    b"GET /\x85\xa0 HTTP/1.1\r\n", b"GET  HTTP/1.1\r\n", b"GET / HTTP/-1.1\r\n", b"GET / HTTP/1.1.1\r\n",
]  # fmt: skip


@pytest.mark.parametrize("request_", MALFORMED, ids=range(len(MALFORMED)))
def test_malformed_requests_get_4xx(served, capsys, request_):
    assert 400 <= status_of(served, request_ + HOST % served.server_address[1]) < 500
    assert capsys.readouterr().err == ""


def test_damaged_requests_get_4xx(served, capsys):
    """500 requests with some bytes changed, with the token and without."""
    random_ = random.Random(7)
    whole = f"GET /field/stress_x/1?token={served.viewer.token} HTTP/1.1\r\n".encode() + HOST % served.server_address[1]
    for _ in range(500):
        damaged = bytearray(whole)
        for _ in range(random_.randint(1, 4)):
            damaged[random_.randrange(len(damaged))] = random_.choice(b"\0\r\n []%:/?#&=\xff\x80x0")
        answer = exchange(served, bytes(damaged))
        if answer:  # none for a request without its end, of which nothing is left
            assert answer.startswith(b"HTTP/1.") and answer[9:10] in b"24", (bytes(damaged), answer[:200])
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("path", ["displacement/" + "9" * 30, "block/" + "9" * 5000, "field/stress_x/1e9", "%ff%fe",
                                  "block/\u0663", "field/stress_x/", "limits/[x]"])  # fmt: skip
def test_odd_paths_get_4xx(served, path):
    line = f"GET /{path}?token={served.viewer.token} HTTP/1.1\r\n".encode()
    assert 400 <= status_of(served, line + HOST % served.server_address[1]) < 500


def test_slow_connections_are_bounded_and_do_not_shut_others_out(served):
    """300 connections that send half a request were 298 threads."""
    before = threading.active_count()
    slow = []
    try:
        for _ in range(300):
            slow.append(connect(served))
            slow[-1].sendall(b"GET / HTTP/1.1\r\nX: ")
        good = f"GET /state?token={served.viewer.token} HTTP/1.1\r\nConnection: close\r\n".encode()
        assert status_of(served, good + HOST % served.server_address[1]) == 200
        deadline = time.monotonic() + 10
        while threading.active_count() - before > server_module.MOST_CONNECTIONS and time.monotonic() < deadline:
            time.sleep(0.01)
        assert threading.active_count() - before <= server_module.MOST_CONNECTIONS
    finally:
        for connection in slow:
            connection.close()


def test_a_request_that_does_not_come_ends_the_connection(served, monkeypatch):
    """Also one that comes byte by byte, of which each is soon enough."""
    monkeypatch.setattr(server_module, "MOST_SECONDS", 0.3)
    with connect(served) as connection:
        begin = time.monotonic()
        with pytest.raises(OSError):
            while time.monotonic() - begin < 15:
                connection.sendall(b"G")
                connection.settimeout(0.05)
                try:
                    assert connection.recv(100) == b""
                    raise ConnectionResetError
                except TimeoutError:
                    continue
        assert 0.2 < time.monotonic() - begin < 10


def test_answers_to_all_connections_refuse_a_further_one(served, monkeypatch):
    monkeypatch.setattr(server_module, "MOST_CONNECTIONS", 1)
    begun, go = threading.Event(), threading.Event()

    def answer(path):
        begun.set()
        go.wait(20)
        return "text/plain", b"late"

    monkeypatch.setattr(served.viewer, "answer", answer)
    good = f"GET /state?token={served.viewer.token} HTTP/1.1\r\nConnection: close\r\n".encode()
    good += HOST % served.server_address[1]
    found = []
    thread = threading.Thread(target=lambda: found.append(exchange(served, good)))
    thread.start()
    assert begun.wait(20)
    with connect(served) as further:
        assert further.recv(1000).startswith(b"HTTP/1.1 503 ")
    go.set()
    thread.join(20)
    assert found[0].endswith(b"late")


@pytest.mark.parametrize(("error", "status"), [(ImportError("no compiled part"), 503), (ZeroDivisionError("x"), 500),
                                               (rockdda.InputError("no frames yet"), 503)])  # fmt: skip
def test_a_fault_is_one_clear_line(served, monkeypatch, capsys, error, status):
    def answer(path):
        raise error

    monkeypatch.setattr(served.viewer, "answer", answer)
    good = f"GET /?token={served.viewer.token} HTTP/1.1\r\nConnection: close\r\n".encode()
    answer_ = exchange(served, good + HOST % served.server_address[1])
    assert answer_.startswith(f"HTTP/1.1 {status} ".encode())
    text = answer_.partition(b"\r\n\r\n")[2].decode()
    assert str(error) in text
    assert text.count("\n") == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("title", ["{{setup}}", "{{script}} {{css}}", "{{title}}", "a {{nothing}} b", "\\1 \\g<0>"])
def test_braces_in_a_title_are_text(title):
    """{{setup}} put the data of the page into its title."""
    text = page(title, {"secret": 4711})
    assert text.count("4711") == 1
    assert text.count(f"<title>{html.escape(title)}</title>") == 1
    found = re.search(r'<script id="setup" type="application/json">(.*?)</script>', text, re.S)
    assert json.loads(found[1]) == {"secret": 4711}
