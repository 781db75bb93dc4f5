"""SimulateSteps over DDS: goals, feedback, results and cancelling."""

from __future__ import annotations

import pytest
from action_types import SERVICES, UUID, FeedbackMessage, Goal, GoalInfo, GoalStatusArray
from conftest import Run, take, wait_for
from ros_types import Time
from test_services import FAILED, OK, PAUSED, Client

EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = 2, 3, 4, 5, 6
PREFIX = "simulate_steps/_action/"


class ActionClient(Client):
    """A client of the action; its goals have ids of 16 equal bytes."""

    services = {**Client.services, **SERVICES}

    def __init__(self, domain: int):
        super().__init__(domain)
        self.feedback = self.peer.reader(f"/{PREFIX}feedback", FeedbackMessage)
        wait_for(self.feedback.get_matched_publications, "a writer of feedback")

    def send(self, goal: int, steps: int) -> bool:
        reply = self.call(PREFIX + "send_goal", uuid(goal), Goal(steps))
        assert (reply.stamp.sec > 0) == reply.accepted
        return reply.accepted

    def result(self, goal: int) -> tuple[int, int]:
        reply = self.call(PREFIX + "get_result", uuid(goal))
        return reply.status, reply.result.result.result

    def cancel(self, goal: int, stamp: int = 0) -> tuple[int, list[int]]:
        info = GoalInfo(uuid(goal), Time(stamp, 0))
        reply = self.call(PREFIX + "cancel_goal", info)
        return reply.return_code, [g.goal_id.uuid[0] for g in reply.goals_canceling]

    def status(self) -> dict[int, int]:
        latched = self.peer.reader(f"/{PREFIX}status", GoalStatusArray, latched=True, depth=1)
        return {s.goal_info.goal_id.uuid[0]: s.status for s in take(latched)[-1].status_list}

    def sim_us(self) -> int:
        return self.call("get_entity_state", "p3at").state.header.stamp.us


def uuid(goal: int) -> UUID:
    return UUID([goal] * 16)


@pytest.fixture
def client():
    with Run("--no-noise") as run:
        client = ActionClient(run.domain)
        assert client.call("set_simulation_state", PAUSED).result.result == OK
        yield client


def test_a_goal_takes_its_steps_and_tells_of_each(client):
    before = client.sim_us()
    assert client.send(7, 5)
    assert client.result(7) == (SUCCEEDED, OK)
    assert client.sim_us() == before + 5 * 5000
    told = take(client.feedback, 5)
    assert [(f.feedback.completed_steps, f.feedback.remaining_steps) for f in told] == [
        (1, 4),
        (2, 3),
        (3, 2),
        (4, 1),
        (5, 0),
    ]
    assert all(list(f.goal_id.uuid) == [7] * 16 for f in told)
    assert client.status() == {7: SUCCEEDED}
    assert client.result(7) == (SUCCEEDED, OK)  # again
    assert not client.send(7, 1)  # the same goal
    assert client.send(8, 0) and client.result(8) == (SUCCEEDED, OK)


def test_a_goal_is_cancelled_between_steps(client):
    assert client.send(1, 1 << 62)
    take(client.feedback, 3)
    assert not client.send(2, 1)  # one at a time
    assert client.status() == {1: EXECUTING}
    assert client.cancel(9) == (2, [])  # unknown
    assert client.cancel(1) == (0, [1])
    assert client.result(1) == (CANCELED, OK)
    after = client.sim_us()
    assert client.cancel(1) == (3, [])  # over
    assert client.cancel(0) == (0, [])  # all, of which there are none
    assert client.send(2, 1 << 62)
    assert client.cancel(0, stamp=1) == (0, [])  # all until 1970
    assert client.cancel(0) == (0, [2])
    assert client.result(2) == (CANCELED, OK)
    assert client.status() == {1: CANCELED, 2: CANCELED}
    assert client.sim_us() >= after


def test_a_simulation_that_runs_takes_no_steps():
    with Run() as run:
        client = ActionClient(run.domain)
        assert client.send(3, 2)
        assert client.result(3) == (ABORTED, FAILED)
        assert client.result(4)[0] == 0  # no such goal
