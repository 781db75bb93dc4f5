// The table follows the documentation of gz-sim's systems and of gazebo_plugins.
#include "world/compat/plugin_parameters.h"

#include <cmath>
#include <locale>
#include <sstream>
#include <string_view>

#include "world/compat/ros_controllers.h"
#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

// Parameters that are supported, or have no effect on results, separated by blanks. A plugin that
// is not listed here may have any.
struct Known {
  std::string_view plugin, words;
};

#define RUEDO_TOPICS " topic sub_topic odom_topic tf_topic frame_id child_frame_id "
#define RUEDO_LIMITS                                                       \
  " min_velocity max_velocity min_acceleration max_acceleration min_jerk " \
  "max_jerk min_linear_velocity max_linear_velocity min_angular_velocity " \
  "max_angular_velocity min_linear_acceleration max_linear_acceleration "  \
  "min_angular_acceleration max_angular_acceleration min_linear_jerk "     \
  "max_linear_jerk min_angular_jerk max_angular_jerk odom_publish_frequency "
#define RUEDO_PID " p_gain i_gain d_gain i_max i_min cmd_max cmd_min cmd_offset "

constexpr Known kKnown[] = {
    {"DiffDrive", "left_joint right_joint wheel_separation wheel_radius" RUEDO_TOPICS RUEDO_LIMITS},
    {"MecanumDrive",
     "front_left_joint front_right_joint back_left_joint back_right_joint wheelbase "
     "wheel_separation wheel_radius" RUEDO_TOPICS RUEDO_LIMITS},
    {"AckermannSteering",
     "left_joint right_joint left_steering_joint right_steering_joint wheel_separation "
     "kingpin_width wheel_base steering_limit wheel_radius steering_only steer_p_gain "
     "use_actuator_msg actuator_number" RUEDO_TOPICS RUEDO_LIMITS},
    {"VelocityControl", "topic link_name initial_linear initial_angular"},
    {"TrackedVehicle",
     "body_link left_track right_track tracks_separation tracks_height track_height "
     "steering_efficiency linear_velocity angular_velocity debug odom_publish_frequency "
     "odom_frame" RUEDO_TOPICS},
    {"TrackController",
     "link topic velocity_topic center_of_rotation_topic odometry_topic status_topic "
     "track_orientation max_command_age odometry_publish_frequency debug min_velocity "
     "max_velocity min_acceleration max_acceleration min_jerk max_jerk"},
    {"JointController",
     "joint_name joint_index use_force_commands use_actuator_msg actuator_number topic sub_topic "
     "initial_velocity" RUEDO_PID},
    {"JointPositionController",
     "joint_name joint_index use_velocity_commands use_actuator_msg actuator_number topic "
     "sub_topic "
     "initial_position" RUEDO_PID},
    {"JointTrajectoryController",
     "joint_name topic use_header_start_time initial_position position_p_gain position_i_gain "
     "position_d_gain position_i_min position_i_max position_cmd_min position_cmd_max "
     "position_cmd_offset velocity_p_gain velocity_i_gain velocity_d_gain velocity_i_min "
     "velocity_i_max velocity_cmd_min velocity_cmd_max velocity_cmd_offset"},
    {"ApplyJointForce", "joint_name topic"},
    {"JointStatePublisher", "joint_name topic update_rate"},
    {"OdometryPublisher",
     "odom_frame robot_base_frame odom_publish_frequency odom_topic odom_covariance_topic tf_topic "
     "dimensions xyz_offset rpy_offset gaussian_noise child_frame_id"},
    {"DetachableJoint",
     "parent_link child_model child_link topic attach_topic detach_topic output_topic "
     "suppress_child_warning"},
    {"Elevator",
     "update_rate floor_link_prefix door_joint_prefix cabin_joint initial_floor "
     "open_door_wait_duration state_topic state_publish_rate cmd_topic"},
    {"ElevatorPlugin", "lift_joint door_joint floor_height door_wait_time topic"},
    {"slotcar",
     "nominal_drive_speed nominal_drive_acceleration max_drive_acceleration nominal_turn_speed "
     "nominal_turn_acceleration max_turn_acceleration tire_radius base_width stop_distance "
     "stop_radius reversible steering min_turning_radius turning_right_angle_mul_offset "
     "lookahead_distance display_markers nominal_voltage nominal_capacity charging_current mass "
     "inertia friction_coefficient nominal_power"},
    {"TouchPlugin", "target collision create_contact_sensor_for_collision time namespace enabled"},
    {"PerformerDetector", "topic geometry pose header_data"},
    {"PosePublisher",
     "publish_link_pose publish_visual_pose publish_collision_pose publish_sensor_pose "
     "publish_model_pose publish_nested_model_pose use_pose_vector_msg static_publisher "
     "static_update_frequency update_frequency"},
    {"Imu", ""},
    {"Contact", ""},
    {"NavSat", ""},
    {"ForceTorque", ""},
    {"AirPressure", ""},
    {"AirSpeed", ""},
    {"Altimeter", ""},
    {"LogicalCamera", ""},
    {"UserCommands", ""},
    {"Magnetometer", "use_units_gauss use_earth_frame_ned"},
    {"SceneBroadcaster", "dynamic_pose_hertz state_hertz"},
    {"Physics", "engine include_entity_names"},
    {"Sensors",
     "render_engine render_engine_api_backend background_color ambient_light "
     "disable_on_drained_battery engine"},
};

