"""simulation_interfaces 1.x as rmw_cyclonedds has services on the wire: 16 bytes of header, then
the request or the response.
"""

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


@dataclass
class Empty_(IdlStruct, typename=mark("GetSimulatorFeatures", "Request")):
    client: uint64
    sequence_number: int64
    structure_needs_at_least_one_member: uint8 = 0


@dataclass
class Features(IdlStruct, typename=mark("GetSimulatorFeatures", "Response")):
    client: uint64
    sequence_number: int64
    features: sequence[uint16]
    spawn_formats: sequence[str]
    custom_info: str


@dataclass
class GetState(IdlStruct, typename=mark("GetSimulationState", "Request")):
    client: uint64
    sequence_number: int64
    structure_needs_at_least_one_member: uint8 = 0


@dataclass
class GotState(IdlStruct, typename=mark("GetSimulationState", "Response")):
    client: uint64
    sequence_number: int64
    state: uint8
    result: Result


def part(service: str, which: str, fields: dict[str, type]) -> type:
    return make_idl_struct(
        f"{service}{which}",
        mark(service, which),
        {"client": uint64, "sequence_number": int64, **fields},
    )


def request(service: str, /, **fields: type) -> type:
    return part(service, "Request", fields)


def response(service: str, /, **fields: type) -> type:
    return part(service, "Response", fields)


SERVICES = {
    "get_simulator_features": (Empty_, Features),
    "get_simulation_state": (GetState, GotState),
    "set_simulation_state": (
        request("SetSimulationState", state=uint8),
        response("SetSimulationState", result=Result),
    ),
    "reset_simulation": (
        request("ResetSimulation", scope=uint8),
        response("ResetSimulation", result=Result),
    ),
    "step_simulation": (
        request("StepSimulation", steps=uint64),
        response("StepSimulation", result=Result),
    ),
    "spawn_entity": (
        request(
            "SpawnEntity",
            name=str,
            allow_renaming=bool,
            uri=str,
            resource_string=str,
            entity_namespace=str,
            initial_pose=PoseStamped,
        ),
        response("SpawnEntity", result=Result, entity_name=str),
    ),
    "delete_entity": (request("DeleteEntity", entity=str), response("DeleteEntity", result=Result)),
    "get_entities": (
        request("GetEntities", filters=EntityFilters),
        response("GetEntities", result=Result, entities=sequence[str]),
    ),
    "get_entity_state": (
        request("GetEntityState", entity=str),
        response("GetEntityState", result=Result, state=EntityState),
    ),
    "set_entity_state": (
        request("SetEntityState", entity=str, state=EntityState),
        response("SetEntityState", result=Result),
    ),
}
