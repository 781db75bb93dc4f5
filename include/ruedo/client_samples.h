/// @file
// What Ruedo's client for C++ delivers and throws: samples and errors. ruedo/client.h includes it.
//
// SI units, radians; x ahead, y left, z up; quaternions w, x, y, z. utime is sim time in
// microseconds.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <ostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace ruedo::client {

/// A span of time: any of std::chrono's, or a number of seconds. kForever has no end.
class Duration : public std::chrono::duration<double> {
 public:
  /// @param seconds may be kForever
  constexpr Duration(double seconds)
      : std::chrono::duration<double>(seconds) {}  // NOLINT: both are meant to convert
  /// @param time of std::chrono
  template <class Rep, class Period>
  constexpr Duration(std::chrono::duration<Rep, Period> time)
      : std::chrono::duration<double>(time) {}  // NOLINT
};

inline constexpr double kForever = std::numeric_limits<double>::infinity();  ///< s
inline constexpr double kFast =
    std::numeric_limits<double>::infinity();  ///< a rate: as fast as it goes

using Vector3 = std::array<double, 3>;     ///< x, y, z
using Quaternion = std::array<double, 4>;  ///< w, x, y, z

// ---- What a robot executes.

/// What a command asks for. heading: turn to a heading in odom; velocity and wheels are no
/// primitives.
enum class MotionKind : int8_t {
  none = 0,
  advance = 1,
  rotate = 2,
  heading = 3,
  arc = 4,
  stop = 5,
  velocity = 16,
  wheels = 17,
  unknown = 127
};
/// sent: no status has shown it yet; ended: before it was done, its reason says why.
enum class MotionState : int8_t {
  idle = 0,
  running = 1,
  done = 2,
  ended = 3,
  refused = 4,
  sent = 64,
  unknown = 127
};
/// removed: the robot is gone; new_run: the server was restarted; lost: no status has shown the
/// primitive, though others came.
enum class MotionReason : int8_t {
  none = 0,
  replaced = 1,
  blocked = 2,
  watchdog = 3,
  not_finite = 4,
  bad_kind = 5,
  bad_value = 6,
  no_drive = 7,
  not_possible = 8,
  removed = 64,
  new_run = 65,
  lost = 66,
  unknown = 127
};
/// How the server answers a request, as in reply_t.
enum class ReplyCode : int32_t {
  ok = 0,
  bad_request = 1,
  unknown_name = 2,
  refused = 3,
  wrong_run = 4,
  wrong_epoch = 5,
  old_sequence = 6,
  unknown_session = 7,
  not_supported = 8,
  ended = 9
};

/// @param kind of a motion
/// @return the word that messages use: "advance"
[[nodiscard]] const char* to_string(MotionKind kind);
/// @param state of a motion
/// @return the word that messages use: "running"
[[nodiscard]] const char* to_string(MotionState state);
/// @param reason of an end
/// @return the words that messages use: "not finite"; "" for MotionReason::none
[[nodiscard]] const char* to_string(MotionReason reason);
/// @cond
inline std::ostream& operator<<(std::ostream& out, MotionKind kind) {
  return out << to_string(kind);
}
inline std::ostream& operator<<(std::ostream& out, MotionState state) {
  return out << to_string(state);
}
inline std::ostream& operator<<(std::ostream& out, MotionReason reason) {
  return out << to_string(reason);
}

/// @endcond

// ---- What can go wrong. Bad arguments (NaN, a radius of 0) are std::invalid_argument.

/// Whatever else can go wrong; the text says what.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// None answered, it fell silent or ended, or the Simulation was closed.
struct NoServer : Error {
  using Error::Error;
};
/// The run is over: its server has said so, or ended with exit code 0.
struct RunEnded : NoServer {
  using NoServer::NoServer;
};
/// A private server could not be started.
struct LaunchError : Error {
  using Error::Error;
};
/// The text lists the names that exist.
struct UnknownName : Error {
  using Error::Error;
};
/// Nothing came within the time that was given.
struct Timeout : Error {
  using Error::Error;
};
/// A channel carries another version of a type.
struct TypeMismatch : Error {
  using Error::Error;
};
/// The server or the robot cannot do that.
struct NotSupported : Error {
  using Error::Error;
};
/// A primitive ended early or was refused.
struct MotionError : Error {
  /// @cond
  MotionError(const std::string& text, MotionReason why) : Error(text), reason(why) {}
  /// @endcond
  MotionReason reason;  ///< why
};
/// The server refused a request.
struct RequestError : Error {
  /// @cond
  RequestError(const std::string& text, ReplyCode reply_code) : Error(text), code(reply_code) {}
  /// @endcond
  ReplyCode code;  ///< why
};
/// Lockstep goes on without this client, which was silent too long; the next step() takes part
/// again.
struct LeaseLost : RequestError {
  using RequestError::RequestError;
};

