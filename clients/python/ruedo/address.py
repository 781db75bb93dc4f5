"""LCM URLs: which one is meant, and whether anything can come from it.

The route is checked before LCM sees the URL, because its own self-test blocks for ten seconds where
multicast has no route.
"""

from __future__ import annotations

import os
import socket
from urllib.parse import urlsplit

from . import stream_transport
from .errors import NoServer

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
FALLBACK_URL = "tcpq://127.0.0.1:7700"  # what `ruedo run` serves where there is no multicast route


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


def check_reachable(url: str) -> None:
    """Raises NoServer, with the cure, when nothing can come from that URL."""
    parts = urlsplit(url)
    try:
        host, _ = parts.hostname, parts.port
    except ValueError:
        raise NoServer(f"{url}: the port is not a number from 0 to 65535") from None
    if parts.scheme == "udpm":
        if not has_multicast_route(host or "239.255.76.67"):
            raise NoServer(
                f"{url}: this machine has no route for multicast. On Linux: "
                "sudo ip route add 224.0.0.0/4 dev lo; `ruedo doctor` tells more"
            )
    elif parts.scheme == "tcpq":
        try:
            stream_transport.connect(parts).close()
        except OSError as error:
            raise NoServer(
                f"no Ruedo server at {url} ({error.strerror or error}). Is `ruedo run` started with this "
                "--lcm? `ruedo doctor` looks for what is wrong"
            ) from None
    elif parts.scheme == "unix":
        try:
            stream_transport.connect(parts).close()
        except OSError as error:
            raise NoServer(
                f"no Ruedo server at {url} ({error.strerror or error}). Is `ruedo run` started with this --lcm, "
                "by the same user?"
            ) from None
    elif parts.scheme not in ("memq", "file"):
        raise NoServer(
            f"{url}: not an LCM URL; udpm://GROUP:PORT?ttl=0, tcpq://HOST:PORT or unix:///PATH is"
        )


def is_claimed(url: str) -> bool:
    """Whether a server on this machine has the address: its claim goes with its process."""
    parts = urlsplit(url)
    if parts.scheme == "unix":
        return stream_transport.is_served(parts)
    host, port = (
        (parts.hostname, parts.port)
        if parts.hostname
        else ("239.255.76.67", 7667)
        if parts.scheme == "udpm"
        else ("127.0.0.1", 7700)
    )
    try:
        with open("/proc/net/unix", encoding="ascii", errors="replace") as sockets:
            return any(
                line.rstrip("\n").endswith(f" @ruedo/{parts.scheme}/{host}:{port}")
                for line in sockets
            )
    except OSError:
        return False
