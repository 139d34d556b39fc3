"""The port of a page, taken before any other work, and what to open in a browser."""

from __future__ import annotations

import ipaddress
import socket

from .errors import RequestError

HERE = "127.0.0.1"
"""This machine alone: nothing listens further unless it is asked to."""


def listen(host: str, port: int, anywhere: bool) -> socket.socket:
    """Take the port of a page before any other work.

    Raises:
        RequestError: an address or port that is impossible, not allowed, or taken.
    """
    try:
        ip = ipaddress.IPv4Address(HERE if host == "localhost" else host)
    except ValueError:
        raise RequestError(f"--host is '{host}'; write an IPv4 address such as {HERE}") from None
    if not ip.is_loopback and not anywhere:
        raise RequestError(f"--host {host} is beyond this machine; allow that with --anywhere")
    if not 0 <= port <= 65535:
        raise RequestError(f"--port is {port}; it is 1 to 65535, or 0 for a free one")
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((str(ip), port))
        listening.listen(64)
    except OSError as error:
        listening.close()
        raise RequestError(f"port {port} of {host}: {error.strerror}; choose another with --port") from None
    return listening


def address(listening: socket.socket, key: str = "") -> str:
    """What to open in a browser; the key, if any, is in the fragment, which no server and no other page receives."""
    host, port = listening.getsockname()
    if host == "0.0.0.0":
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as outward:
            try:
                outward.connect(("192.0.2.1", 9))  # sends nothing: only asks for the outward interface
                host = outward.getsockname()[0]
            except OSError:
                host = HERE
    return f"http://{host}:{port}/{f'#{key}' if key else ''}"
