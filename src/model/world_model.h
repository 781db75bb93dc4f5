// The world as the files describe it: immutable once loaded, shared by every other part of the
// program.
//
// A Model is what one file says; a ModelInstance places it. A thousand robots of one kind share one
// Model. Nested models are flattened: their links, joints and sensors carry the scoped name
// ("arm.wrist"). Frames: W world, M model, L link, J joint, S sensor, C collision, V visual.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/fault.h"
#include "model/mesh.h"
#include "ruedo/element.h"
#include "ruedo/index.h"
#include "ruedo/pose.h"

namespace ruedo::model {

enum class Shape { box, sphere, cylinder, capsule, ellipsoid, cone, plane, mesh };

// A shape in its own frame, centred at the origin; cylinder, capsule and cone stand along z (the
// cone's apex up).
struct Geometry {
  Shape shape = Shape::box;
  // box: full lengths; sphere: radius in x; cylinder, cone: radius in x, length in y; capsule:
  // radius in x, length of the cylindrical part in y; ellipsoid: radii; plane: unused. Metres.
  Vec3 size = Vec3::Ones();
  Vec3 normal = Vec3::UnitZ();  // plane only; the plane goes through the origin and is infinite
  Eigen::Vector2d extent{100, 100};  // plane only: how much of it is drawn
  std::shared_ptr<const Mesh> mesh;  // mesh only; polylines and heightmaps are meshes too
  Vec3 scale = Vec3::Ones();         // mesh only
};

// What contact and rays need to know of a surface.
struct Surface {
  double friction = 1.0;   // Coulomb, SDF's mu
  double friction2 = 1.0;  // across, SDF's mu2
  Vec3 friction_direction =
      Vec3::Zero();  // of `friction`, in the collision's frame, SDF's fdir1; zero: none
  double slip = 0.0, slip2 = 0.0;  // m/s per N, along and across, SDF's slip1 and slip2
  double torsional = 0.0;          // coefficient of the friction that turning on the spot meets
  double patch_radius =
      0.0;  // m, of that; 0: from the depth of the contact and the surface's radius
  double surface_radius = 0.0;  // m
  double rolling =
      0.0;  // m: moment that rolling meets for a newton of load, friction/bullet/rolling_friction
  double stiffness = 0.0, damping = 0.0;  // N/m, N s/m, SDF's kp and kd; 0: rigid
  double restitution = 0.0;
  double laser_reflectance = 1.0;     // ruedo:laser_reflectance, 0 to 1
  double laser_mirror = 0.0;          // part of the light that leaves like from a mirror
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
  // Of gz-sim's plugins Label and Thermal, in the visual, its link or its model.
  int label = 0;             // 1 to 255: the class that segmentation and boxes show; 0: none
  double temperature = 0.0;  // K, what thermal cameras see; 0: that of the air
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
  Pose X_LI;                                              // centre of mass, axes of the moments
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();  // kg m^2, about the centre of mass, in I
};

struct Link {
  std::string name;
  Pose X_ML;
  Inertial inertial;
  bool gravity = true;
  bool wind = false;  // feels it
  bool kinematic = false;
  std::vector<Collision> collisions;
  std::vector<Visual> visuals;
  std::vector<Light> lights;
  Source source;
};

enum class JointType { fixed, revolute, continuous, prismatic, ball, universal, screw, gearbox };

// Effort for what is missing of a position or a rate, as the controllers of Gazebo and ROS give it.
struct Pid {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double p = 0.0, i = 0.0, d = 0.0;      // per rad, rad s and rad/s, or m
  double i_min = -kNone, i_max = kNone;  // N m or N: of the integral's part
  double least = -kNone, most = kNone;   // N m or N
  double offset = 0.0;                   // N m or N
};

// What a joint does until it is told something.
struct JointStart {
  enum class Mode { free, stay, position, velocity };  // stay: where it begins
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
  double spring_stiffness = 0.0, spring_reference = 0.0;  // N m/rad or N/m, towards that position
  double position_gain = 20.0;  // 1/s: rate for what is missing of a position that it was told
  double rate_gain = std::numeric_limits<double>::infinity();  // N m s/rad or N s/m: effort for
                                                               // what is missing of a rate
  std::optional<Pid> position_pid, rate_pid;                   // in place of these gains
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
  // Gearbox only: against the reference (a link; none: the world) the child turns -gear_ratio times
  // as far about axis2 as the parent does about axis.
  double gear_ratio = 1.0;
  ModelLinkIndex gear_reference;
  ModelJointIndex leader;  // the one that this one mimics
  double mimic_multiplier = 1.0, mimic_offset = 0.0,
         mimic_reference = 0.0;  // multiplier (leader - reference) + offset
  Source source;
};

// A sensor of a file, still as its element: the sensor's own source file reads it.
struct SensorDescription {
  std::string name;  // the device's name: unique in its model, fit for a channel
  std::string type;  // SDF's type: "ray", "gpu_lidar", "lidar", "sonar", "camera", "custom", ...
  ModelLinkIndex link{0};
  Pose X_LS;
  std::shared_ptr<const Element> element;
  ModelJointIndex joint;  // the one that carries it; link is then its child
};

// How a robot drives: read from <ruedo:drive>, or mapped from a Gazebo plugin. See
// docs/world-files.md.
struct DriveDescription {
  enum class Kind { kinematic, wheels };
  // How its wheels let it move. holonomic: in every direction, whatever its wheels are (Gazebo's
  // planar move).
  enum class Steering { differential, tracked, ackermann, tricycle, mecanum, omni, holonomic };
  Kind kind = Kind::kinematic;
  Steering steering = Steering::differential;
  bool guessed = false;  // no file says how the robot drives; its joints look like wheels
  std::vector<ModelJointIndex> left_joints,
      right_joints;  // wheel joints, front first; holonomic and tracked may have none
  std::vector<ModelJointIndex> steer_joints;  // Ackermann, tricycle: turn about the vertical, with
                                              // the wheels that hang on them
  std::vector<ModelLinkIndex> belts;          // tracked: links whose surface is a belt
  double wheel_radius = 0.0;                  // m
  double track = 0.0;                         // m, between the left and right wheels
  double wheelbase = 0.0;  // m: Ackermann, tricycle: from the fixed axle to the steered one;
                           // mecanum: between the axles
  double max_steering_angle = 0.0;  // rad, of a wheel in the middle of the steered axle
  double max_steering_rate = std::numeric_limits<double>::infinity();  // rad/s, of that wheel
  Pose X_MBase;  // base_link: on the ground below the centre of rotation, x ahead
  double max_speed = std::numeric_limits<double>::infinity();          // m/s
  double max_side_speed = std::numeric_limits<double>::infinity();     // m/s to the left or right:
                                                                       // mecanum, omni, holonomic
  double max_turn_rate = std::numeric_limits<double>::infinity();      // rad/s
  double acceleration = std::numeric_limits<double>::infinity();       // m/s^2
  double deceleration = std::numeric_limits<double>::infinity();       // m/s^2
  double turn_acceleration = std::numeric_limits<double>::infinity();  // rad/s^2
  double max_force = std::numeric_limits<double>::infinity();          // N, of the drive as a whole
  double max_wheel_torque = std::numeric_limits<double>::infinity();   // N m, wheels drive
  double max_wheel_rate = std::numeric_limits<double>::infinity();     // rad/s
  int64_t watchdog_us = 600'000;                                       // 0: off
  bool traction = true;  // kinematic: no more force than friction under its wheels gives, where it
                         // drives on contacts
  bool on_odometry = false;  // primitives measure their way by the odometry; wheels: always
  // What the robot believes of itself is off by these parts: <ruedo:odometry>'s errors.
  double radius_error[2] = {0.0, 0.0}, track_error = 0.0;  // left, right
  // wheels: the servo of each wheel's encoder, and its motor, at the motor's shaft.
  double servo_rate_gain = 0.0;   // N m s/rad at the wheel; 0: from the robot's mass
  double servo_angle_gain = 0.0;  // N m/rad at the wheel; 0: from the gain of the rate
  double gear = 1.0;              // turns of the motor for one of the wheel
  double stall_torque = std::numeric_limits<double>::infinity();  // N m
  double no_load_rate = std::numeric_limits<double>::infinity();  // rad/s
  double yaw_gain = 0.0;  // 1/s: turns the robot back to the heading of its gyro; 0: off
  double gyro_bias = 0.0, gyro_scale_error = 0.0;  // rad/s; relative
  Rate odometry_rate{50, 1}, pose_rate{50, 1}, status_rate{10, 1};
  std::shared_ptr<const Element> element;  // <ruedo:drive> or <plugin>; null when synthesised
  std::shared_ptr<const Element>
      odometry;  // <ruedo:odometry>; null: ideal encoders, arc integrator
};

// A detachable joint: holds a link of another model until it is told to let go.
struct Hold {
  std::string name;
  ModelLinkIndex link;
  std::string other_model, other_link;  // "" for the model itself
  Source source;
};

// How a door or a cabin moves whose joint has no controller of its own: a trapezoid of the rate.
struct Trapezoid {
  double rate = 0.2;           // m/s or rad/s
  double acceleration = 0.08;  // m/s^2 or rad/s^2
  double effort = 100.0;       // N or N m
};

// Opens and closes when it is told, by its name.
struct Door {
  struct Leaf {
    std::string joint_name;
    ModelJointIndex joint;  // none: the model does not have it
    double closed = 0.0, open = 0.0;
    bool left = false;  // of RMF: closed at its upper stop
  };
  std::string name;
  std::vector<Leaf> leaves;
  std::optional<Trapezoid> motion;  // none: the controllers of its joints move it
  Source source;
};

// Goes to the floors that it is called to, opens the doors there, waits and closes them.
struct Lift {
  struct Floor {
    double position = 0.0;           // of the cabin's joint
    std::vector<std::string> doors;  // of the model, or where it has none of that name, of others
  };
  std::string name;  // of the cabin's joint
  ModelJointIndex cabin;
  std::vector<Floor> floors;
  int initial_floor = -1;           // -1: it stays where it is
  std::optional<int64_t> wait_us;   // none: until the next call
  std::optional<Trapezoid> motion;  // none: the controller of its joint moves it
  Source source;
};

struct Model {
  std::string name;  // as the file says
  // By the file, or because all its parts are, or an actor without a trajectory. A model that a
  // joint holds to the world is not.
  bool is_static = false;
  bool self_collide = false;
  IndexedVector<ModelLinkIndex, Link> links;  // links[0] is the canonical link, or the first
  IndexedVector<ModelJointIndex, Joint> joints;
  std::vector<SensorDescription> sensors;
  std::optional<DriveDescription> drive;
  bool commanded =
      false;  // its joints take commands, which makes a robot of an arm without sensors
  std::shared_ptr<const Element> path;  // <ruedo:path> or an actor's trajectory; null: none
  std::vector<Hold> holds;
  std::vector<Door> doors;
  std::vector<Lift> lifts;
  Source source;
};

struct ModelInstance {
  std::string name;  // unique in the world, fit for a channel
  Pose X_WM;
  std::shared_ptr<const Model> model;
  bool removed = false;  // while the world runs: its place in all lists stays, and it is nowhere
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

// <physics><bullet>: how contacts and joints are solved.
struct SolverDescription {
  int iterations = 500;     // sweeps at most
  double tolerance = 1e-5;  // m/s: a sweep that changes no velocity by more is the last one
  double error_reduction =
      0.2;  // part of a penetration or of a joint's error that a substep undoes
  int substeps =
      0;  // of a step, for everything; 0: as many as steps of 5 ms take, of 1 ms where joints are
};

// <wind>, and what the plugin WindEffects makes of it: robot/wind.h.
struct Wind {
  struct Noise {
    double mean = 0.0, stddev = 0.0;
  };
  Vec3 velocity = Vec3::Zero();  // m/s, in the world's axes
  bool pushes = false;           // there is the plugin: links with <enable_wind> feel it
  double gain = 1.0;             // 1/s: the force is gain mass (wind - velocity of the link)
  double rise_s = 0.0, vertical_rise_s = 0.0;     // time constants
  double swing = 0.0, swing_period_s = 1.0;       // of the speed: a part of it
  double turn_rad = 0.0, turn_period_s = 1.0;     // of the direction
  Noise speed_noise, turn_noise, vertical_noise;  // m/s, rad, m/s
};

// Where the world lies, and what surrounds it: <spherical_coordinates>, <atmosphere>, <wind> and
// <magnetic_field>.
struct Environment {
  bool placed = false;                                        // the file says where
  double equatorial_radius = 6378137.0;                       // m, WGS 84
  double polar_radius = 6378137.0 * (1 - 1 / 298.257223563);  // m
  double latitude = 0.0, longitude = 0.0;                     // rad, of the world's origin
  double elevation = 0.0;                                     // m above the ellipsoid
  double heading = 0.0;                   // rad from east to the world's x axis, towards north
  double temperature = 288.15;            // K, at sea level
  double temperature_gradient = -0.0065;  // K/m
  double pressure = 101325.0;             // Pa, at sea level
  Wind wind;
  std::optional<Vec3> magnetic_field;  // T, in the world's axes; empty: the earth's dipole where
                                       // the world is placed, else SDF's default
};

struct WorldModel {
  std::string name;
  std::string file;
  int64_t step_us = 5000;
  Vec3 gravity{0, 0, -9.8};
  Environment environment;
  SolverDescription solver;
  Sky sky;
  std::vector<Light> lights;
  IndexedVector<InstanceIndex, ModelInstance> models;  // in file order; --spawn's after them
  std::vector<Finding> findings;                       // what was unsupported or repaired
  std::vector<std::string> files_read;  // absolute paths, in the order of first reading
  std::vector<std::string>
      disabled;  // "ROBOT/odometry", ...: channels of a robot itself that are switched off
  std::vector<Fault> faults;  // each names a robot of the world
};

}  // namespace ruedo::model
