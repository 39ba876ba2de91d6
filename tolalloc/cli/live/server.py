"""The page's server: this machine alone, a token, and nothing read or written but what the desk allows."""

from __future__ import annotations

import json
import os
import re
import secrets
import sys
import time
from dataclasses import dataclass, field
from functools import cached_property
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BufferedReader
from pathlib import Path
from socket import SocketIO
from threading import BoundedSemaphore
from typing import Any
from urllib.parse import parse_qs

from tolalloc.cli.live.desk import Desk
from tolalloc.exceptions import InputError, TolallocError
from tolalloc.reports.page import asset

_KEPT = ".tolalloc-live"
_TOKEN = re.compile(r"[A-Za-z0-9_-]{32}")
LARGEST = 64 * 1024
"""Largest request [bytes]."""
MOST_AT_ONCE = 32
"""Requests that are answered at the same time [-]."""
MOST_CONNECTIONS = 64
"""Connections that are open at the same time; a browser keeps six for a tab [-]."""
PATIENCE = 10.0
"""Time that a connection may take to say a whole request, and to take its answer [s]."""
_KINDS = {"js": "text/javascript", "css": "text/css", "html": "text/html"}
_SHARED = ("page.css", "chart.js", "mechanism.css", "mechanism.js")
_POLICY = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'none'"


@dataclass(frozen=True, kw_only=True)
class Address:
    """Port and token of a page."""

    port: int = 0  # Port of this machine; 0 for a free one [-]
    token: str  # What a request must know

    @classmethod
    def of(cls, script: Path) -> Address:
        """Return where the page of a study was last time, or a new place."""
        new = cls(token=secrets.token_urlsafe(24))
        try:
            kept = json.loads((script.parent / _KEPT / f"{script.stem}.json").read_text(encoding="utf-8"))
            port, token = kept["port"], kept["token"]
        except (OSError, ValueError, TypeError, KeyError):
            return new
        known = type(port) is int and 0 < port < 2**16 and isinstance(token, str) and _TOKEN.fullmatch(token)
        return cls(port=port, token=token) if known else new

    def keep(self, script: Path) -> None:
        """Keep it beside the study, for its owner alone; where that cannot be written, the next page is a new one."""
        folder = script.parent / _KEPT
        try:
            folder.mkdir(mode=0o700, exist_ok=True)
            path = folder / f"{script.stem}.json"
            with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w", encoding="utf-8") as file:
                json.dump({"port": self.port, "token": self.token}, file)
        except OSError:
            return


@dataclass(frozen=True, kw_only=True)
class LiveServer:
    """The server of one desk."""

    desk: Desk
    port: int = 0  # A free one unless given
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))

    @cached_property
    def http(self) -> ThreadingHTTPServer:
        """The server of the standard library, at its port."""
        handler = type("Handler", (_Handler,), {"live": self, "free": BoundedSemaphore(MOST_AT_ONCE)})
        try:
            return _BoundedServer(("127.0.0.1", self.port), handler)
        except (OSError, OverflowError) as error:
            raise InputError.of_argument("live page", "port", self.port, f"a free port ({error})") from None

    @property
    def address(self) -> str:
        """Where the page is, with its token."""
        return f"http://{self.host}/?token={self.token}"

    @property
    def host(self) -> str:
        """Name and port of this machine, as a browser says them."""
        return f"127.0.0.1:{self.http.server_port}"

    @cached_property
    def pages(self) -> dict[str, bytes]:
        """Path → what stands there; nothing else is served."""
        page = Path(__file__).with_name("page")
        own = {path.name: path.read_text(encoding="utf-8") for path in page.iterdir() if path.suffix[1:] in _KINDS}
        shared = {name: asset(name) for name in _SHARED}
        found = {f"/{name}": text.encode() for name, text in (own | shared).items()}
        return {"/": found.pop("/live.html"), **found}


