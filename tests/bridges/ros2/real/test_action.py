"""simulate_steps, by rclpy's action client."""

from __future__ import annotations

import pytest
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient
from simulation_interfaces.action import SimulateSteps
from simulation_interfaces.msg import Result, SimulationState
from simulation_interfaces.srv import GetEntityState, SetSimulationState

ENDLESS = 1 << 62
NAME = "/simulate_steps"


class Steps:
    def __init__(self, peer):
        self.peer, self.client = peer, ActionClient(peer.node, SimulateSteps, NAME)
        self.feedback = []
        assert self.client.wait_for_server(30)

    def send(self, steps):
        """The goal's handle."""
        goal = SimulateSteps.Goal(steps=steps)
        future = self.client.send_goal_async(
            goal, feedback_callback=lambda one: self.feedback.append(one.feedback)
        )
        return self.peer.result(future, "the goal")

    def result(self, goal):
        reply = self.peer.result(goal.get_result_async(), "the result")
        return reply.status, reply.result.result.result

    def cancel(self, goal):
        reply = self.peer.result(goal.cancel_goal_async(), "cancelling")
        return reply.return_code, len(reply.goals_canceling)

    def sim_us(self):
        stamp = self.peer.call(GetEntityState, "/get_entity_state", entity="p3at").state.header
        return stamp.stamp.sec * 1_000_000 + stamp.stamp.nanosec // 1000


@pytest.fixture
def steps(peer):
    paused = SimulationState(state=SimulationState.STATE_PAUSED)
    reply = peer.call(SetSimulationState, "/set_simulation_state", state=paused)
    assert reply.result.result == Result.RESULT_OK
    steps = Steps(peer)
    yield steps
    steps.client.destroy()


def test_a_goal_takes_its_steps_with_feedback_for_each(steps):
    # rclpy's client drops the feedback of a goal that has ended meanwhile.
    heard = steps.peer.hear(SimulateSteps.Impl.FeedbackMessage, f"{NAME}/_action/feedback")
    before = steps.sim_us()
    goal = steps.send(5)
    assert goal.accepted and goal.stamp.sec > 0
    assert steps.result(goal) == (GoalStatus.STATUS_SUCCEEDED, Result.RESULT_OK)
    assert steps.sim_us() == before + 5 * 5000
    steps.peer.spin_until(lambda: len(heard) >= 5, "feedback")
    told = [(m.feedback.completed_steps, m.feedback.remaining_steps) for m in heard]
    assert told == [(1, 4), (2, 3), (3, 2), (4, 1), (5, 0)]
    assert all(m.goal_id == goal.goal_id for m in heard)
    assert steps.result(goal) == (GoalStatus.STATUS_SUCCEEDED, Result.RESULT_OK)  # again
    nothing = steps.send(0)
    assert steps.result(nothing) == (GoalStatus.STATUS_SUCCEEDED, Result.RESULT_OK)


def test_a_goal_is_cancelled_between_steps(steps):
    endless = steps.send(ENDLESS)
    steps.peer.spin_until(lambda: len(steps.feedback) >= 3, "feedback")
    assert not steps.send(1).accepted  # one at a time
    assert steps.cancel(endless) == (CancelGoal.Response.ERROR_NONE, 1)
    assert steps.result(endless) == (GoalStatus.STATUS_CANCELED, Result.RESULT_OK)
    after = steps.sim_us()
    assert steps.cancel(endless) == (CancelGoal.Response.ERROR_GOAL_TERMINATED, 0)
    call = "/simulate_steps/_action/cancel_goal"
    everything = CancelGoal.Request().goal_info
    assert not steps.peer.call(CancelGoal, call, goal_info=everything).goals_canceling
    another = steps.send(ENDLESS)
    long_ago = CancelGoal.Request().goal_info
    long_ago.stamp.sec = 1
    assert not steps.peer.call(CancelGoal, call, goal_info=long_ago).goals_canceling
    assert len(steps.peer.call(CancelGoal, call, goal_info=everything).goals_canceling) == 1
    assert steps.result(another) == (GoalStatus.STATUS_CANCELED, Result.RESULT_OK)
    unknown = CancelGoal.Request().goal_info
    unknown.goal_id.uuid = [9] * 16
    reply = steps.peer.call(CancelGoal, call, goal_info=unknown)
    assert reply.return_code == CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID
    assert steps.sim_us() >= after


def test_a_simulation_that_runs_takes_no_steps(run, peer):
    steps = Steps(peer)
    goal = steps.send(2)
    assert steps.result(goal) == (GoalStatus.STATUS_ABORTED, Result.RESULT_OPERATION_FAILED)
    steps.client.destroy()
