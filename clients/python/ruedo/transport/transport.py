"""Transports of messages: the interface, and the one for a URL."""

from __future__ import annotations

from typing import Protocol

from ..errors import NoServer
from .address import has_multicast_route, read_address
from .multicast import MulticastTransport
from .stream import Receiver, StreamTransport, is_served


class Transport(Protocol):
    """receive() is called by one thread at a time, the rest by any, also while receive() waits or
    its receiver runs.
    """

    loses_nothing: bool
    busy: bool  # receive() has taken something, and its receiver has not seen all of it

    @property
    def is_connected(self) -> bool:
        """False: nothing can be sent, since there is no server."""

    def subscribe(self, channel: str) -> None:
        """From the return on, every message of that channel is received."""

    def unsubscribe(self, channel: str) -> None: ...

    def publish(self, channel: str, data: bytes) -> None: ...

    def has_news(self) -> bool:
        """Whether something waits for receive()."""

    def receive(self, seconds: float, receiver: Receiver) -> bool:
        """Hands over what has come, or waits for it at most so long and returns False."""

    def close(self) -> None:
        """receive() returns soon, and nothing is sent any more."""


def open_transport(url: str) -> Transport:
    """Raises NoServer, with the cure, when nothing can come from that URL.

    The route is checked before LCM sees the URL, because its own self-test blocks for ten seconds
    where multicast has no route.
    """
    address = read_address(url)
    if address.scheme == "udpm":
        if not has_multicast_route(address.host):
            raise NoServer(
                f"{url}: this machine has no route for multicast. On Linux: "
                "sudo ip route add 224.0.0.0/4 dev lo; `ruedo doctor` explains"
            )
        return MulticastTransport(address)
    try:
        return StreamTransport(address)
    except (OSError, ValueError) as error:  # the latter for paths that no system has
        how = ", by the same user" if address.scheme == "unix" else ""
        why = getattr(error, "strerror", None) or error
        raise NoServer(
            f"no Ruedo server at {url} ({why}). Is `ruedo run` started with this "
            f"--lcm{how}? `ruedo doctor` looks for what is wrong"
        ) from None


def is_claimed(url: str) -> bool:
    """Whether a server on this machine has the address: its claim goes with its process."""
    address = read_address(url)
    if address.scheme == "unix":
        return is_served(address)
    claim = f" @ruedo/{address.scheme}/{address.host}:{address.port}"
    try:
        with open("/proc/net/unix", encoding="ascii", errors="replace") as sockets:
            return any(line.rstrip("\n").endswith(claim) for line in sockets)
    except OSError:
        return False