// ---- Samples.

/// What all samples have.
struct Sample {
  int64_t utime = 0;  ///< us, sim time of the state shown
  /// @return the same in s
  double time() const { return static_cast<double>(utime) * 1e-6; }
};

/// A scan of a planar laser range finder, in the device's frame.
struct Scan : Sample {
  std::vector<float> ranges;       ///< m; +inf: no return, -inf: nearer than the minimum range
  std::vector<float> intensities;  ///< 0 to 1; empty when the device has none
  double angle_min = 0.0;          ///< rad, of ray 0, from the device's x axis towards y (left)
  double angle_step = 0.0;         ///< rad
  /// @param ray from 0 on
  /// @return rad, from the device's x axis towards y (left)
  double angle(size_t ray) const { return angle_min + angle_step * static_cast<double>(ray); }
  /// @param from_angle rad
  /// @param to_angle rad
  /// @return the smallest range between the two, m; +inf when nothing is there
  [[nodiscard]] double nearest(double from_angle, double to_angle) const;
};

/// A scan of a laser scanner with several layers: element layer * columns + column.
struct LidarScan : Sample {
  int layers = 0;                  ///< of rays
  int columns = 0;                 ///< rays in a layer
  std::vector<float> ranges;       ///< m, lowest layer first; as in Scan
  std::vector<float> intensities;  ///< 0 to 1, or empty
  double azimuth_min = 0.0;        ///< rad, of the first column; left is positive
  double azimuth_step = 0.0;       ///< rad from column to column
  double elevation_min = 0.0;      ///< rad, of the lowest layer; up is positive
  double elevation_step = 0.0;     ///< rad from layer to layer
};

/// The last reading of each of an array's transducers; their poses are DeviceInfo::elements.
struct SonarReading : Sample {
  std::vector<float> ranges;  ///< m from the transducer's face; without an echo: the maximum range
  std::vector<int64_t> fired_utime;  ///< us, when each fired last; -1: not yet
  std::vector<bool> fresh;           ///< true where the reading is of this very message
};

/// What the robot believes of its motion from its wheels; pose of base_link in the frame odom.
struct Odometry : Sample {
  double x = 0.0;      ///< m
  double y = 0.0;      ///< m
  double theta = 0.0;  ///< rad, not wrapped
  double v = 0.0;      ///< m/s
  double omega = 0.0;  ///< rad/s
  std::vector<double>
      wheel_angles;  ///< rad since the start, positive ahead; order of RobotInfo::wheels
  std::vector<double> wheel_rates;  ///< rad/s
  std::vector<int64_t> ticks;       ///< encoder counts
  int32_t resets = 0;               ///< how often the pose was reset
};

/// What the robot believes of its velocity from its wheels, in base_link; comes with each Odometry.
struct OdometryTwist : Sample {
  double vx = 0.0;                     ///< m/s, ahead
  double vy = 0.0;                     ///< m/s, to the left
  double omega = 0.0;                  ///< rad/s
  std::array<double, 9> covariance{};  ///< of (vx, vy, omega), by rows; 0: ideal encoders
};

/// The true pose of base_link in the world; velocities are expressed in base_link.
struct Pose : Sample {
  Vector3 position{};                       ///< m
  Quaternion orientation{};                 ///< to world
  Vector3 velocity{};                       ///< m/s
  Vector3 rotation_rate{};                  ///< rad/s
  Vector3 acceleration{};                   ///< m/s^2, without gravity
  double x() const { return position[0]; }  ///< @return m
  double y() const { return position[1]; }  ///< @return m
  double heading() const;  ///< @return rad, counter-clockwise from the world's x axis, in (-pi, pi]
};

/// A picture of a camera.
struct Image : Sample {
  /// How `data` has it.
  enum class Format { unknown, jpeg, rgb, bgr, gray, gray16, float32 };
  int width = 0;                    ///< pixels
  int height = 0;                   ///< pixels
  Format format = Format::unknown;  ///< gray16: labels (body index + 1); float32: depth, m, +inf:
                                    ///< nothing, -inf: nearer than the camera sees
  int row_stride = 0;               ///< bytes in a row, 0 for jpeg
  std::vector<uint8_t> data;        ///< as they came: rows from the top, or a JPEG file
  /// Writes a JPEG's bytes as they are, rgb, bgr and gray as PPM or PGM.
  /// @param path of the file
  /// @throws Error for another format, and for what cannot be written
  void save(const std::string& path) const;
};

/// A pinhole with OpenCV's distortion.
struct CameraInfo : Sample {
  int width = 0;                       ///< pixels
  int height = 0;                      ///< pixels
  double fx = 0.0;                     ///< focal length along a row, pixels
  double fy = 0.0;                     ///< focal length along a column, pixels
  double cx = 0.0;                     ///< principal point along a row, pixels
  double cy = 0.0;                     ///< principal point along a column, pixels
  std::array<double, 5> distortion{};  ///< k1, k2, p1, p2, k3
};