#undef RUEDO_TOPICS
#undef RUEDO_LIMITS
#undef RUEDO_PID

// No effect here; reported where the value differs from `usual`.
struct Unsupported {
  std::string_view plugin;  // "": any plugin
  std::string_view parameter, usual;
  const char* text;
};

constexpr const char* kNoise = "the <noise> of its sensor applies";
constexpr const char* kJerk = "the jerk is not limited";
constexpr const char* kTrack = "the limits of the vehicle apply";
constexpr const char* kPoses = "ROBOT/pose comes 50 times a second";
constexpr const char* kEncoders =
    "ROBOT/odometry comes from its wheels; ROBOT/pose is the true pose";
constexpr const char* kCovariance = "odometry_t has no covariance";
constexpr const char* kBattery = "batteries do not run down";
constexpr const char* kCircle = "it turns as a differential drive does";
constexpr const char* kObstacles = "nothing stops it before an obstacle";
constexpr const char* kFloors = "ROBOT/joints shows where its cabin and its doors are";
constexpr const char* kRange = "the <range> of its sensor applies";
constexpr const char* kRate = "the <update_rate> of its sensor applies";
constexpr const char* kLens = "the <camera> of its sensor applies";
constexpr const char* kScene = "the world's <scene> says how pictures look";
constexpr const char* kDistortion = "<distortion> in <camera> bends pictures";