class _BoundedServer(ThreadingHTTPServer):
    """A server that closes a connection at once when too many are open."""

    daemon_threads = True
    request_queue_size = 128

    def __init__(self, *arguments: Any) -> None:
        self._free = BoundedSemaphore(MOST_CONNECTIONS)
        super().__init__(*arguments)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a connection in a thread of its own, if one is free."""
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer a connection, and give its place back."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a page that was closed while it was answered."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Sent(SocketIO):
    """What a connection sends."""

    until = 0.0  # When its request must be complete, however many bytes that are, by the clock of `time.monotonic` [s]

    def readinto(self, buffer: Any) -> int | None:
        """Read bytes for as long as the request may still take."""
        self._sock.settimeout(max(self.until - time.monotonic(), 1e-3))  # type: ignore[attr-defined]
        return super().readinto(buffer)


class _Handler(BaseHTTPRequestHandler):
    """One request."""

    live: LiveServer
    free: BoundedSemaphore
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # an answer of two writes would else wait 40 ms for the first to be confirmed
    server_version, sys_version = "tolalloc", ""

    def setup(self) -> None:
        """Read what the connection sends."""
        super().setup()
        self.sent = _Sent(self.connection, "rb")
        self.rfile = BufferedReader(self.sent)

    def handle_one_request(self) -> None:
        """Answer a request that is said in time."""
        self.sent.until = time.monotonic() + PATIENCE
        super().handle_one_request()

    def do_GET(self) -> None:
        """Answer with a page."""
        if not self._is_local():
            return
        path, _, query = self.path.partition("?")  # a page asks for a path, which has no host that could be malformed
        page = self.live.pages.get(path)
        if page is None:
            self._refuse(HTTPStatus.NOT_FOUND, "There is no such page.")
        elif path == "/" and not self._knows(parse_qs(query).get("token", [""])[0]):
            self._refuse(HTTPStatus.FORBIDDEN, "The token is missing: open the address that tolalloc open printed.")
        else:
            kind = _KINDS.get(path.rpartition(".")[2], "text/html")
            self._send(HTTPStatus.OK, page, f"{kind}; charset=utf-8")

    def do_POST(self) -> None:
        """Answer a request of the page."""
        if not self._is_local():
            return
        if not self._knows(self.headers.get("X-Token", "")):
            self._refuse(HTTPStatus.FORBIDDEN, "The token is missing or wrong: open the page again.")
        elif self.free.acquire(blocking=False):
            try:
                self._answer()
            finally:
                self.free.release()
        else:
            self._refuse(HTTPStatus.SERVICE_UNAVAILABLE, "Too many requests at once.")

    def _answer(self) -> None:
        size = self.headers.get("Content-Length", "")
        if not (size.isascii() and size.isdecimal() and len(size) < 10 and int(size) <= LARGEST):
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"A request says its length, up to {LARGEST} bytes.")
            return
        try:
            sent = json.loads(self.rfile.read(int(size)), parse_constant=_no_number)
        except (ValueError, RecursionError):
            self._refuse(HTTPStatus.BAD_REQUEST, "The request is no record in JSON.")
            return
        try:
            if not isinstance(sent, dict):
                raise InputError.at("page", "request", type(sent).__name__, "a record in JSON")
            found = self.live.desk.answer(self.path.removeprefix("/api/"), sent)
        except TolallocError as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
        except Exception:
            self._refuse(HTTPStatus.INTERNAL_SERVER_ERROR, "The program failed; the terminal says where.")
            raise
        else:
            self._send(
                HTTPStatus.OK, json.dumps(found, ensure_ascii=False, allow_nan=False).encode(), "application/json"
            )

    def _is_local(self) -> bool:
        """Refuse what another page or another name of this machine asks."""
        local = {self.live.host, self.live.host.replace("127.0.0.1", "localhost")}
        origin = self.headers.get("Origin")
        good = self.headers.get("Host") in local and (origin is None or origin.removeprefix("http://") in local)
        if not good:
            self._refuse(HTTPStatus.FORBIDDEN, "Only the page itself may ask.")
        return good

    def _knows(self, token: str) -> bool:
        return secrets.compare_digest(token.encode(), self.live.token.encode())

    def _refuse(self, status: HTTPStatus, sentence: str) -> None:
        self.close_connection = True
        self._send(status, json.dumps({"error": sentence}).encode(), "application/json")

    def _send(self, status: HTTPStatus, content: bytes, kind: str) -> None:
        self.connection.settimeout(PATIENCE)
        self.send_response(status)
        for name, value in (
            ("Content-Type", kind),
            ("Content-Length", str(len(content))),
            ("Cache-Control", "no-store"),
            ("Content-Security-Policy", _POLICY),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
        ):
            self.send_header(name, value)
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *arguments: Any) -> None:
        """Say nothing of every request."""


def _no_number(text: str) -> None:
    raise ValueError(text)
