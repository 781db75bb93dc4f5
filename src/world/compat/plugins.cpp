// The table of known plugins.
#include "world/compat/plugins.h"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace ruedo::world {
namespace {

using Does = PluginKind::Does;

struct Known {
  std::string_view name;
  Does does;
  const char* would = "";
  bool is_in_model = does == Does::drive || does == Does::joints || does == Does::control;
};

// One that a part of Ruedo replaces, for the model, link or sensor that it stands in.
constexpr Known in_model(std::string_view name) { return {name, Does::served, "", true}; }

// gz-sim's systems, by class name.
constexpr Known kSystems[] = {
    {"DiffDrive", Does::drive},
    {"MecanumDrive", Does::drive},
    {"AckermannSteering", Does::drive},
    {"VelocityControl", Does::drive},
    {"TrackedVehicle", Does::drive},
    {"JointController", Does::joints},
    {"JointPositionController", Does::joints},
    {"JointTrajectoryController", Does::joints},
    {"ApplyJointForce", Does::joints},
    {"Ros2Control", Does::control},
    {"JointStatePublisher", Does::joints},
    {"Physics", Does::served},
    {"Sensors", Does::served},
    {"SceneBroadcaster", Does::served},
    {"UserCommands", Does::served},
    {"Imu", Does::served},
    {"Contact", Does::served},
    in_model("PosePublisher"),
    in_model("OdometryPublisher"),
    {"LogRecord", Does::dead, "it would record; here --record does"},
    in_model("TrackController"),  // of a TrackedVehicle's tracks
    {"LogPlayback", Does::irrelevant},
    {"LogVideoRecorder", Does::irrelevant},
    {"CameraVideoRecorder", Does::irrelevant},
    {"KineticEnergyMonitor", Does::irrelevant},
    {"SystemMonitor", Does::irrelevant},
    {"EntitySystem", Does::irrelevant},
    {"DynamicDetachableJoint", Does::dead, "joints would come and go"},
    {"Label", Does::served},
    {"ForceTorque", Does::served},
    {"AirPressure", Does::served},
    {"AirSpeed", Does::served},
    {"Altimeter", Does::served},
    {"Magnetometer", Does::served},
    {"NavSat", Does::served},
    {"LogicalCamera", Does::served},
    {"OpticalTactilePlugin", Does::dead, "its tactile sensor would publish"},
    {"DopplerVelocityLogSystem", Does::dead, "its velocity log would publish"},
    {"Thermal", Does::served},
    {"ThermalSensor", Does::served},
    {"WheelSlip", Does::dead, "wheels would slip as it says"},
    {"WindEffects", Does::served},  // read_wind_plugin()
    {"Buoyancy", Does::dead, "things would float"},
    {"BuoyancyEngine", Does::dead, "it would dive and rise"},
    {"Hydrodynamics", Does::dead, "water would slow it"},
    {"LiftDrag", Does::dead, "wings would lift"},
    {"AdvancedLiftDrag", Does::dead, "wings would lift"},
    {"Thruster", Does::dead, "its thrusters would push"},
    {"SpacecraftThrusterModel", Does::dead, "its thrusters would push"},
    {"MulticopterMotorModel", Does::dead, "its rotors would lift it"},
    {"MulticopterVelocityControl", Does::dead, "it would fly by velocity commands"},
    {"LinearBatteryPlugin", Does::dead, "its battery would run down"},
    {"LinearBattery", Does::dead, "its battery would run down"},
    {"Breadcrumbs", Does::dead, "it would drop models"},
    {"TriggeredPublisher", Does::dead, "messages would be answered by messages"},
    in_model("PerformerDetector"),  // sensor_from_plugin()
    in_model("TouchPlugin"),
    in_model("DetachableJoint"),  // read_holds()
    in_model("Elevator"),         // read_lifts()
    {"ApplyLinkWrench", Does::dead, "messages would apply forces"},
    {"FollowActor", Does::dead, "it would follow an actor"},
    {"TrajectoryFollower", Does::dead, "it would follow its waypoints"},
    {"ParticleEmitter", Does::dead, "particles would be seen"},
    {"ParticleEmitter2", Does::dead, "particles would be seen"},
    {"RFComms", Does::dead, "radio would be modelled"},
    {"PerfectComms", Does::dead, "messages would pass between its models"},
    {"AcousticComms", Does::dead, "sound would carry messages"},
    {"CommsEndpoint", Does::dead, "it would take part in modelled radio"},
    {"EnvironmentPreload", Does::dead, "the environment's data would be read"},
    {"EnvironmentalSensor", Does::dead, "it would measure the environment's data"},
    {"DriveToPoseController", Does::dead, "it would drive to commanded poses"},
    {"LighterThanAirDynamics", Does::dead, "air would carry it"},
    {"LogicalAudioSensorPlugin", Does::dead, "microphones would report sounds"},
    {"PythonSystemLoader", Does::dead, "its Python system would run"},
    {"MotorFailureSystem", Does::dead, "a motor would fail on command"},
    {"LensFlare", Does::dead, "pictures would show flares of the lens"},
    {"ShaderParam", Does::dead, "pictures would show its shader"},
    {"ModelPhotoShoot", Does::irrelevant},
    {"Dvl", Does::dead, "its velocity log would publish"},
    {"GravityCompensation", Does::dead, "gravity would be compensated"},
    {"HydrodynamicsPlugin", Does::dead, "water would slow it"},
};

// The plugins of Gazebo Classic and ROS, by library name without "lib" and ".so".
constexpr Known kLibraries[] = {
    {"gazebo_ros_diff_drive", Does::drive},
    {"gazebo_ros_skid_steer_drive", Does::drive},
    {"gazebo_ros_planar_move", Does::drive},
    {"gazebo_ros_mecanum", Does::drive},
    {"gazebo_ros_ackermann_drive", Does::drive},
    {"gazebo_ros_tricycle_drive", Does::drive},
    {"gazebo_ros_force_based_move", Does::drive},
    {"hector_gazebo_ros_force_based_move", Does::drive},
    {"ridgeback_ros_force_based_move", Does::drive},
    {"gazebo_ros_kobuki", Does::drive},
    {"gazebo_ros_create", Does::drive},
    {"DiffDrivePlugin", Does::drive},
    {"SkidSteerDrivePlugin", Does::drive},
    {"SimpleTrackedVehiclePlugin", Does::drive},
    {"WheelTrackedVehiclePlugin", Does::drive},
    {"diffdrive_plugin_6w", Does::drive},
    {"hector_gazebo_ros_diffdrive_6w", Does::drive},
    {"diffdrive_plugin_multi_wheel", Does::drive},
    {"gazebo_ros_control", Does::control},
    {"gazebo_ros2_control", Does::control},
    {"gz_ros2_control-system", Does::control},
    {"ign_ros2_control-system", Does::control},
    {"gz_ros2_control", Does::control},
    {"ign_ros2_control", Does::control},
    {"hwsim", Does::control},
    {"gazebo_ros_joint_state_publisher", Does::joints},
    {"gazebo_ros_joint_pose_trajectory", Does::joints},
    {"gazebo_ros_joint_trajectory", Does::joints},
    {"JointTrajectoryPlugin", Does::joints},
    in_model("gazebo_ros_ray_sensor"),
    in_model("gazebo_ros_laser"),
    in_model("gazebo_ros_gpu_laser"),
    in_model("gazebo_ros_block_laser"),
    in_model("gazebo_ros_velodyne_laser"),
    in_model("gazebo_ros_velodyne_gpu_laser"),
    in_model("gazebo_ros_range"),
    in_model("hector_gazebo_ros_sonar"),
    in_model("gazebo_ros_imu_sensor"),
    in_model("gazebo_ros_camera"),
    in_model("gazebo_ros_triggered_camera"),
    in_model("gazebo_ros_multicamera"),
    in_model("gazebo_ros_depth_camera"),
    in_model("gazebo_ros_openni_kinect"),
    in_model("gazebo_ros_realsense"),
    in_model("realsense_gazebo_plugin"),
    in_model("gazebo_ros_bumper"),
    in_model("gazebo_ros_p3d"),  // sensor_from_plugin()
    {"gazebo_ros_init", Does::served},
    {"gazebo_ros_factory", Does::served},
    {"gazebo_ros_state", Does::served},
    {"gazebo_ros_api_plugin", Does::served},
    in_model("RayPlugin"),
    in_model("GpuRayPlugin"),
    in_model("CameraPlugin"),
    in_model("DepthCameraPlugin"),
    in_model("ImuSensorPlugin"),
    in_model("ContactPlugin"),
    in_model("SonarPlugin"),
    {"gazebo_ros_video", Does::irrelevant},
    {"gazebo_ros_paths_plugin", Does::irrelevant},
    {"HeightmapLODPlugin", Does::irrelevant},
    {"StaticMapPlugin", Does::irrelevant},
    {"SystemGUI", Does::irrelevant},
    in_model("gazebo_ros_imu"),  // sensor_from_plugin()
    in_model("hector_gazebo_ros_imu"),
    in_model("gazebo_ros_gps_sensor"),
    in_model("hector_gazebo_ros_gps"),
    in_model("hector_gazebo_ros_magnetic"),
    in_model("hector_gazebo_ros_baro"),
    in_model("gazebo_ros_ft_sensor"),
    {"gazebo_ros_f3d", Does::dead, "it would publish the forces on a link"},
    {"gazebo_ros_force", Does::dead, "messages would apply forces"},
    {"gazebo_ros_wheel_slip", Does::dead, "wheels would slip as it says"},
    {"WheelSlipPlugin", Does::dead, "wheels would slip as it says"},
    {"WindPlugin", Does::served},
    {"BuoyancyPlugin", Does::dead, "things would float"},
    {"LiftDragPlugin", Does::dead, "wings would lift"},
    {"ActorPlugin", Does::dead, "actors would walk by forces instead of their trajectory"},
    {"ActorCollisionsPlugin", Does::served},
    {"RandomVelocityPlugin", Does::dead, "it would move at random"},
    in_model("ElevatorPlugin"),  // read_lifts()
    {"VacuumGripperPlugin", Does::dead, "a gripper would suck"},
    {"gazebo_ros_vacuum_gripper", Does::dead, "a gripper would suck"},
    {"gazebo_grasp_fix", Does::dead, "grasped objects would stick to the gripper"},
    in_model("gazebo_mimic_joint_plugin"),  // read_mimic_plugin()
    in_model("roboticsgroup_upatras_gazebo_mimic_joint_plugin"),
    in_model("roboticsgroup_gazebo_mimic_joint_plugin"),
    in_model("gazebo_ros_elevator"),
    {"gazebo_ros_projector", Does::dead, "a pattern would be projected"},
    {"gazebo_ros_harness", Does::dead, "a harness would hold it"},
    {"gazebo_ros_light", Does::dead, "lights would go on and off"},
    {"slotcar", Does::drive},
    in_model("door"),  // read_lifts()
    in_model("lift"),
    {"register_component", Does::served},
    {"TeleportDispenserPlugin", Does::dead, "things would be handed to robots"},
    {"TeleportIngestorPlugin", Does::dead, "things would be taken from robots"},
    {"readonly", Does::irrelevant},
    {"toggle_floors", Does::irrelevant},
    {"toggle_charging", Does::irrelevant},
    {"thumbnail_generator", Does::irrelevant},
    {"crowd_simulator", Does::dead, "a crowd would walk; here <ruedo:crowd> does"},
};

bool begins_with(const std::string& text, const std::string& start) {
  return text.rfind(start, 0) == 0;
}
bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// Without the folder, "lib" and ".so".
std::string library_of(const std::string& filename) {
  std::string name = filename.substr(filename.rfind('/') + 1);
  if (const size_t dot = name.find(".so"); dot != std::string::npos) name.erase(dot);
  for (const char* end : {".dylib", ".dll"}) {
    if (ends_with(name, end)) name.erase(name.size() - std::string(end).size());
  }
  return begins_with(name, "lib") ? name.substr(3) : name;
}

// "gz-sim7-diff-drive-system" and "ignition-gazebo-diff-drive-system" to "DiffDrive"; "" for other
// libraries.
std::string system_of(const std::string& library) {
  size_t start = std::string::npos;
  for (const char* prefix : {"gz-sim", "ignition-gazebo", "ign-gazebo"}) {
    if (begins_with(library, prefix)) start = std::string(prefix).size();
  }
  if (start == std::string::npos || !ends_with(library, "-system")) return "";
  while (start < library.size() && std::isdigit(static_cast<unsigned char>(library[start])))
    ++start;
  std::string name;
  bool upper = false;
  for (const char c :
       library.substr(start, library.size() - start - std::string("-system").size())) {
    if (c == '-')
      upper = true;
    else
      name += upper ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c,
          upper = false;
  }
  return name;
}

}  // namespace

