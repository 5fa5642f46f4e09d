"""The token: without it nobody comes through, neither to the page nor to its websocket."""

import http.client
from collections.abc import Iterator

import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from depthsim.errors import InputError
from viewer.gate import Gate
from viewer.server import is_local

PROTOCOL = [Subprotocol(f"viser-v{viser.__version__}")]


@pytest.fixture(scope="module")
def gate() -> Iterator[Gate]:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    one = Gate("127.0.0.1", 0, server.get_port())
    yield one
    one.close()
    server.stop()


def ask(gate: Gate, path: str, cookie: str = "") -> tuple[int, dict[str, str], bytes]:
    line = http.client.HTTPConnection("127.0.0.1", gate.port, timeout=10)
    line.request("GET", path, headers={"Cookie": cookie} if cookie else {})
    answer = line.getresponse()
    body = answer.read()
    line.close()
    return answer.status, {key.lower(): value for key, value in answer.getheaders()}, body


def test_without_the_token_there_is_no_page(gate: Gate) -> None:
    for path in (
        "/",
        "/index.html",
        "/?token=wrong",
        f"/?token={gate.token[:-1]}",
        "/?token=",
        "/?Token=" + gate.token,
    ):
        status, headers, body = ask(gate, path)
        assert status == 403
        assert gate.token.encode() not in body
        assert "set-cookie" not in headers
    assert ask(gate, "/", "depthsim_1=" + gate.token)[0] == 403
    assert ask(gate, "/", f"depthsim_{gate.port}=wrong")[0] == 403


def test_the_token_gives_a_cookie_and_the_cookie_the_page(gate: Gate) -> None:
    status, headers, _ = ask(gate, f"/?fixedDpr=1&token={gate.token}")
    assert status == 303
    assert headers["location"] == "/?fixedDpr=1"
    cookie = headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Lax" in cookie
    status, _, body = ask(gate, "/", cookie.split(";")[0])
    assert status == 200
    assert b"<html" in body.lower()


def test_a_place_elsewhere_is_not_gone_to(gate: Gate) -> None:
    _, headers, _ = ask(gate, f"//evil.example/?token={gate.token}")
    assert headers["location"].startswith("/")
    assert not headers["location"].startswith("//")


def test_the_websocket_wants_the_cookie_too(gate: Gate) -> None:
    address = f"ws://127.0.0.1:{gate.port}/"
    with pytest.raises(InvalidStatus, match="403"):
        connect(address, subprotocols=PROTOCOL)
    cookie = {"Cookie": f"depthsim_{gate.port}={gate.token}"}
    with connect(address, subprotocols=PROTOCOL, additional_headers=cookie, max_size=None) as line:
        assert len(line.recv(timeout=10)) > 16


def test_what_is_no_request_ends_the_connection(gate: Gate) -> None:
    import socket

    for rubbish in (b"\x16\x03\x01\r\n\r\n", b"GET /\r\n\r\n", b"GET / HTTP/1.1\r\nX: " + b"y" * 70_000):
        with socket.create_connection(("127.0.0.1", gate.port), timeout=10) as line:
            line.sendall(rubbish)
            assert b" 200 " not in line.recv(4096)
    assert ask(gate, "/")[0] == 403  # and it goes on


def test_every_gate_has_a_token_of_its_own(gate: Gate) -> None:
    other = Gate("127.0.0.1", gate.port, 1)
    try:
        assert other.port != gate.port
        assert other.token != gate.token
        assert len(other.token) >= 32
        assert other.token in other.url
    finally:
        other.close()


def test_a_host_that_is_not_ours_is_told_in_one_line() -> None:
    with pytest.raises(InputError, match="--host"):
        Gate("192.0.2.1", 0, 1)
    with pytest.raises(InputError, match="--host"):
        Gate("no such host", 0, 1)


@pytest.mark.parametrize(
    ("host", "local"),
    [
        *((host, True) for host in ("127.0.0.1", "localhost", "::1", "127.9.9.9")),
        *((host, False) for host in ("0.0.0.0", "::", "192.168.1.2", "example.org", "localhost.evil")),
    ],
)
def test_what_is_local(host: str, local: bool) -> None:
    assert is_local(host) is local
