"""LCM URLs: the one in effect, and its parts."""

from __future__ import annotations

import os
import socket
from dataclasses import dataclass

from ..errors import NoServer

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
FALLBACK_URL = "tcpq://127.0.0.1:7700"  # of `ruedo run` without a multicast route

_DEFAULTS = {"udpm": ("239.255.76.67", 7667), "tcpq": ("127.0.0.1", 7700)}  # LCM's own


@dataclass(frozen=True)
class Address:
    scheme: str  # udpm, tcpq or unix
    host: str = ""  # an IPv4 address; of udpm the multicast group
    port: int = 0
    path: str = ""  # of a unix socket
    ttl: int = 0  # of udpm: networks that datagrams cross
    receive_buffer: int = 0  # of udpm, in bytes; 0: not named

    def __str__(self) -> str:
        if self.scheme == "unix":
            return f"unix://{self.path}"
        return f"{self.scheme}://{self.host}:{self.port}" + (
            f"?ttl={self.ttl}" if self.scheme == "udpm" else ""
        )


def read_address(url: str) -> Address:
    """The address, read as the server reads it. Raises NoServer if the text is not an address."""
    try:
        return _address(url)
    except ValueError as error:
        raise NoServer(
            f"url '{url}': {error}; an address looks like {DEFAULT_URL}, {FALLBACK_URL} or "
            "unix:///tmp/ruedo.sock"
        ) from None


def _address(url: str) -> Address:
    scheme, found, rest = url.partition("://")
    if not found:
        raise ValueError("it has no scheme")
    if scheme == "unix":
        if not rest.startswith("/"):
            raise ValueError(f"'{rest}' is not an absolute path")
        return Address(scheme, path=rest)
    if scheme not in _DEFAULTS:
        raise ValueError("the schemes udpm, tcpq and unix are supported")
    place, _, options = rest.partition("?")
    if options and scheme != "udpm":
        raise ValueError(f"{scheme} has no options")
    if place.startswith("["):
        raise ValueError(
            f"LCM has no IPv6: '{place}' is not allowed; give a name or an IPv4 address"
        )
    host, colon, digits = place.partition(":")
    default_host, default_port = _DEFAULTS[scheme]
    port = _number(digits, 1, 65535) if colon else default_port
    if port is None:
        raise ValueError(f"'{digits}' is not a port")
    if scheme == "tcpq":
        return Address(scheme, _resolved(host or default_host), port)
    group = host or default_host
    if not _is_group(group):
        raise ValueError(f"'{group}' is not a multicast group (224.0.0.0 to 239.255.255.255)")
    ttl, receive_buffer = _options(options)
    return Address(scheme, group, port, ttl=ttl, receive_buffer=receive_buffer)


def _number(digits: str, least: int, most: int) -> int | None:
    if not (digits.isascii() and digits.isdecimal() and len(digits) <= 10):
        return None
    value = int(digits)
    return value if least <= value <= most else None


def _resolved(host: str) -> str:
    try:
        return socket.gethostbyname(host)
    except (OSError, UnicodeError):
        raise ValueError(f"'{host}' is not a host that this machine knows") from None


def _is_group(text: str) -> bool:
    try:
        return 224 <= socket.inet_pton(socket.AF_INET, text)[0] < 240
    except (OSError, ValueError):
        return False


def _options(text: str) -> tuple[int, int]:
    """ttl and receive_buffer of an Address."""
    bounds = {"ttl": (0, 255), "recv_buf_size": (1, 2**31 - 1)}
    found: dict[str, int] = {}
    for pair in text.removesuffix("&").split("&") if text else []:
        key, _, digits = pair.partition("=")
        value = _number(digits, *bounds[key]) if key in bounds else None
        if value is None or key in found:
            raise ValueError(
                f"the option '{pair}' is not allowed: ttl, 0 to 255, and recv_buf_size, "
                "1 to 2147483647 bytes, are, each once"
            )
        found[key] = value
    return found.get("ttl", 0), found.get("recv_buf_size", 0)


def resolve_url(url: str | None) -> str:
    """url, or LCM_DEFAULT_URL, or LCM's default group and port with ttl 0, or TCP where multicast
    has no route.
    """
    return (
        url
        or os.environ.get("LCM_DEFAULT_URL")
        or (DEFAULT_URL if has_multicast_route() else FALLBACK_URL)
    )


def has_multicast_route(group: str = "239.255.76.67") -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((group, 7667))
        except OSError:
            return False
    return True