PluginKind kind_of(const Element& plugin) {
  const std::string* name = plugin.attribute("name");
  const std::string* filename = plugin.attribute("filename");
  // a user's own: model/own_plugins.h
  if (name && (*name == "ruedo" || begins_with(*name, "ruedo::")))
    return {filename ? *filename : "", Does::served, ""};
  const std::string library = filename ? library_of(*filename) : "";
  std::string system = system_of(library);
  for (const char* space : {"::systems::", "gz_ros2_control::", "ign_ros2_control::"}) {
    const size_t at = name ? name->rfind(space) : std::string::npos;
    if (at == std::string::npos) continue;
    system = std::string(space).find("ros2") != std::string::npos
                 ? "Ros2Control"
                 : name->substr(at + std::string(space).size());
  }
  // Libraries spell the names in their own way ("imu" for Imu, "rf-comms" for RFComms): case is
  // ignored.
  const auto same = [](std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
      return std::tolower(x) == std::tolower(y);
    });
  };
  for (const Known& known : kSystems) {
    if (same(known.name, system))
      return {std::string(known.name), known.does, known.would, known.is_in_model};
  }
  for (const Known& known : kLibraries) {
    if (known.name == library) return {library, known.does, known.would, known.is_in_model};
  }
  return {filename && !filename->empty() ? *filename : "(without a filename)", Does::unknown, ""};
}

void collect_plugins(const Element& element, std::vector<const Element*>& plugins) {
  for (const auto& child : element.children) {
    if (child->name == "plugin")
      plugins.push_back(child.get());
    else if (child->name == "link" || child->name == "sensor" || child->name == "visual" ||
             child->name == "camera") {
      collect_plugins(*child, plugins);
    }
  }
}

}  // namespace ruedo::world
