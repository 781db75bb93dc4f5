// The world as described by its files: immutable once loaded, and shared by all other parts of the
// program.
//
// A Model is what one file describes; a ModelInstance places it. A thousand robots of one kind
// share a Model. Nested models are flattened: their links, joints and sensors have scoped names
// ("arm.wrist"). Frames: W world, M model, L link, J joint, S sensor, C collision, V visual.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ruedo/element.h"
#include "ruedo/index.h"
#include "ruedo/pose.h"
#include "world/model/fault.h"
#include "world/model/mesh.h"

namespace ruedo::world {

enum class Shape { box, sphere, cylinder, capsule, ellipsoid, cone, plane, mesh };

// A shape in its own frame, centred at the origin; cylinder, capsule and cone stand along z (the
// cone's apex up).
struct Geometry {
  Shape shape = Shape::box;
  // box: full lengths; sphere: radius in x; cylinder, cone: radius in x, length in y; capsule:
  // radius in x, length of the cylindrical part in y; ellipsoid: radii; plane: unused. Metres.
  Vec3 size = Vec3::Ones();
  Vec3 normal = Vec3::UnitZ();  // plane only; the plane goes through the origin and is infinite
  Eigen::Vector2d extent{100, 100};  // plane only: the size that is drawn
  std::shared_ptr<const Mesh> mesh;  // mesh only; polylines and heightmaps are meshes too
  // Mesh only: convex pieces, a Mesh::Part each, which replace it in contacts of bodies that
  // move. Null: the convex hulls of its connected parts are near enough, or nothing better is
  // known.
  std::shared_ptr<const Mesh> pieces;
  Vec3 scale = Vec3::Ones();  // mesh only, of its pieces too
};

// Surface properties for contacts and rays.
struct Surface {
  double friction = 1.0;   // Coulomb, SDF's mu
  double friction2 = 1.0;  // in the second direction, SDF's mu2
  Vec3 friction_direction =
      Vec3::Zero();  // direction of `friction` in the collision's frame, SDF's fdir1; zero: none
  double slip = 0.0, slip2 = 0.0;  // m/s per N, along and across, SDF's slip1 and slip2
  double torsional = 0.0;          // friction coefficient against turning on the spot
  double patch_radius =
      0.0;  // m, radius of that friction; 0: from the contact's depth and the surface's radius
  double surface_radius = 0.0;  // m
  double rolling =
      0.0;  // m: rolling resistance moment per newton of load, friction/bullet/rolling_friction
  double stiffness = 0.0, damping = 0.0;  // N/m, N s/m, SDF's kp and kd; 0: rigid
  double restitution = 0.0;
  double laser_reflectance = 1.0;     // ruedo:laser_reflectance, 0 to 1
  double laser_mirror = 0.0;          // fraction of light reflected specularly
  double acoustic_reflectance = 1.0;  // ruedo:acoustic_reflectance, 0 to 1
};

struct Collision {
  std::string name;
  Pose X_LC;
  Geometry geometry;
  Surface surface;
  Source source;
};

struct Visual {
  std::string name;
  Pose X_LV;
  Geometry geometry;
  std::optional<Material> material;  // absent: the mesh's own, or grey
  double transparency = 0.0;         // 0 opaque, 1 invisible
  bool cast_shadows = true;
  // From gz-sim's plugins Label and Thermal in the visual, its link or its model.
  int label = 0;             // 1 to 255: the class in segmentation and bounding-box images; 0: none
  double temperature = 0.0;  // K, as seen by thermal cameras; 0: that of the air
};

struct Light {
  enum class Type { directional, point, spot };
  std::string name;
  Type type = Type::point;
  Pose pose;                        // in the world, or in the link that carries it
  Vec3 direction = -Vec3::UnitZ();  // in the light's frame
  Rgba diffuse{1, 1, 1, 1};
  Rgba specular{0.1f, 0.1f, 0.1f, 1};
  double range = 10.0, constant = 1.0, linear = 0.0, quadratic = 0.0;
  double inner_angle = 0.0, outer_angle = 0.0, falloff = 0.0;  // spot, rad
  double intensity = 1.0;
  bool cast_shadows = false;
};

struct Inertial {
  double mass = 1.0;                                      // kg
  Pose X_LI;                                              // centre of mass and principal axes
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();  // kg m^2, about the centre of mass, in I
};

struct Link {
  std::string name;
  Pose X_ML;
  Inertial inertial;
  bool gravity = true;
  bool wind = false;   // whether the wind pushes it
  bool sleeps = true;  // may be put to sleep when it is at rest: <allow_auto_disable>
  bool kinematic = false;
  std::vector<Collision> collisions;
  std::vector<Visual> visuals;
  std::vector<Light> lights;
  Source source;
};

enum class JointType { fixed, revolute, continuous, prismatic, ball, universal, screw, gearbox };

// Effort from a position or rate error, as in Gazebo's and ROS's controllers.
struct Pid {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double p = 0.0, i = 0.0, d = 0.0;      // per rad, rad s and rad/s, or m
  double i_min = -kNone, i_max = kNone;  // N m or N: limits of the integral part
  double least = -kNone, most = kNone;   // N m or N
  double offset = 0.0;                   // N m or N
};

// The state of a joint before its first command.
struct JointStart {
  enum class Mode { free, stay, position, velocity };  // stay: holds the start position
  Mode mode = Mode::free;
  double value = 0.0;  // rad or m; rad/s or m/s
};

struct JointAxis {
  Vec3 axis_in_J = Vec3::UnitZ();  // unit vector, in the joint's frame (expressed_in is resolved)
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double effort = std::numeric_limits<double>::infinity();
  double velocity = std::numeric_limits<double>::infinity();
  double damping = 0.0, friction = 0.0;
  double spring_stiffness = 0.0, spring_reference = 0.0;  // N m/rad or N/m, and the rest position
  double position_gain = 20.0;  // 1/s: rate per position error under a position command
  // N m s/rad or N s/m: effort per rate error
  double rate_gain = std::numeric_limits<double>::infinity();
  std::optional<Pid> position_pid, rate_pid;  // in place of these gains
  JointStart start;
};

struct Joint {
  std::string name;
  JointType type = JointType::fixed;
  ModelLinkIndex parent;  // none: the world
  ModelLinkIndex child{0};
  Pose X_MJ;              // at the start
  JointAxis axis, axis2;  // axis2: universal and gearbox only
  double advance = 0.0;   // m/rad along the axis: screw only
  // Gearbox only. Relative to the reference (a link; none: the world), the child turns -gear_ratio
  // times the parent's angle: the child about axis2, the parent about axis.
  double gear_ratio = 1.0;
  ModelLinkIndex gear_reference;
  ModelJointIndex leader;  // the joint that this one mimics
  double mimic_multiplier = 1.0, mimic_offset = 0.0,
         mimic_reference = 0.0;  // multiplier (leader - reference) + offset
  Source source;
};

// A sensor in a file, as its element: the sensor's own source file reads it.
struct SensorDescription {
  std::string name;  // device name: unique in its model, usable in channel names
  std::string type;  // SDF's type: "ray", "gpu_lidar", "lidar", "sonar", "camera", "custom", ...
  ModelLinkIndex link{0};
  Pose X_LS;
  std::shared_ptr<const Element> element;
  ModelJointIndex joint;  // the joint that carries it; `link` is then the joint's child
};

// How a robot drives: from <ruedo:drive>, or translated from a Gazebo plugin. See
// docs/world-files.md.
struct DriveDescription {
  enum class Kind { kinematic, wheels };
  // How its wheels constrain it. holonomic: moves in all directions, whatever its wheels (Gazebo's
  // planar move).
  enum class Steering { differential, tracked, ackermann, tricycle, mecanum, omni, holonomic };
  Kind kind = Kind::kinematic;
  Steering steering = Steering::differential;
  bool guessed = false;  // no file describes the drive; the joints look like wheels
  std::vector<ModelJointIndex> left_joints,
      right_joints;  // wheel joints, front first; holonomic and tracked may have none
  // Ackermann, tricycle: vertical joints that carry the steered wheels
  std::vector<ModelJointIndex> steer_joints;
  std::vector<ModelLinkIndex> belts;  // tracked: links whose surface is a belt
  double wheel_radius = 0.0;          // m
  double track = 0.0;                 // m, distance between left and right wheels
  // m. Ackermann, tricycle: from the fixed to the steered axle; mecanum: between the axles
  double wheelbase = 0.0;
  double max_steering_angle = 0.0;  // rad, of a virtual wheel at the centre of the steered axle
  double max_steering_rate = std::numeric_limits<double>::infinity();  // rad/s, of that wheel
  Pose X_MBase;  // base_link: on the ground below the centre of rotation, x forward
  double max_speed = std::numeric_limits<double>::infinity();  // m/s
  // m/s, sideways: mecanum, omni, holonomic
  double max_side_speed = std::numeric_limits<double>::infinity();
  double max_turn_rate = std::numeric_limits<double>::infinity();      // rad/s
  double acceleration = std::numeric_limits<double>::infinity();       // m/s^2
  double deceleration = std::numeric_limits<double>::infinity();       // m/s^2
  double turn_acceleration = std::numeric_limits<double>::infinity();  // rad/s^2
  double max_force = std::numeric_limits<double>::infinity();          // N, of the drive as a whole
  double max_wheel_torque = std::numeric_limits<double>::infinity();   // N m, wheels drive
  double max_wheel_rate = std::numeric_limits<double>::infinity();     // rad/s
  int64_t watchdog_us = 600'000;                                       // 0: off
  // kinematic: where it drives on contacts, its force is limited by the friction under its wheels
  bool traction = true;
  // primitives measure distance by odometry; always so with the wheels drive
  bool on_odometry = false;
  // Relative errors in the robot's own idea of its geometry: those of <ruedo:odometry>.
  double radius_error[2] = {0.0, 0.0}, track_error = 0.0;  // left, right
  // wheels: the servo on each wheel's encoder, and the motor's parameters at the motor shaft.
  double servo_rate_gain = 0.0;   // N m s/rad at the wheel; 0: derived from the robot's mass
  double servo_angle_gain = 0.0;  // N m/rad at the wheel; 0: derived from the rate gain
  double gear = 1.0;              // motor turns per wheel turn
  double stall_torque = std::numeric_limits<double>::infinity();  // N m
  double no_load_rate = std::numeric_limits<double>::infinity();  // rad/s
  double yaw_gain = 0.0;  // 1/s: gain of the heading hold on its gyro; 0: off
  double gyro_bias = 0.0, gyro_scale_error = 0.0;  // rad/s; relative
  Rate odometry_rate{50, 1}, pose_rate{50, 1}, status_rate{10, 1};
  std::shared_ptr<const Element> element;  // <ruedo:drive> or <plugin>; null if synthesised
  std::shared_ptr<const Element>
      odometry;  // <ruedo:odometry>; null: ideal encoders, arc integrator
};

// A detachable joint: holds a link of another model until a command releases it.
struct Hold {
  std::string name;
  ModelLinkIndex link;
  std::string other_model, other_link;  // "" for the model itself
  Source source;
};

// How a door or cabin moves if its joint has no controller: a trapezoidal velocity profile.
struct Trapezoid {
  double rate = 0.2;           // m/s or rad/s
  double acceleration = 0.08;  // m/s^2 or rad/s^2
  double effort = 100.0;       // N or N m
};

// A door: opens and closes on command, by its name.
struct Door {
  struct Leaf {
    std::string joint_name;
    ModelJointIndex joint;  // none: missing in the model
    double closed = 0.0, open = 0.0;
    bool left = false;  // RMF: closed at its upper limit
  };
  std::string name;
  std::vector<Leaf> leaves;
  std::optional<Trapezoid> motion;  // none: the controllers of its joints move it
  Source source;
};

// A lift: goes to the floors it is called to, opens the doors there, waits, and closes them.
struct Lift {
  struct Floor {
    double position = 0.0;  // position of the cabin's joint, m
    // of the model; names that it does not have belong to other models
    std::vector<std::string> doors;
  };
  std::string name;  // name of the cabin's joint
  ModelJointIndex cabin;
  std::vector<Floor> floors;
  std::optional<int> initial_floor;  // none: stays where it is
  std::optional<int64_t> wait_us;    // none: the doors stay open until the next call
  std::optional<Trapezoid> motion;   // none: the controller of its joint moves it
  Source source;
};

struct Model {
  std::string name;  // as in the file
  // In the file, or because all its parts are static, or an actor without a trajectory. Not a model
  // that a joint fixes to the world.
  bool is_static = false;
  bool self_collide = false;
  IndexedVector<ModelLinkIndex, Link> links;  // links[0] is the canonical link, or the first
  IndexedVector<ModelJointIndex, Joint> joints;
  std::vector<SensorDescription> sensors;
  std::optional<DriveDescription> drive;
  bool guess = true;  // a drive that no file describes, from the wheels
  bool commanded =
      false;  // its joints take commands, which makes even an arm without sensors a robot
  std::shared_ptr<const Element> path;  // <ruedo:path> or an actor's trajectory; null: none
  std::vector<Hold> holds;
  std::vector<Door> doors;
  std::vector<Lift> lifts;
  Source source;
};

struct ModelInstance {
  std::string name;  // unique in the world, usable in channel names
  Pose X_WM;
  std::shared_ptr<const Model> model;
  // while the world runs: keeps its place in all lists, but is not in the world
  bool removed = false;
  bool is_robot() const {
    return model->drive.has_value() || !model->sensors.empty() || model->commanded;
  }
};

struct Sky {
  Rgba ambient{0.4f, 0.4f, 0.4f, 1};
  Rgba background{0.7f, 0.7f, 0.7f, 1};
  bool sky = false;  // a gradient and a horizon instead of the background colour
  bool shadows = true;
};

// <physics><bullet>: parameters of the contact and joint solver.
struct SolverDescription {
  int iterations = 500;          // maximum number of sweeps
  double tolerance = 1e-5;       // m/s: stops when a sweep changes no velocity by more
  double error_reduction = 0.2;  // fraction of a penetration or joint error that a substep corrects
  int substeps =
      0;  // of a step, for all bodies; 0: enough for substeps of 5 ms, of 1 ms where joints are
};

// <wind>, and the parameters of the plugin WindEffects: robot/wind.h.
struct Wind {
  struct Noise {
    double mean = 0.0, stddev = 0.0;
  };
  Vec3 velocity = Vec3::Zero();  // m/s, in the world's axes
  bool pushes = false;           // the plugin is there: links with <enable_wind> are pushed
  double gain = 1.0;             // 1/s: the force is gain mass (wind - velocity of the link)
  double rise_s = 0.0, vertical_rise_s = 0.0;     // time constants
  double swing = 0.0, swing_period_s = 1.0;       // variation of the speed, relative
  double turn_rad = 0.0, turn_period_s = 1.0;     // variation of the direction
  Noise speed_noise, turn_noise, vertical_noise;  // m/s, rad, m/s
};

// The world's location and environment: <spherical_coordinates>, <atmosphere>, <wind> and
// <magnetic_field>.
struct Environment {
  bool placed = false;                                        // the file gives a location
  double equatorial_radius = 6378137.0;                       // m, WGS 84
  double polar_radius = 6378137.0 * (1 - 1 / 298.257223563);  // m
  double latitude = 0.0, longitude = 0.0;                     // rad, of the world's origin
  double elevation = 0.0;                                     // m above the ellipsoid
  double heading = 0.0;                   // rad, counter-clockwise from east to the world's x axis
  double temperature = 288.15;            // K, at sea level
  double temperature_gradient = -0.0065;  // K/m
  double pressure = 101325.0;             // Pa, at sea level
  Wind wind;
  // T, in the world's axes; empty: the earth's dipole field where the world has a location, else
  // SDF's default
  std::optional<Vec3> magnetic_field;
};

struct WorldModel {
  std::string name;
  std::string file;
  int64_t step_us = 5000;
  Vec3 gravity{0, 0, -9.8};
  Environment environment;
  SolverDescription solver;
  Sky sky;
  std::optional<Pose> viewpoint;  // the file's own camera: x ahead, z up
  std::vector<Light> lights;
  // in file order, followed by those of --spawn
  IndexedVector<InstanceIndex, ModelInstance> models;
  std::vector<Finding> findings;        // what is unsupported or was repaired
  std::vector<std::string> files_read;  // absolute paths, in the order of first reading
  std::vector<std::string>
      disabled;               // "ROBOT/odometry", ...: a robot's own channels that are switched off
  std::vector<Fault> faults;  // each names a robot of the world
};

}  // namespace ruedo::world
