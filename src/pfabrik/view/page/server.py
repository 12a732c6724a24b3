"""The server of a page: its text, what it asks, and events that are pushed to it; to this computer alone.

Every address begins with a token that only the program tells. A page of another origin cannot guess it; one that knows
it is refused by its `Origin`, and one that a name was bound anew for by its `Host`, which has to be an address or the
name that was given.
"""

from __future__ import annotations

import errno
import ipaddress
import json
import os
import queue
import secrets
import socket
import socketserver
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from hmac import compare_digest
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import Any, NamedTuple, TypeAlias
from urllib.parse import urlsplit

from ...errors import InvalidArgument
from .page_json import as_json

MOST_BYTES = 4_000_000
"""Of a question."""

SIGN_OF_LIFE = 10.0
"""Time after which a connection over which nothing was pushed is tried [s]."""

MOST_PORTS = 1000
"""Ports that are tried after one that is taken."""

HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'; "
    "style-src 'unsafe-inline'; connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'",
}
"""Of every answer: nothing is kept, the address is told to nobody, and the page asks nothing of others."""

Queue: TypeAlias = "queue.SimpleQueue[str | None]"


Send: TypeAlias = Callable[[object], None]


class SentFile(NamedTuple):
    """What a page is sent: its type, its text, and the name that it is saved by; none for one that is shown."""

    kind: str
    text: str
    name: str = ""


class PageServer(socketserver.ThreadingTCPServer):
    """Serves from threads of its own, until it is closed.

    Attributes
    ----------
    version : of what is served: each page that comes, or comes back, is told.

    Parameters
    ----------
    host, port : where it listens; at the next free port where that one is taken.
    files : callable
        Called with the rest of an address, such as "" or "?limits=no"; returns what is there, or None.
    answers : callable
        Called with the name of a question, its data, and a function that sends one thing after the other, which the
        page reads as they come. Where the page asks no more, that function raises an OSError.
    """

    daemon_threads, block_on_close = True, False
    allow_reuse_address = os.name == "posix"  # elsewhere it lets two programs serve at one port

    def __init__(
        self,
        host: str,
        port: int,
        files: Callable[[str], SentFile | None],
        answers: Callable[[str, Any, Send], None],
    ) -> None:
        self.token, self.host, self.files, self.answers = secrets.token_urlsafe(16), host, files, answers
        self.version = 0
        self._pages: set[Queue] = set()
        self._lock = threading.Lock()
        self.address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self.port = self._bind(host, port)
        self._thread = threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    def _bind(self, host: str, first: int) -> int:
        """Listen at the first port that is free, and return it."""
        last = min(first + MOST_PORTS, 65536)
        for port in range(first, last):
            try:
                super().__init__((host, port), _Request)
            except OSError as error:
                if error.errno == errno.EADDRINUSE:
                    continue
                raise InvalidArgument(
                    "host", f"'{host}' at port {port}: {error.strerror}", "an address of this computer"
                ) from error
            return port
        raise InvalidArgument("port", f"{first} to {last - 1}, all taken", "a port that is free")

    @property
    def url(self) -> str:
        """The address of the page on this computer."""
        host = "localhost" if self.host in ("0.0.0.0", "::") else f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{self.port}/{self.token}/"

    def push(self, event: str, data: object) -> None:
        """Tell all pages."""
        with self._lock:
            for each in self._pages:
                each.put(f"event: {event}\ndata: {as_json(data)}\n\n")

    def events(self) -> Iterator[str]:
        """What is pushed to one page, and signs of life; until the server is closed."""
        mine: Queue = queue.SimpleQueue()
        with self._lock:
            self._pages.add(mine)
        try:
            yield f"event: version\ndata: {self.version}\n\n"
            while True:
                try:
                    event = mine.get(timeout=SIGN_OF_LIFE)
                except queue.Empty:
                    event = ": here\n\n"
                if event is None:
                    return
                yield event
        finally:
            with self._lock:
                self._pages.discard(mine)

    def end(self) -> None:
        """Close it: pages see that nobody answers any more."""
        with self._lock:
            for each in self._pages:
                each.put(None)
        self.shutdown()
        self.server_close()
        self._thread.join()

    def is_known(self, host: str) -> bool:
        """True for a `Host` that is an address, this computer's own name for itself, or the name that was given."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
            return name in ("localhost", self.host.lower()) or bool(ipaddress.ip_address(name))
        except ValueError:
            return False

    def handle_error(self, *_: object) -> None:
        """Say nothing of pages that went."""


class _Request(BaseHTTPRequestHandler):
    server: PageServer
    server_version = sys_version = ""

    def do_GET(self) -> None:
        place = self._place()
        if place == "events":
            self._begin("text/event-stream")
            with suppress(OSError):  # the page has gone
                for event in self.server.events():
                    self._write(event)
        elif place is not None:
            found = self.server.files(place)
            if found is None:
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            more = {"Content-Disposition": f'attachment; filename="{found.name}"'} if found.name else {}
            self._begin(found.kind, more)
            self._write(found.text)

    def do_POST(self) -> None:
        place = self._place()
        if place is None:
            return
        try:
            length = int(self.headers.get("Content-Length", "0"))
            if not 0 <= length <= MOST_BYTES:
                self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
                return
            asked = json.loads(self.rfile.read(length))
        except (ValueError, RecursionError):
            self.send_error(HTTPStatus.BAD_REQUEST)
            return
        self._begin("application/x-ndjson")
        with suppress(OSError):
            self.server.answers(place, asked, lambda data: self._write(f"{as_json(data)}\n"))

    def _place(self) -> str | None:
        """What is asked for, behind the token; None, after a refusal, for a stranger."""
        token, slash, place = self.path.lstrip("/").partition("/")
        host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
        is_from_here = self.server.is_known(host) and origin in (None, f"http://{host}")
        if is_from_here and slash and compare_digest(token.encode("latin-1"), self.server.token.encode()):
            return place
        self.send_error(HTTPStatus.FORBIDDEN)
        return None

    def _begin(self, kind: str, more: dict[str, str] | None = None) -> None:
        self.send_response(HTTPStatus.OK)
        for name, value in {"Content-Type": f"{kind}; charset=utf-8", **HEADERS, **(more or {})}.items():
            self.send_header(name, value)
        self.end_headers()

    def _write(self, text: str) -> None:
        self.wfile.write(text.encode())
        self.wfile.flush()

    def log_message(self, *_: Any) -> None:
        """Say nothing."""