constexpr Unsupported kUnsupported[] = {
    {"", "min_jerk", "", kJerk},
    {"", "max_jerk", "", kJerk},
    {"", "min_linear_jerk", "", kJerk},
    {"", "max_linear_jerk", "", kJerk},
    {"", "min_angular_jerk", "", kJerk},
    {"", "max_angular_jerk", "", kJerk},
    {"AckermannSteering", "steering_only", "false 0", "it drives as well as it steers"},
    {"AckermannSteering", "steer_p_gain", "", "wheels steer as fast as their joints may"},
    {"VelocityControl", "link_name", "", "the model moves as a whole"},
    {"TrackController", "min_velocity", "", kTrack},
    {"TrackController", "max_velocity", "", kTrack},
    {"TrackController", "min_acceleration", "", kTrack},
    {"TrackController", "max_acceleration", "", kTrack},
    {"Elevator", "state_topic", "", kFloors},
    {"Elevator", "initial_floor", "0", "it begins where its cabin is"},
    {"slotcar", "max_turn_acceleration", "", "it brakes its turns as it begins them"},
    {"slotcar", "stop_distance", "", kObstacles},
    {"slotcar", "stop_radius", "", kObstacles},
    {"slotcar", "reversible", "true 1", "it also drives backwards"},
    {"slotcar", "steering", "diff_drive", kCircle},
    {"slotcar", "min_turning_radius", "", kCircle},
    {"slotcar", "nominal_voltage", "", kBattery},
    {"slotcar", "nominal_capacity", "", kBattery},
    {"slotcar", "charging_current", "", kBattery},
    {"slotcar", "nominal_power", "", kBattery},
    {"slotcar", "mass", "", kBattery},
    {"slotcar", "inertia", "", kBattery},
    {"slotcar", "friction_coefficient", "", kBattery},
    {"DetachableJoint", "output_topic", "", "it does not publish what it holds"},
    {"PosePublisher", "update_frequency", "50", kPoses},
    {"PosePublisher", "static_update_frequency", "50", kPoses},
    {"JointStatePublisher", "update_rate", "0", "ROBOT/joints has its own rate"},
    {"Magnetometer", "use_units_gauss", "false 0", "magnetometer_t is in T"},
    {"Magnetometer", "use_earth_frame_ned", "false 0", "the world's axes are its own"},
    {"Physics", "engine", "", "Ruedo uses its own physics"},
    {"Sensors", "background_color", "", kScene},
    {"Sensors", "ambient_light", "", kScene},
    {"Sensors", "disable_on_drained_battery", "false 0", "batteries do not run down"},
    {"", "odometrySource", "encoder ENCODER 0", kEncoders},
    {"", "odometry_source", "encoder ENCODER 0", kEncoders},
    {"", "covariance_x", "0", kCovariance},
    {"", "covariance_y", "0", kCovariance},
    {"", "covariance_yaw", "0", kCovariance},
    {"gazebo_ros_planar_move", "cmdTimeout", "-1 0", "Ruedo's watchdog applies"},
    {"gazebo_ros_planar_move", "cmd_timeout", "-1 0", "Ruedo's watchdog applies"},
    {"gazebo_ros_joint_state_publisher", "updateRate", "0", "ROBOT/joints has its own rate"},
    {"gazebo_ros_joint_state_publisher", "update_rate", "0", "ROBOT/joints has its own rate"},
    {"gazebo_ros_imu", "initialOrientationAsReference", "false 0",
     "the orientation is relative to the world"},
    {"gazebo_ros_imu_sensor", "initialOrientationAsReference", "false 0",
     "the orientation is relative to the world"},
    {"gazebo_ros_imu_sensor", "initial_orientation_as_reference", "false 0",
     "the orientation is relative to the world"},
    {"gazebo_ros_imu_sensor", "gaussianNoise", "0", kNoise},
    {"gazebo_ros_imu_sensor", "gaussian_noise", "0", kNoise},
    {"gazebo_ros_imu_sensor", "updateRateHZ", "0", kRate},
    {"gazebo_ros_laser", "gaussianNoise", "0", kNoise},
    {"gazebo_ros_gpu_laser", "gaussianNoise", "0", kNoise},
    {"gazebo_ros_velodyne_laser", "min_range", "0", kRange},
    {"gazebo_ros_velodyne_laser", "max_range", "0", kRange},
    {"gazebo_ros_velodyne_gpu_laser", "min_range", "0", kRange},
    {"gazebo_ros_velodyne_gpu_laser", "max_range", "0", kRange},
    {"gazebo_ros_velodyne_laser", "min_intensity", "0", kRange},
    {"gazebo_ros_velodyne_gpu_laser", "min_intensity", "0", kRange},
    {"gazebo_ros_range", "updateRate", "0", kRate},
    {"gazebo_ros_range", "update_rate", "0", kRate},
    {"hector_gazebo_ros_sonar", "updateRate", "0", kRate},
    {"gazebo_ros_block_laser", "updateRate", "0", kRate},
    {"gazebo_ros_bumper", "updateRate", "0", kRate},
    {"gazebo_ros_bumper", "update_rate", "0", kRate},
    {"gazebo_ros_camera", "updateRate", "0", kRate},
    {"gazebo_ros_camera", "update_rate", "0", kRate},
    {"gazebo_ros_depth_camera", "updateRate", "0", kRate},
    {"gazebo_ros_openni_kinect", "updateRate", "0", kRate},
    {"gazebo_ros_multicamera", "updateRate", "0", kRate},
    {"", "focalLength", "0", kLens},
    {"", "focal_length", "0", kLens},
    {"", "CxPrime", "0", kLens},
    {"", "cx_prime", "0", kLens},
    {"", "Cx", "0", kLens},
    {"", "Cy", "0", kLens},
    {"", "cx", "0", kLens},
    {"", "cy", "0", kLens},
    {"", "triggered", "false 0", "pictures come at its rate, not on request"},
    {"gazebo_ros_block_laser", "gaussianNoise", "0", kNoise},
    {"gazebo_ros_velodyne_laser", "gaussianNoise", "0", kNoise},
    {"gazebo_ros_velodyne_laser", "gaussian_noise", "0", kNoise},
    {"gazebo_ros_velodyne_gpu_laser", "gaussianNoise", "0", kNoise},
    {"gazebo_ros_velodyne_gpu_laser", "gaussian_noise", "0", kNoise},
    {"gazebo_ros_range", "gaussianNoise", "0", kNoise},
    {"hector_gazebo_ros_sonar", "gaussianNoise", "0", kNoise},
    {"hector_gazebo_ros_sonar", "offset", "0", kNoise},
    {"hector_gazebo_ros_sonar", "drift", "0", kNoise},
    {"", "distortionK1", "0", kDistortion},
    {"", "distortionK2", "0", kDistortion},
    {"", "distortionK3", "0", kDistortion},
    {"", "distortionT1", "0", kDistortion},
    {"", "distortionT2", "0", kDistortion},
    {"", "distortion_k1", "0", kDistortion},
    {"", "distortion_k2", "0", kDistortion},
    {"", "distortion_k3", "0", kDistortion},
    {"", "distortion_t1", "0", kDistortion},
    {"", "distortion_t2", "0", kDistortion},
    {"", "hackBaseline", "0", "camera_info_t has no baseline"},
    {"", "hack_baseline", "0", "camera_info_t has no baseline"},
    {"", "pointCloudCutoff", "0", "the camera's <clip> says how near it sees"},
    {"", "pointCloudCutoffMax", "0", "the camera's <clip> says how far it sees"},
    {"", "min_depth", "0", "the camera's <clip> says how near it sees"},
    {"", "max_depth", "0", "the camera's <clip> says how far it sees"},
};

