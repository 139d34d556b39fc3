"""Who may have command by wire."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass

from .wire import WireError


@dataclass(frozen=True)
class Authority:
    """Addresses that may have command: hosts, or one port of a host; without any, whoever comes."""

    allowed: tuple[str, ...] = ()

    @staticmethod
    def of(texts: Sequence[str]) -> Authority:
        """From addresses such as ``192.168.1.5`` or ``127.0.0.1:4711``.

        Raises:
            WireError: one that is none.
        """
        return Authority(tuple(_address(text) for text in texts))

    def may(self, sender: str) -> bool:
        """Whether a sender, as messages name it ("udp 127.0.0.1:4711"), may have command."""
        address = sender.partition(" ")[2]
        return not self.allowed or address in self.allowed or address.rpartition(":")[0] in self.allowed


ANYBODY = Authority()


def _address(text: str) -> str:
    host, colon, port = text.partition(":")
    try:
        ip = ipaddress.IPv4Address("127.0.0.1" if host == "localhost" else host)
    except ValueError:
        ip = None
    if ip is None or (colon and not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535)):
        raise WireError(f"commander '{text}': write an IPv4 address such as 192.168.1.5, or 192.168.1.5:4711")
    return f"{ip}:{int(port)}" if colon else str(ip)
