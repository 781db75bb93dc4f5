"""simulation_interfaces 1.5 as rmw_cyclonedds has services on the wire: 16 bytes of header, then
the request or the response.
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


@dataclass
class EntityInfo(IdlStruct, typename="simulation_interfaces::msg::dds_::EntityInfo_"):
    category: EntityCategory
    description: str
    tags: sequence[str]


@dataclass
class NamedPose(IdlStruct, typename="simulation_interfaces::msg::dds_::NamedPose_"):
    name: str
    description: str
    tags: sequence[str]
    pose: Pose


@dataclass
class Resource(IdlStruct, typename="simulation_interfaces::msg::dds_::Resource_"):
    uri: str
    resource_string: str


@dataclass
class Spawnable(IdlStruct, typename="simulation_interfaces::msg::dds_::Spawnable_"):
    uri: str
    description: str
    spawn_bounds: Bounds


@dataclass
class SpawnEntity(IdlStruct, typename="simulation_interfaces::msg::dds_::SpawnEntity_"):
    name: str
    allow_renaming: bool
    entity_resource: Resource
    entity_namespace: str
    initial_pose: PoseStamped


@dataclass
class SpawnResult(IdlStruct, typename="simulation_interfaces::msg::dds_::SpawnResult_"):
    result: Result
    entity_name: str


@dataclass
class WorldResource(IdlStruct, typename="simulation_interfaces::msg::dds_::WorldResource_"):
    name: str
    world_resource: Resource
    description: str
    tags: sequence[str]


def part(service: str, which: str, fields: dict[str, type]) -> type:
    return make_idl_struct(
        f"{service}{which}",
        mark(service, which),
        {"client": uint64, "sequence_number": int64, **fields},
    )


NOTHING = {"structure_needs_at_least_one_member": uint8}
RESULT = {"result": Result}
TYPES = {
    "DeleteEntity": ({"entity": str}, RESULT),
    "GetAvailableWorlds": (
        {
            "additional_sources": sequence[str],
            "filter": TagsFilter,
            "offline_only": bool,
            "continue_on_error": bool,
        },
        {**RESULT, "worlds": sequence[WorldResource]},
    ),
    "GetCurrentWorld": (NOTHING, {**RESULT, "world": WorldResource}),
    "GetEntities": ({"filters": EntityFilters}, {**RESULT, "entities": sequence[str]}),
    "GetEntitiesStates": (
        {"filters": EntityFilters},
        {**RESULT, "entities": sequence[str], "states": sequence[EntityState]},
    ),
    "GetEntityBounds": ({"entity": str}, {**RESULT, "bounds": Bounds}),
    "GetEntityInfo": ({"entity": str}, {**RESULT, "info": EntityInfo}),
    "GetEntityState": ({"entity": str}, {**RESULT, "state": EntityState}),
    "GetNamedPoseBounds": ({"name": str}, {**RESULT, "bounds": Bounds}),
    "GetNamedPoses": ({"tags": TagsFilter}, {**RESULT, "poses": sequence[NamedPose]}),
    "GetSimulationState": (NOTHING, {"state": uint8, **RESULT}),
    "GetSimulatorFeatures": (
        NOTHING,
        {"features": sequence[uint16], "spawn_formats": sequence[str], "custom_info": str},
    ),
    "GetSpawnables": ({"sources": sequence[str]}, {**RESULT, "spawnables": sequence[Spawnable]}),
    "LoadWorld": (
        {
            "uri": str,
            "resource_string": str,
            "fail_on_unsupported_element": bool,
            "ignore_missing_or_unsupported_assets": bool,
        },
        {**RESULT, "world": WorldResource},
    ),
    "ResetSimulation": ({"scope": uint8}, RESULT),
    "SetEntityInfo": ({"entity": str, "info": EntityInfo}, RESULT),
    "SetEntityState": ({"entity": str, "state": EntityState}, RESULT),
    "SetSimulationState": ({"state": uint8}, RESULT),
    "SpawnEntities": (
        {"spawn_requests": sequence[SpawnEntity]},
        {**RESULT, "results": sequence[SpawnResult]},
    ),
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
    "UnloadWorld": (NOTHING, RESULT),
}

SERVICES = {
    re.sub("(?<!^)(?=[A-Z])", "_", name).lower(): (
        part(name, "Request", question),
        part(name, "Response", answer),
    )
    for name, (question, answer) in TYPES.items()
}
