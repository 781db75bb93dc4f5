"""Each new client gets the reply of its first call.

Regression: of 25 first requests one was lost, for it came before the word of its writer, or its
reply before the run knew the client's reader.
"""

from __future__ import annotations

import pytest
from conftest import Peer
from rcl_interfaces.srv import GetParameterTypes
from server import PATIENCE, Run

WAVES = 10  # of as many participants with as many clients each: 1 000 clients
AT_ONCE = 10  # calls; each client hears the replies of all, and keeps the last ten
NAME = "/ruedo/get_parameter_types"


def fresh_clients(peer: Peer, count: int) -> list:
    return [peer.node.create_client(GetParameterTypes, NAME) for _ in range(count)]


def ask(client) -> object:
    """The future reply of a client that has only just found the service."""
    assert client.wait_for_service(PATIENCE)
    return client.call_async(GetParameterTypes.Request(names=["rate"]))


def check(peer: Peer, future: object) -> None:
    assert list(peer.result(future, NAME).types) == [3]


@pytest.mark.parametrize("wave", range(WAVES))
def test_a_thousand_new_clients_get_their_first_reply(wave, shared_run):
    peers = [Peer(shared_run.domain, f"fresh{i}") for i in range(AT_ONCE)]
    clients = [fresh_clients(peer, WAVES) for peer in peers]
    for turn in zip(*clients, strict=True):
        futures = [ask(client) for client in turn]
        for peer, future in zip(peers, futures, strict=True):
            check(peer, future)
    for peer in peers:
        peer.close()


@pytest.fixture(scope="module")
def shared_run():
    with Run("--no-noise", "--disable", "p3at/camera") as run:
        yield run


@pytest.mark.parametrize("run_of", range(3))
def test_clients_that_are_there_before_the_run(run_of):
    """The first request comes long before Cyclone has taken the word of its writer."""
    with Run("--no-noise", "--disable", "p3at/camera") as run:
        peer = Peer(run.domain)
        futures = [ask(client) for client in fresh_clients(peer, AT_ONCE)]
        for future in futures:
            check(peer, future)
        peer.close()