// Files write 1e-8 for "no limit".
bool is_zero(const std::string& text) {
  constexpr double kNone = 1e-6;
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  double value = 0.0;
  return (in >> value) && std::abs(value) < kNone;
}

bool says_more(const Element& written, std::string_view usual) {
  if (usual == "0") return !is_zero(written.text);
  return usual.empty() || !has_word(usual, written.text);
}

// Robots have the same limits in both directions here.
void name_backwards(const Element& plugin, const std::string& name, const std::string& where,
                    Findings& findings) {
  for (const char* axis : {"velocity", "linear_velocity", "angular_velocity"}) {
    const Element *least = plugin.child("min_" + std::string(axis)),
                  *most = plugin.child("max_" + std::string(axis));
    if (!least || !most || !least->children.empty() || !most->children.empty()) continue;
    const double back = least->as_number(Allowed{.infinite = true}),
                 ahead = most->as_number(Allowed{.infinite = true});
    if (std::abs(back + ahead) <= 1e-9 * std::abs(ahead)) continue;
    findings.unsupported(least->source, where,
                         "<" + least->name + "> of the plugin " + name +
                             " is not supported: it is as fast both ways as <" + most->name +
                             "> says");
  }
}

}  // namespace

void name_parameters(const Element& plugin, const std::string& where, Findings& findings) {
  const PluginKind kind = kind_of(plugin);
  using Does = PluginKind::Does;
  if (kind.does != Does::drive && kind.does != Does::joints && kind.does != Does::served) return;
  const auto tell = [&](const Element& child, const std::string& text) {
    findings.unsupported(child.source, where,
                         "<" + child.name + "> of the plugin " + kind.name + text);
  };
  for (const auto& child : plugin.children) {
    if (child->name.find(':') != std::string::npos) continue;
    for (const Unsupported& each : kUnsupported) {
      if ((each.plugin.empty() || each.plugin == kind.name) && each.parameter == child->name &&
          says_more(*child, each.usual))
        tell(*child, std::string(" is not supported: ") + each.text);
    }
    for (const Known& known : kKnown) {
      if (known.plugin == kind.name && !has_word(known.words, child->name))
        tell(*child, " is not known, and does nothing");
    }
  }
  if (kind.does == Does::drive)
    read_or_leave_out(where, "it is left out", findings,
                      [&] { name_backwards(plugin, kind.name, where, findings); });
}

}  // namespace ruedo::world