/// An inertial unit, in its own frame.
struct Imu : Sample {
  Quaternion orientation{};       ///< device to world
  Vector3 angular_velocity{};     ///< rad/s
  Vector3 linear_acceleration{};  ///< m/s^2, specific force: at rest gravity upwards
};

/// Satellite navigation (GPS).
struct NavSat : Sample {
  double latitude_deg = 0.0;   ///< degrees, north is positive
  double longitude_deg = 0.0;  ///< degrees, east is positive
  double altitude = 0.0;       ///< m above the ellipsoid
  Vector3 velocity{};          ///< m/s, to the east, to the north, upwards
};

/// The magnetic field.
struct Magnetometer : Sample {
  Vector3 field{};  ///< T, in the device's frame
};

/// Height over the start.
struct Altimeter : Sample {
  double altitude = 0.0;  ///< m above where the device was at the start
  double velocity = 0.0;  ///< m/s, upwards
};

/// A barometer.
struct AirPressure : Sample {
  double pressure = 0.0;  ///< Pa
};

/// A Pitot tube along the device's x axis.
struct AirSpeed : Sample {
  double differential_pressure = 0.0;  ///< Pa, total less static; negative: from behind
  double temperature = 0.0;            ///< K, of the air
};

/// In a joint: what the child puts on the parent, unless the world file says otherwise.
struct ForceTorque : Sample {
  Vector3 force{};   ///< N
  Vector3 torque{};  ///< N m, about the joint's origin
};

/// A model that a logical camera sees, in the device's frame.
struct LogicalObject {
  std::string model;         ///< its name
  Vector3 position{};        ///< m
  Quaternion orientation{};  ///< model to device
};
/// What a logical camera sees.
struct LogicalCamera : Sample {
  std::vector<LogicalObject> objects;  ///< in the world's order
};

/// A labelled object in a picture; whole numbers are the middles of pixels.
struct Box2D {
  int label = 0;        ///< as the world file has it
  std::string name;     ///< of the model
  double x = 0.0;       ///< of the middle, pixels from the left
  double y = 0.0;       ///< of the middle, pixels from the top
  double width = 0.0;   ///< pixels
  double height = 0.0;  ///< pixels
};
/// The labelled objects in a picture.
struct Boxes2D : Sample {
  int width = 0;             ///< of the picture, pixels
  int height = 0;            ///< of the picture, pixels
  std::vector<Box2D> boxes;  ///< one each
};

/// A labelled object before the camera, in the device's frame.
struct Box3D {
  int label = 0;             ///< as the world file has it
  std::string name;          ///< of the model
  Vector3 center{};          ///< m
  Quaternion orientation{};  ///< box to device
  Vector3 size{};            ///< m, full lengths
};
/// The labelled objects before a camera.
struct Boxes3D : Sample {
  std::vector<Box3D> boxes;  ///< one each
};

/// Where two bodies touch.
struct ContactPoint {
  std::string body;    ///< the other body
  Vector3 position{};  ///< m, world
  Vector3 normal{};    ///< unit vector, world, towards the sensor's body
  double force = 0.0;  ///< N
  double depth = 0.0;  ///< m
};
/// A bumper.
struct Contact : Sample {
  bool pressed = false;              ///< something is touched
  std::vector<ContactPoint> points;  ///< where
};

/// What a robot runs into: with what neither carries it nor lies on it.
struct Collisions : Sample {
  std::string blocked_by;            ///< the body that blocks what it was told to do; "": nothing
  std::vector<ContactPoint> points;  ///< empty: nothing is touched
};

/// A robot's joints, in the order of the names.
struct Joints : Sample {
  std::vector<std::string> names;  ///< as the file has them
  std::vector<float> positions;    ///< rad, or m
  std::vector<float> velocities;   ///< rad/s, or m/s
  std::vector<float> efforts;      ///< N m, or N
};

/// What a robot is executing.
struct MotionStatus : Sample {
  int64_t id = 0;                         ///< of the primitive; 0 for velocity and wheel commands
  MotionKind kind = MotionKind::none;     ///< what it was told
  MotionState state = MotionState::idle;  ///< how far it is
  MotionReason reason = MotionReason::none;  ///< why it ended or was refused
  double progress = 0.0;                     ///< done, m or rad
  double remaining = 0.0;                    ///< m or rad
  double v = 0.0;                            ///< m/s
  double omega = 0.0;                        ///< rad/s
};

/// A message of any type, as it came.
struct RawSample : Sample {    // utime: where the type's first field is one; else 0
  std::vector<uint8_t> bytes;  ///< LCM's encoding, its fingerprint first
};

}  // namespace ruedo::client
