"""The parameters of /ruedo, and their events, by each of a node's parameter services."""

from __future__ import annotations

import pytest
from rcl_interfaces.msg import ParameterEvent, ParameterType
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

VALUES = {
    "fault": "",
    "paused": False,
    "rate": 1.0,
    "seed": 1,
    "step_size": 0.005,
    "use_sim_time": False,
    "world": "arena",
}
TYPES = ["STRING", "BOOL", "DOUBLE", "INTEGER", "DOUBLE", "BOOL", "STRING"]


class Parameters:
    """rclpy's client, and what it gets."""

    def __init__(self, peer):
        self.peer = peer
        self.client = AsyncParameterClient(peer.node, "ruedo")
        self.events = peer.hear(ParameterEvent, "/parameter_events")
        assert self.client.wait_for_services(30)

    def values(self, *names):
        found = self.peer.result(self.client.get_parameters(list(names)), "get_parameters")
        return [parameter_value_to_python(value) for value in found.values]

    def reasons(self, **wanted):
        given = [Parameter(name, value=value) for name, value in wanted.items()]
        done = self.peer.result(self.client.set_parameters(given), "set_parameters")
        return [one.reason for one in done.results]

    def changed(self):
        return [p.name for e in self.events if e.node == "/ruedo" for p in e.changed_parameters]


@pytest.fixture
def parameters(peer):
    return Parameters(peer)


def test_they_are_listed_and_described(peer, parameters):
    names = list(peer.call(ListParameters, "/ruedo/list_parameters").result.names)
    assert dict(zip(names, parameters.values(*names), strict=True)) == VALUES
    types = peer.call(GetParameterTypes, "/ruedo/get_parameter_types", names=names).types
    assert list(types) == [getattr(ParameterType, f"PARAMETER_{kind}") for kind in TYPES]
    described = peer.call(DescribeParameters, "/ruedo/describe_parameters", names=names)
    read_only = [one.name for one in described.descriptors if one.read_only]
    assert read_only == ["seed", "step_size", "use_sim_time", "world"]


def test_a_set_parameter_is_published(peer, parameters):
    assert parameters.reasons(rate=2.0, paused=True, fault="p3at/lrf:dropout,for=5") == [""] * 3
    assert parameters.values("rate", "paused", "fault") == [2.0, True, "p3at/lrf:dropout,for=5"]
    peer.spin_until(lambda: len(parameters.changed()) >= 3, "events")
    assert parameters.changed() == ["rate", "paused", "fault"]


def test_a_read_only_parameter_is_refused(peer, parameters):
    refused = parameters.reasons(seed=3, rate="fast", nobody=1, paused=2)
    for reason, words in zip(
        refused,
        (
            "'seed' is read-only",
            "'rate' is a double",
            "no parameter 'nobody'",
            "'paused' is a bool",
        ),
        strict=True,
    ):
        assert words in reason
    assert "0.0001" in parameters.reasons(rate=-1.0)[0]
    for fault, words in (
        ("lrf:nonsense", "dropout"),
        ("p3at/lrf:freeze@3", "fault 'p3at/lrf:freeze@3': '@3' is not allowed: the fault begins"),
        ("lrf", "fault 'lrf': it looks like ROBOT/DEVICE:KIND[,for=S]"),
        ("p3at/lrf:lag", "fault 'p3at/lrf:lag': value 0 of lag is not allowed"),
    ):
        reason = parameters.reasons(fault=fault)[0]
        assert words in reason and "--fault" not in reason
    both = [Parameter(n, value=v).to_parameter_msg() for n, v in (("rate", 3.0), ("seed", 4))]
    atomically = peer.call(
        SetParametersAtomically, "/ruedo/set_parameters_atomically", parameters=both
    )
    assert atomically.result.reason == "'seed' is read-only"
    assert parameters.values("rate", "nobody") == [1.0, None]
    assert peer.call(GetParameters, "/ruedo/get_parameters", names=["rate"]).values[0].type == 3
