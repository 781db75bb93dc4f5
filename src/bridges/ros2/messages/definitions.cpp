// Names, types and order of the fields as the packages common_interfaces, rcl_interfaces,
// rmw_dds_common, geometry2 and ros_gz have them from Humble to Lyrical, and simulation_interfaces
// in its versions 1.x.
#include "bridges/ros2/messages/definitions.h"

namespace ruedo::ros2 {
namespace {

constexpr Definition kDefinitions[] = {
    {"builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec\n"},
    {"builtin_interfaces/msg/Duration", "int32 sec\nuint32 nanosec\n"},
    {"std_msgs/msg/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    {"std_msgs/msg/Bool", "bool data\n"},
    {"std_msgs/msg/String", "string data\n"},
    {"std_msgs/msg/UInt32", "uint32 data\n"},
    {"std_msgs/msg/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"},
    {"std_msgs/msg/MultiArrayDimension", "string label\nuint32 size\nuint32 stride\n"},
    {"std_msgs/msg/MultiArrayLayout", "MultiArrayDimension[] dim\nuint32 data_offset\n"},
    {"std_msgs/msg/Float64MultiArray", "MultiArrayLayout layout\nfloat64[] data\n"},
    {"rosgraph_msgs/msg/Clock", "builtin_interfaces/Time clock\n"},
    {"geometry_msgs/msg/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/msg/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/msg/Point32", "float32 x\nfloat32 y\nfloat32 z\n"},
    {"geometry_msgs/msg/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
    {"geometry_msgs/msg/Pose", "Point position\nQuaternion orientation\n"},
    {"geometry_msgs/msg/PoseWithCovariance", "Pose pose\nfloat64[36] covariance\n"},
    {"geometry_msgs/msg/PoseWithCovarianceStamped",
     "std_msgs/Header header\nPoseWithCovariance pose\n"},
    {"geometry_msgs/msg/PoseStamped", "std_msgs/Header header\nPose pose\n"},
    {"geometry_msgs/msg/Twist", "Vector3 linear\nVector3 angular\n"},
    {"geometry_msgs/msg/TwistStamped", "std_msgs/Header header\nTwist twist\n"},
    {"geometry_msgs/msg/TwistWithCovariance", "Twist twist\nfloat64[36] covariance\n"},
    {"geometry_msgs/msg/Accel", "Vector3 linear\nVector3 angular\n"},
    {"geometry_msgs/msg/Wrench", "Vector3 force\nVector3 torque\n"},
    {"geometry_msgs/msg/WrenchStamped", "std_msgs/Header header\nWrench wrench\n"},
    {"geometry_msgs/msg/Transform", "Vector3 translation\nQuaternion rotation\n"},
    {"geometry_msgs/msg/TransformStamped",
     "std_msgs/Header header\nstring child_frame_id\nTransform transform\n"},
    {"tf2_msgs/msg/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    {"nav_msgs/msg/Odometry",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance "
     "pose\ngeometry_msgs/TwistWithCovariance twist\n"},
    {"sensor_msgs/msg/LaserScan",
     "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 "
     "angle_increment\nfloat32 time_increment\n"
     "float32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] "
     "intensities\n"},
    {"sensor_msgs/msg/PointField", "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"},
    {"sensor_msgs/msg/PointCloud2",
     "std_msgs/Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool "
     "is_bigendian\nuint32 point_step\n"
     "uint32 row_step\nuint8[] data\nbool is_dense\n"},
    {"sensor_msgs/msg/ChannelFloat32", "string name\nfloat32[] values\n"},
    {"sensor_msgs/msg/PointCloud",
     "std_msgs/Header header\ngeometry_msgs/Point32[] points\nChannelFloat32[] channels\n"},
    {"sensor_msgs/msg/Range",
     "std_msgs/Header header\nuint8 radiation_type\nfloat32 field_of_view\nfloat32 "
     "min_range\nfloat32 max_range\nfloat32 range\n"
     "float32 variance\n",
     "std_msgs/Header header\nuint8 radiation_type\nfloat32 field_of_view\nfloat32 "
     "min_range\nfloat32 max_range\nfloat32 range\n"},
    {"sensor_msgs/msg/JointState",
     "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] "
     "effort\n"},
    {"sensor_msgs/msg/Imu",
     "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] "
     "orientation_covariance\n"
     "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
     "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"},
    {"sensor_msgs/msg/Image",
     "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 "
     "is_bigendian\nuint32 step\nuint8[] data\n"},
    {"sensor_msgs/msg/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
    {"sensor_msgs/msg/RegionOfInterest",
     "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
    {"sensor_msgs/msg/CameraInfo",
     "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] "
     "d\nfloat64[9] k\nfloat64[9] r\n"
     "float64[12] p\nuint32 binning_x\nuint32 binning_y\nRegionOfInterest roi\n"},
    {"sensor_msgs/msg/NavSatStatus", "int8 status\nuint16 service\n"},
    {"sensor_msgs/msg/NavSatFix",
     "std_msgs/Header header\nNavSatStatus status\nfloat64 latitude\nfloat64 longitude\nfloat64 "
     "altitude\nfloat64[9] position_covariance\nuint8 position_covariance_type\n"},
    {"sensor_msgs/msg/MagneticField",
     "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] "
     "magnetic_field_covariance\n"},
    {"sensor_msgs/msg/FluidPressure",
     "std_msgs/Header header\nfloat64 fluid_pressure\nfloat64 variance\n"},
    {"sensor_msgs/msg/Temperature",
     "std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n"},
    {"trajectory_msgs/msg/JointTrajectoryPoint",
     "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] "
     "effort\nbuiltin_interfaces/Duration time_from_start\n"},
    {"trajectory_msgs/msg/JointTrajectory",
     "std_msgs/Header header\nstring[] joint_names\nJointTrajectoryPoint[] points\n"},
    {"ros_gz_interfaces/msg/Altimeter",
     "std_msgs/Header header\nfloat64 vertical_position\nfloat64 vertical_velocity\nfloat64 "
     "vertical_reference\n"},
    {"ros_gz_interfaces/msg/Entity", "uint64 id\nstring name\nuint8 type\n"},
    {"ros_gz_interfaces/msg/JointWrench",
     "std_msgs/Header header\nstd_msgs/String body_1_name\nstd_msgs/UInt32 "
     "body_1_id\nstd_msgs/String body_2_name\n"
     "std_msgs/UInt32 body_2_id\ngeometry_msgs/Wrench body_1_wrench\ngeometry_msgs/Wrench "
     "body_2_wrench\n"},
    {"ros_gz_interfaces/msg/Contact",
     "Entity collision1\nEntity collision2\ngeometry_msgs/Vector3[] "
     "positions\ngeometry_msgs/Vector3[] normals\nfloat64[] depths\n"
     "JointWrench[] wrenches\n"},
    {"ros_gz_interfaces/msg/Contacts", "std_msgs/Header header\nContact[] contacts\n"},
    {"vision_msgs/msg/ObjectHypothesis", "string class_id\nfloat64 score\n"},
    {"vision_msgs/msg/ObjectHypothesisWithPose",
     "ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n"},
    {"vision_msgs/msg/Point2D", "float64 x\nfloat64 y\n"},
    {"vision_msgs/msg/Pose2D", "Point2D position\nfloat64 theta\n"},
    {"vision_msgs/msg/BoundingBox2D", "Pose2D center\nfloat64 size_x\nfloat64 size_y\n"},
    {"vision_msgs/msg/BoundingBox3D", "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n"},
    {"vision_msgs/msg/Detection2D",
     "std_msgs/Header header\nObjectHypothesisWithPose[] results\nBoundingBox2D bbox\nstring id\n"},
    {"vision_msgs/msg/Detection3D",
     "std_msgs/Header header\nObjectHypothesisWithPose[] results\nBoundingBox3D bbox\nstring id\n"},
    {"vision_msgs/msg/Detection2DArray", "std_msgs/Header header\nDetection2D[] detections\n"},
    {"vision_msgs/msg/Detection3DArray", "std_msgs/Header header\nDetection3D[] detections\n"},
    {"visualization_msgs/msg/UVCoordinate", "float32 u\nfloat32 v\n"},
    {"visualization_msgs/msg/MeshFile", "string filename\nuint8[] data\n"},
    {"visualization_msgs/msg/Marker",
     "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose "
     "pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration "
     "lifetime\nbool frame_locked\ngeometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] "
     "colors\nstring texture_resource\nsensor_msgs/CompressedImage texture\nUVCoordinate[] "
     "uv_coordinates\nstring text\nstring mesh_resource\nMeshFile mesh_file\nbool "
     "mesh_use_embedded_materials\n"},
    {"visualization_msgs/msg/MarkerArray", "Marker[] markers\n"},
    {"service_msgs/msg/ServiceEventInfo",
     "uint8 event_type\nbuiltin_interfaces/Time stamp\nchar[16] client_gid\nint64 "
     "sequence_number\n"},
    {"simulation_interfaces/msg/Result", "uint8 result\nstring error_message\n"},
    {"simulation_interfaces/msg/EntityState",
     "std_msgs/Header header\ngeometry_msgs/Pose pose\ngeometry_msgs/Twist "
     "twist\ngeometry_msgs/Accel acceleration\n"},
    {"simulation_interfaces/msg/EntityCategory", "uint8 category\n"},
    {"simulation_interfaces/msg/TagsFilter", "string[] tags\nuint8 filter_mode\n"},
    {"simulation_interfaces/msg/Bounds", "uint8 type\ngeometry_msgs/Vector3[] points\n"},
    {"simulation_interfaces/msg/EntityFilters",
     "string filter\nEntityCategory[] categories\nTagsFilter tags\nBounds bounds\n"},
    {"simulation_interfaces/msg/SimulationState", "uint8 state\n"},
    {"simulation_interfaces/msg/SimulatorFeatures",
     "uint16[] features\nstring[] spawn_formats\nstring custom_info\n"},
    {"simulation_interfaces/msg/EntityInfo",
     "EntityCategory category\nstring description\nstring[] tags\n"},
    {"simulation_interfaces/msg/NamedPose",
     "string name\nstring description\nstring[] tags\ngeometry_msgs/Pose pose\n"},
    {"simulation_interfaces/msg/Resource", "string uri\nstring resource_string\n"},
    {"simulation_interfaces/msg/Spawnable",
     "string uri\nstring description\nBounds spawn_bounds\n"},
    {"simulation_interfaces/msg/SpawnEntity",
     "string name\nbool allow_renaming\nResource entity_resource\nstring entity_namespace\n"
     "geometry_msgs/PoseStamped initial_pose\n"},
    {"simulation_interfaces/msg/SpawnResult", "Result result\nstring entity_name\n"},
    {"simulation_interfaces/msg/WorldResource",
     "string name\nResource world_resource\nstring description\nstring[] tags\n"},
    {"simulation_interfaces/srv/DeleteEntity", "string entity\n---\nResult result\n"},
    {"simulation_interfaces/srv/GetAvailableWorlds",
     "string[] additional_sources\nTagsFilter filter\nbool offline_only\nbool "
     "continue_on_error\n---\nResult result\nWorldResource[] worlds\n"},
    {"simulation_interfaces/srv/GetCurrentWorld", "---\nResult result\nWorldResource world\n"},
    {"simulation_interfaces/srv/GetEntities",
     "EntityFilters filters\n---\nResult result\nstring[] entities\n"},
    {"simulation_interfaces/srv/GetEntitiesStates",
     "EntityFilters filters\n---\nResult result\nstring[] entities\nEntityState[] states\n"},
    {"simulation_interfaces/srv/GetEntityBounds",
     "string entity\n---\nResult result\nBounds bounds\n"},
    {"simulation_interfaces/srv/GetEntityInfo",
     "string entity\n---\nResult result\nEntityInfo info\n"},
    {"simulation_interfaces/srv/GetEntityState",
     "string entity\n---\nResult result\nEntityState state\n"},
    {"simulation_interfaces/srv/GetNamedPoseBounds",
     "string name\n---\nResult result\nBounds bounds\n"},
    {"simulation_interfaces/srv/GetNamedPoses",
     "TagsFilter tags\n---\nResult result\nNamedPose[] poses\n"},
    {"simulation_interfaces/srv/GetSimulationState", "---\nSimulationState state\nResult result\n"},
    {"simulation_interfaces/srv/GetSimulatorFeatures", "---\nSimulatorFeatures features\n"},
    {"simulation_interfaces/srv/GetSpawnables",
     "string[] sources\n---\nResult result\nSpawnable[] spawnables\n"},
    {"simulation_interfaces/srv/LoadWorld",
     "string uri\nstring resource_string\nbool fail_on_unsupported_element\nbool "
     "ignore_missing_or_unsupported_assets\n---\nResult result\nWorldResource world\n"},
    {"simulation_interfaces/srv/ResetSimulation", "uint8 scope\n---\nResult result\n"},
    {"simulation_interfaces/srv/SetEntityInfo",
     "string entity\nEntityInfo info\n---\nResult result\n"},
    {"simulation_interfaces/srv/SetEntityState",
     "string entity\nEntityState state\n---\nResult result\n"},
    {"simulation_interfaces/srv/SetSimulationState", "SimulationState state\n---\nResult result\n"},
    {"simulation_interfaces/srv/SpawnEntities",
     "SpawnEntity[] spawn_requests\n---\nResult result\nSpawnResult[] results\n"},
    {"simulation_interfaces/srv/SpawnEntity",
     "string name\nbool allow_renaming\nstring uri\nstring resource_string\nstring "
     "entity_namespace\n"
     "geometry_msgs/PoseStamped initial_pose\n---\nResult result\nstring entity_name\n"},
    {"simulation_interfaces/srv/StepSimulation", "uint64 steps\n---\nResult result\n"},
    {"simulation_interfaces/srv/UnloadWorld", "---\nResult result\n"},
    {"diagnostic_msgs/msg/KeyValue", "string key\nstring value\n"},
    {"diagnostic_msgs/msg/DiagnosticStatus",
     "byte level\nstring name\nstring message\nstring hardware_id\nKeyValue[] values\n"},
    {"diagnostic_msgs/msg/DiagnosticArray", "std_msgs/Header header\nDiagnosticStatus[] status\n"},
    {"rcl_interfaces/msg/ParameterValue",
     "uint8 type\nbool bool_value\nint64 integer_value\nfloat64 double_value\nstring "
     "string_value\nbyte[] byte_array_value\nbool[] bool_array_value\nint64[] "
     "integer_array_value\nfloat64[] double_array_value\nstring[] string_array_value\n"},
    {"rcl_interfaces/msg/Parameter", "string name\nParameterValue value\n"},
    {"rcl_interfaces/msg/FloatingPointRange",
     "float64 from_value\nfloat64 to_value\nfloat64 step\n"},
    {"rcl_interfaces/msg/IntegerRange", "int64 from_value\nint64 to_value\nuint64 step\n"},
    {"rcl_interfaces/msg/ParameterDescriptor",
     "string name\nuint8 type\nstring description\nstring additional_constraints\nbool read_only "
     "false\nbool dynamic_typing false\nFloatingPointRange[<=1] "
     "floating_point_range\nIntegerRange[<=1] integer_range\n"},
    {"rcl_interfaces/msg/ListParametersResult", "string[] names\nstring[] prefixes\n"},
    {"rcl_interfaces/msg/SetParametersResult", "bool successful\nstring reason\n"},
    {"rcl_interfaces/msg/ParameterEvent",
     "builtin_interfaces/Time stamp\nstring node\nParameter[] new_parameters\nParameter[] "
     "changed_parameters\nParameter[] deleted_parameters\n"},
    {"rcl_interfaces/srv/GetParameters", "string[] names\n---\nParameterValue[] values\n"},
    {"rcl_interfaces/srv/GetParameterTypes", "string[] names\n---\nuint8[] types\n"},
    {"rcl_interfaces/srv/ListParameters",
     "string[] prefixes\nuint64 depth\n---\nListParametersResult result\n"},
    {"rcl_interfaces/srv/DescribeParameters",
     "string[] names\n---\nParameterDescriptor[] descriptors\n"},
    {"rcl_interfaces/srv/SetParameters",
     "Parameter[] parameters\n---\nSetParametersResult[] results\n"},
    {"rcl_interfaces/srv/SetParametersAtomically",
     "Parameter[] parameters\n---\nSetParametersResult result\n"},
    {"unique_identifier_msgs/msg/UUID", "uint8[16] uuid\n"},
    {"action_msgs/msg/GoalInfo",
     "unique_identifier_msgs/UUID goal_id\nbuiltin_interfaces/Time stamp\n"},
    {"action_msgs/msg/GoalStatus", "GoalInfo goal_info\nint8 status\n"},
    {"action_msgs/msg/GoalStatusArray", "GoalStatus[] status_list\n"},
    {"action_msgs/srv/CancelGoal",
     "GoalInfo goal_info\n---\nint8 return_code\nGoalInfo[] goals_canceling\n"},
    {"simulation_interfaces/action/SimulateSteps_Goal", "uint64 steps\n"},
    {"simulation_interfaces/action/SimulateSteps_Result", "Result result\n"},
    {"simulation_interfaces/action/SimulateSteps_Feedback",
     "uint64 completed_steps\nuint64 remaining_steps\n"},
    {"simulation_interfaces/action/SimulateSteps_SendGoal",
     "unique_identifier_msgs/UUID goal_id\nsimulation_interfaces/action/SimulateSteps_Goal goal\n"
     "---\nbool accepted\nbuiltin_interfaces/Time stamp\n"},
    {"simulation_interfaces/action/SimulateSteps_GetResult",
     "unique_identifier_msgs/UUID goal_id\n---\nint8 status\n"
     "simulation_interfaces/action/SimulateSteps_Result result\n"},
    {"simulation_interfaces/action/SimulateSteps_FeedbackMessage",
     "unique_identifier_msgs/UUID goal_id\n"
     "simulation_interfaces/action/SimulateSteps_Feedback feedback\n"},
    {"rmw_dds_common/msg/Gid", "char[16] data\n", "char[24] data\n"},
    {"rmw_dds_common/msg/NodeEntitiesInfo",
     "string<=256 node_namespace\nstring<=256 node_name\nGid[] reader_gid_seq\nGid[] "
     "writer_gid_seq\n"},
    {"rmw_dds_common/msg/ParticipantEntitiesInfo",
     "Gid gid\nNodeEntitiesInfo[] node_entities_info_seq\n"},
};

}  // namespace

std::span<const Definition> definitions() { return kDefinitions; }

}  // namespace ruedo::ros2
