"""The gate before the page where others can reach this machine: nobody comes through without the token.

viser has no say in who may connect, so it listens on this machine alone, and this small proxy on the asked-for host.
The token comes in the URL once; from then on the browser carries it in a cookie, for pages and for the websocket.
"""

import asyncio
import secrets
import socket
import threading
from contextlib import suppress
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qsl, urlencode, urlsplit

from depthsim.errors import InputError

_LONGEST_HEAD = 32 * 1024
_PATIENCE = 15.0
"""[s] in which a request must have come."""
_BLOCK = 1 << 18
_TRIES = 100
"""Ports that are tried, from the one that was asked for."""


class Gate:
    """Listens on ``host`` and the first free port from ``port``, and passes on to ``inner``, a port of this machine.

    Raises :class:`~depthsim.errors.InputError` for a host that is not this machine's.
    """

    def __init__(self, host: str, port: int, inner: int) -> None:
        self._host, self._inner = host, inner
        self.token = secrets.token_urlsafe(24)
        sockets = _listen(host, port)
        self.port: int = sockets[0].getsockname()[1]
        self._cookie = f"depthsim_{self.port}"
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="gate", daemon=True)
        self._thread.start()
        self._servers = asyncio.run_coroutine_threadsafe(self._serve(sockets), self._loop).result()

    async def _serve(self, sockets: list[socket.socket]) -> list[asyncio.Server]:
        return [await asyncio.start_server(self._guarded, sock=one, limit=_LONGEST_HEAD) for one in sockets]

    @property
    def url(self) -> str:
        """What to open: with the token."""
        host = socket.gethostname() if self._host in ("0.0.0.0", "::") else self._host
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{self.port}/?token={self.token}"

    def close(self) -> None:
        """Listen no more, and end what is under way."""

        async def end() -> None:
            for server in self._servers:
                server.close()
            for task in asyncio.all_tasks():
                if task is not asyncio.current_task():
                    task.cancel()
            self._loop.call_soon(self._loop.stop)

        asyncio.run_coroutine_threadsafe(end(), self._loop)
        self._thread.join(timeout=2)

    async def _guarded(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError, asyncio.CancelledError, asyncio.IncompleteReadError, TimeoutError):
            try:
                head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), _PATIENCE)
                await self._answer(head, reader, writer)
            except asyncio.LimitOverrunError:
                _reply(writer, "431 Request Header Fields Too Large", "the request is too long")
        with suppress(OSError, RuntimeError):
            writer.close()

    async def _answer(self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        lines = head.decode("latin-1").split("\r\n")
        words = lines[0].split(" ")
        if len(words) != 3:
            _reply(writer, "400 Bad Request", "that is no request")
            return
        headers = [
            (key.strip().lower(), value.strip()) for key, _, value in (line.partition(":") for line in lines[1:])
        ]
        target = urlsplit(words[1])
        query = parse_qsl(target.query, keep_blank_values=True)
        if self._fits(self._carried(headers)):
            await self._pass_on(head, reader, writer)
        elif not self._fits(dict(query).get("token", "")):
            _reply(writer, "403 Forbidden", "This page wants the token: open the address that depthsim printed.")
        else:
            rest = urlencode([(key, value) for key, value in query if key != "token"])
            # One slash: `//host` would lead elsewhere.
            place = "/" + target.path.lstrip("/") + (f"?{rest}" if rest else "")
            cookie = f"{self._cookie}={self.token}; Path=/; HttpOnly; SameSite=Lax"
            _reply(writer, "303 See Other", "", [f"Location: {place}", f"Set-Cookie: {cookie}"])

    def _fits(self, given: str) -> bool:
        return secrets.compare_digest(given.encode(), self.token.encode())

    def _carried(self, headers: list[tuple[str, str]]) -> str:
        """The token in the cookies, "" without one."""
        for key, value in headers:
            if key == "cookie":
                with suppress(CookieError):
                    cookies = SimpleCookie(value)
                    if self._cookie in cookies:
                        return cookies[self._cookie].value
        return ""

    async def _pass_on(self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, back = await asyncio.open_connection("127.0.0.1", self._inner)
        back.write(head)
        ways = [asyncio.ensure_future(_pump(reader, back)), asyncio.ensure_future(_pump(there, writer))]
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            await asyncio.wait(ways[1:], timeout=1)  # the rest of an answer whose asker asks no more
        finally:
            for way in ways:
                way.cancel()
            back.close()


async def _pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with suppress(OSError):
        while block := await reader.read(_BLOCK):
            writer.write(block)
            await writer.drain()


def _reply(writer: asyncio.StreamWriter, status: str, text: str, headers: list[str] | None = None) -> None:
    body = text.encode()
    lines = [
        f"HTTP/1.1 {status}",
        "Content-Type: text/plain; charset=utf-8",
        f"Content-Length: {len(body)}",
        "Cache-Control: no-store",
        "Referrer-Policy: no-referrer",
        "Connection: close",
        *(headers or []),
    ]
    writer.write("\r\n".join([*lines, "", ""]).encode() + body)


def _listen(host: str, port: int) -> list[socket.socket]:
    """Sockets of all addresses of a host, on the first port from ``port`` that is free."""
    try:
        found = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except OSError as error:
        raise InputError("--host", host, f"is no host ({error})", "give an address of this machine") from None
    addresses = list(dict.fromkeys((family, place[0]) for family, _, _, _, place in found))
    for number in range(port, port + _TRIES):
        sockets: list[socket.socket] = []
        try:
            for family, address in addresses:
                sockets.append(socket.create_server((str(address), number), family=family))
            return sockets
        except OSError as error:
            for one in sockets:
                one.close()
            problem = (error.strerror or str(error)).lower()
    raise InputError("--host", f"{host}:{port}", f"cannot be listened on ({problem})", "give another host or port")
