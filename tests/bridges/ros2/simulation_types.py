"""Some of simulation_interfaces as rmw_cyclonedds has services on the wire: 16 bytes of header,
then the request or the response.
"""

import re
from dataclasses import dataclass

from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl.types import int64, sequence, uint8, uint16, uint64
from ros_types import Header, Pose, Twist, Vector3


def mark(name: str, which: str) -> str:
    return f"simulation_interfaces::srv::dds_::{name}_{which}_"


@dataclass
class Result(IdlStruct, typename="simulation_interfaces::msg::dds_::Result_"):
    result: uint8
    error_message: str


@dataclass
class Accel(IdlStruct, typename="geometry_msgs::msg::dds_::Accel_"):
    linear: Vector3
    angular: Vector3


@dataclass
class EntityState(IdlStruct, typename="simulation_interfaces::msg::dds_::EntityState_"):
    header: Header
    pose: Pose
    twist: Twist
    acceleration: Accel


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: Header
    pose: Pose


@dataclass
class EntityCategory(IdlStruct, typename="simulation_interfaces::msg::dds_::EntityCategory_"):
    category: uint8


@dataclass
class TagsFilter(IdlStruct, typename="simulation_interfaces::msg::dds_::TagsFilter_"):
    tags: sequence[str]
    filter_mode: uint8


@dataclass
class Bounds(IdlStruct, typename="simulation_interfaces::msg::dds_::Bounds_"):
    type: uint8
    points: sequence[Vector3]


@dataclass
class EntityFilters(IdlStruct, typename="simulation_interfaces::msg::dds_::EntityFilters_"):
    filter: str
    categories: sequence[EntityCategory]
    tags: TagsFilter
    bounds: Bounds


def part(service: str, which: str, fields: dict[str, type]) -> type:
    return make_idl_struct(
        f"{service}{which}",
        mark(service, which),
        {"client": uint64, "sequence_number": int64, **fields},
    )


NOTHING = {"structure_needs_at_least_one_member": uint8}
RESULT = {"result": Result}
TYPES = {
    "GetEntities": ({"filters": EntityFilters}, {**RESULT, "entities": sequence[str]}),
    "GetEntityState": ({"entity": str}, {**RESULT, "state": EntityState}),
    "GetSimulationState": (NOTHING, {"state": uint8, **RESULT}),
    "GetSimulatorFeatures": (
        NOTHING,
        {"features": sequence[uint16], "spawn_formats": sequence[str], "custom_info": str},
    ),
    "SetSimulationState": ({"state": uint8}, RESULT),
    "SpawnEntity": (
        {
            "name": str,
            "allow_renaming": bool,
            "uri": str,
            "resource_string": str,
            "entity_namespace": str,
            "initial_pose": PoseStamped,
        },
        {**RESULT, "entity_name": str},
    ),
    "StepSimulation": ({"steps": uint64}, RESULT),
}

SERVICES = {
    re.sub("(?<!^)(?=[A-Z])", "_", name).lower(): (
        part(name, "Request", question),
        part(name, "Response", answer),
    )
    for name, (question, answer) in TYPES.items()
}
