"""The action simulation_interfaces/SimulateSteps, as actions lie on services and topics
(design.ros2.org/articles/actions.html), and rmw_cyclonedds has services on the wire.
"""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl.types import array, int8, int64, sequence, uint8, uint64
from ros_types import Time
from simulation_types import Result

ACTION = "simulation_interfaces::action::dds_::SimulateSteps_"
CANCEL = "action_msgs::srv::dds_::CancelGoal_"


@dataclass
class UUID(IdlStruct, typename="unique_identifier_msgs::msg::dds_::UUID_"):
    uuid: array[uint8, 16]


@dataclass
class GoalInfo(IdlStruct, typename="action_msgs::msg::dds_::GoalInfo_"):
    goal_id: UUID
    stamp: Time


@dataclass
class GoalStatus(IdlStruct, typename="action_msgs::msg::dds_::GoalStatus_"):
    goal_info: GoalInfo
    status: int8


@dataclass
class GoalStatusArray(IdlStruct, typename="action_msgs::msg::dds_::GoalStatusArray_"):
    status_list: sequence[GoalStatus]


@dataclass
class Goal(IdlStruct, typename=ACTION + "Goal_"):
    steps: uint64


@dataclass
class ActionResult(IdlStruct, typename=ACTION + "Result_"):
    result: Result


@dataclass
class Feedback(IdlStruct, typename=ACTION + "Feedback_"):
    completed_steps: uint64
    remaining_steps: uint64


@dataclass
class FeedbackMessage(IdlStruct, typename=ACTION + "FeedbackMessage_"):
    goal_id: UUID
    feedback: Feedback


def part(name: str, **fields: type) -> type:
    header = {"client": uint64, "sequence_number": int64}
    return make_idl_struct(name.rsplit("::", 1)[1], name, {**header, **fields})


SERVICES = {
    "simulate_steps/_action/send_goal": (
        part(ACTION + "SendGoal_Request_", goal_id=UUID, goal=Goal),
        part(ACTION + "SendGoal_Response_", accepted=bool, stamp=Time),
    ),
    "simulate_steps/_action/get_result": (
        part(ACTION + "GetResult_Request_", goal_id=UUID),
        part(ACTION + "GetResult_Response_", status=int8, result=ActionResult),
    ),
    "simulate_steps/_action/cancel_goal": (
        part(CANCEL + "Request_", goal_info=GoalInfo),
        part(CANCEL + "Response_", return_code=int8, goals_canceling=sequence[GoalInfo]),
    ),
}
