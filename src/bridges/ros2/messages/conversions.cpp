// REP-103 (units, optical frames), 105 (frames), 117 (ranges without return), 145 (IMU).
// Unknown covariances are 0, as sensor_msgs defines; what is not measured at all has -1 in
// its first element.
#include "bridges/ros2/messages/conversions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "bridges/ros2/messages/markers.h"
#include "bridges/ros2/messages/pictures.h"
#include "ruedo/air_pressure_t.hpp"
#include "ruedo/air_speed_t.hpp"
#include "ruedo/altimeter_t.hpp"
#include "ruedo/boxes_2d_t.hpp"
#include "ruedo/boxes_3d_t.hpp"
#include "ruedo/camera_info_t.hpp"
#include "ruedo/collisions_t.hpp"
#include "ruedo/contact_t.hpp"
#include "ruedo/decode.h"
#include "ruedo/force_torque_t.hpp"
#include "ruedo/image_t.hpp"
#include "ruedo/imu_t.hpp"
#include "ruedo/joint_state_t.hpp"
#include "ruedo/lidar_t.hpp"
#include "ruedo/logical_camera_t.hpp"
#include "ruedo/magnetometer_t.hpp"
#include "ruedo/math.h"
#include "ruedo/navsat_t.hpp"
#include "ruedo/odometry_t.hpp"
#include "ruedo/odometry_twist_t.hpp"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/pose.h"
#include "ruedo/pose_t.hpp"
#include "ruedo/sonar_t.hpp"

namespace ruedo::ros2 {
namespace {

// A link that is moved by a wheel's angle or a joint's position.
struct MovedLink {
  double sign = 1.0;
  std::optional<LinkFrame> frame;  // none: no frame moves with it
  std::string parent, child;
};

// The origin of a message.
struct Source {
  std::string robot;
  std::vector<std::string> wheels;       // names of their joints
  std::vector<std::string> still;        // of joints that stay at 0
  std::vector<MovedLink> turned, moved;  // by odometry_t and joint_state_t, in order
  device_info_t device{};
  std::string part;   // the channel's name after the device: "depth", "info", ...
  double rate = 0.0;  // Hz
  std::string base, odom, frame, optical, world;
  int element = -1;  // of a sonar
  Distro distro = Distro::jazzy;
  // The robot's last one; a log of an earlier version has none.
  std::shared_ptr<const odometry_twist_t> twist;
};

void put_vector(CdrWriter& out, double x, double y, double z) { out.put(x).put(y).put(z); }
void put_vector(CdrWriter& out, const double* v) { put_vector(out, v[0], v[1], v[2]); }
void put_quaternion(CdrWriter& out, const double* wxyz) {
  out.put(wxyz[1]).put(wxyz[2]).put(wxyz[3]).put(wxyz[0]);
}

template <size_t size>
void put_zeros(CdrWriter& out, double first = 0.0) {
  double zeros[size] = {first};
  out.put_array(std::span<const double>(zeros));
}

void put_transform(CdrWriter& out, int64_t utime, const std::string& parent,
                   const std::string& child, const double* position, const double* wxyz) {
  put_header(out, utime, parent);
  out.put(child);
  put_vector(out, position);
  put_quaternion(out, wxyz);
}

void write_scan(const planar_lidar_t& scan, const Source& from, CdrWriter& out) {
  put_header(out, scan.utime, from.frame);
  const float last = scan.rad0 + static_cast<float>(std::max(0, scan.nranges - 1)) * scan.radstep;
  out.put(scan.rad0).put(last).put(scan.radstep);
  out.put(0.0f).put(from.rate > 0 ? static_cast<float>(1.0 / from.rate)
                                  : 0.0f);  // time between rays, and between scans
  out.put(static_cast<float>(from.device.range_min)).put(static_cast<float>(from.device.range_max));
  out.put_sequence(std::span<const float>(scan.ranges))
      .put_sequence(std::span<const float>(scan.intensities));
}

void put_point_fields(CdrWriter& out) {
  constexpr uint8_t kFloat32 = 7;
  constexpr const char* kNames[] = {"x", "y", "z", "intensity"};
  out.put_length(4);
  for (uint32_t i = 0; i < 4; ++i) out.put(kNames[i]).put(4 * i).put(kFloat32).put(uint32_t{1});
}

// One row per layer; rays without a return are NaN, so that neighbours stay neighbours.
void write_points(const lidar_t& lidar, const Source& from, CdrWriter& out) {
  put_header(out, lidar.utime, from.frame);
  const auto columns = static_cast<uint32_t>(std::max(0, lidar.ncolumns));
  const auto layers = columns == 0 ? 0u : static_cast<uint32_t>(lidar.ranges.size() / columns);
  out.put(layers).put(columns);
  put_point_fields(out);
  out.put(false).put(uint32_t{16}).put(16 * columns);
  out.put_length(size_t{16} * layers * columns);
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  bool dense = true;
  std::vector<float> values;
  values.reserve(size_t{4} * layers * columns);
  for (uint32_t layer = 0; layer < layers; ++layer) {
    const double elevation = lidar.elevation0 + layer * static_cast<double>(lidar.elevation_step);
    for (uint32_t column = 0; column < columns; ++column) {
      const size_t i = size_t{layer} * columns + column;
      const double range = lidar.ranges[i],
                   azimuth = lidar.azimuth0 + column * static_cast<double>(lidar.azimuth_step);
      const bool hit = std::isfinite(range);
      dense &= hit;
      values.push_back(hit ? static_cast<float>(range * math::cos(elevation) * math::cos(azimuth))
                           : kNone);
      values.push_back(hit ? static_cast<float>(range * math::cos(elevation) * math::sin(azimuth))
                           : kNone);
      values.push_back(hit ? static_cast<float>(range * math::sin(elevation)) : kNone);
      values.push_back(i < lidar.intensities.size() ? lidar.intensities[i] : 0.0f);
    }
  }
  out.put_array(
      std::span(reinterpret_cast<const uint8_t*>(values.data()), values.size() * sizeof(float)));
  out.put(dense);
}

bool is_fresh(const sonar_t& sonar, const Source& from) {
  const auto i = static_cast<size_t>(from.element);
  return i < sonar.fresh.size() && i < sonar.range.size() && sonar.fresh[i] != 0;
}

void write_range(const sonar_t& sonar, const Source& from, CdrWriter& out) {
  const auto i = static_cast<size_t>(from.element);
  const int64_t fired = i < sonar.fired_utime.size() ? sonar.fired_utime[i] : -1;
  put_header(out, fired < 0 ? sonar.utime : fired, from.frame);
  constexpr uint8_t kUltrasound = 0;
  out.put(kUltrasound).put(static_cast<float>(from.device.fov_horizontal));
  out.put(static_cast<float>(from.device.range_min))
      .put(static_cast<float>(from.device.range_max))
      .put(sonar.range[i]);
  if (from.distro != Distro::humble) out.put(0.0f);  // variance: not known
}

// Only echoes, each on its transducer's axis.
void write_sonar_points(const sonar_t& sonar, const Source& from, CdrWriter& out) {
  put_header(out, sonar.utime, from.frame);
  std::vector<float> points;
  const size_t count = std::min(sonar.range.size(), from.device.element_pose.size());
  for (size_t i = 0; i < count; ++i) {
    if (!(sonar.range[i] < static_cast<float>(from.device.range_max)) || sonar.fired_utime[i] < 0)
      continue;
    const std::vector<double>& e = from.device.element_pose[i];
    const Pose X = Pose::from_xyz_rpy(Vec3(e[0], e[1], e[2]), Vec3(e[3], e[4], e[5]));
    const Vec3 p = X * Vec3(sonar.range[i], 0, 0);
    for (int k = 0; k < 3; ++k) points.push_back(static_cast<float>(p[k]));
  }
  out.put_length(points.size() / 3).put_array(std::span<const float>(points));
  out.put_length(0);  // channels
}

void put_yaw(CdrWriter& out, double yaw) {
  out.put(0.0).put(0.0).put(math::sin(yaw / 2)).put(math::cos(yaw / 2));
}

// odometry_t has no sideways speed: the twist that was sent with it has.
odometry_twist_t twist_of(const odometry_t& odometry, const Source& from) {
  if (from.twist && from.twist->utime == odometry.utime) return *from.twist;
  odometry_twist_t twist{};
  twist.vx = odometry.v;
  twist.omega = odometry.omega;
  return twist;
}

// That of (vx, vy, omega) in that of (x, y, z, and turns about them).
void put_covariance(CdrWriter& out, std::span<const double, 9> of_plane) {
  constexpr size_t kAxes[] = {0, 1, 5};
  double all[36] = {};
  for (size_t i = 0; i < 9; ++i) all[6 * kAxes[i / 3] + kAxes[i % 3]] = of_plane[i];
  out.put_array(std::span<const double>(all));
}

void write_odometry(const odometry_t& odometry, const Source& from, CdrWriter& out) {
  const odometry_twist_t twist = twist_of(odometry, from);
  put_header(out, odometry.utime, from.odom);
  out.put(from.base);
  put_vector(out, odometry.x, odometry.y, 0.0);
  put_yaw(out, odometry.theta);
  put_zeros<36>(out);
  put_vector(out, twist.vx, twist.vy, 0.0);
  put_vector(out, 0.0, 0.0, twist.omega);
  put_covariance(out, twist.covariance);
}

size_t count_frames(const std::vector<MovedLink>& links, size_t count) {
  return static_cast<size_t>(
      std::count_if(links.begin(), links.begin() + static_cast<std::ptrdiff_t>(count),
                    [](const MovedLink& link) { return link.frame.has_value(); }));
}

template <class Number>
void put_moved(CdrWriter& out, int64_t utime, const std::vector<MovedLink>& links,
               std::span<const Number> positions) {
  for (size_t i = 0; i < positions.size(); ++i) {
    if (!links[i].frame) continue;
    const Pose X = links[i].frame->at(links[i].sign * static_cast<double>(positions[i]));
    const double wxyz[4] = {X.rotation.w(), X.rotation.x(), X.rotation.y(), X.rotation.z()};
    put_transform(out, utime, links[i].parent, links[i].child, X.translation.data(), wxyz);
  }
}

void write_odometry_frame(const odometry_t& odometry, const Source& from, CdrWriter& out) {
  const double position[3] = {odometry.x, odometry.y, 0.0};
  const double wxyz[4] = {math::cos(odometry.theta / 2), 0.0, 0.0, math::sin(odometry.theta / 2)};
  const size_t count = std::min(from.turned.size(), odometry.angle.size());
  out.put_length(1 + count_frames(from.turned, count));
  put_transform(out, odometry.utime, from.odom, from.base, position, wxyz);
  put_moved(out, odometry.utime, from.turned, std::span(odometry.angle.data(), count));
}

void write_wheels(const odometry_t& odometry, const Source& from, CdrWriter& out) {
  put_header(out, odometry.utime, "");
  const size_t count = std::min({from.wheels.size(), odometry.angle.size(), odometry.rate.size()});
  const size_t all = count + from.still.size();
  out.put_length(all);
  for (size_t i = 0; i < count; ++i) out.put(from.wheels[i]);
  for (const std::string& joint : from.still) out.put(joint);
  for (const auto* values : {&odometry.angle, &odometry.rate}) {
    out.put_length(all);
    for (size_t i = 0; i < count; ++i)
      out.put((i < from.turned.size() ? from.turned[i].sign : 1.0) * (*values)[i]);
    for (size_t i = count; i < all; ++i) out.put(0.0);
  }
  out.put_length(0);
}

bool has_wheels(const Source& from) { return !from.wheels.empty() || !from.still.empty(); }

void write_joints(const joint_state_t& joints, const Source&, CdrWriter& out) {
  put_header(out, joints.utime, "");
  out.put_length(joints.joint_name.size());
  for (const std::string& name : joints.joint_name) out.put(name);
  for (const auto* values :
       {&joints.joint_position, &joints.joint_velocity, &joints.joint_effort}) {
    out.put_length(values->size());
    for (const float value : *values) out.put(static_cast<double>(value));
  }
}

bool moves_links(const Source& from) { return count_frames(from.moved, from.moved.size()) > 0; }

void write_joint_frames(const joint_state_t& joints, const Source& from, CdrWriter& out) {
  const size_t count = std::min(from.moved.size(), joints.joint_position.size());
  out.put_length(count_frames(from.moved, count));
  put_moved(out, joints.utime, from.moved, std::span(joints.joint_position.data(), count));
}

void write_imu(const imu_t& imu, const Source& from, CdrWriter& out) {
  const bool oriented = imu.orientation[0] != 0 || imu.orientation[1] != 0 ||
                        imu.orientation[2] != 0 || imu.orientation[3] != 0;
  put_header(out, imu.utime, from.frame);
  put_quaternion(out, imu.orientation);
  put_zeros<9>(out, oriented ? 0.0 : -1.0);
  put_vector(out, imu.angular_velocity);
  put_zeros<9>(out);
  put_vector(out, imu.linear_acceleration);
  put_zeros<9>(out);
}

void write_fix(const navsat_t& navsat, const Source& from, CdrWriter& out) {
  constexpr int8_t kFix = 0;
  constexpr uint16_t kGps = 1;
  constexpr uint8_t kCovarianceUnknown = 0;
  put_header(out, navsat.utime, from.frame);
  out.put(kFix).put(kGps);
  out.put(navsat.latitude_deg).put(navsat.longitude_deg).put(navsat.altitude);
  put_zeros<9>(out);
  out.put(kCovarianceUnknown);
}

// East, north, up, as in receivers' drivers.
void write_fix_velocity(const navsat_t& navsat, const Source& from, CdrWriter& out) {
  put_header(out, navsat.utime, from.frame);
  put_vector(out, navsat.velocity);
  put_vector(out, 0.0, 0.0, 0.0);
}

void write_magnetic_field(const magnetometer_t& magnetometer, const Source& from, CdrWriter& out) {
  put_header(out, magnetometer.utime, from.frame);
  put_vector(out, magnetometer.field);
  put_zeros<9>(out);
}

void write_wrench(const force_torque_t& sensor, const Source& from, CdrWriter& out) {
  put_header(out, sensor.utime, from.frame);
  put_vector(out, sensor.force);
  put_vector(out, sensor.torque);
}

void write_altimeter(const altimeter_t& altimeter, const Source& from, CdrWriter& out) {
  put_header(out, altimeter.utime, from.frame);
  out.put(altimeter.altitude).put(altimeter.velocity).put(0.0);
}

void write_pressure(const air_pressure_t& air, const Source& from, CdrWriter& out) {
  put_header(out, air.utime, from.frame);
  out.put(air.pressure).put(0.0);
}

void write_differential_pressure(const air_speed_t& air, const Source& from, CdrWriter& out) {
  put_header(out, air.utime, from.frame);
  out.put(air.differential_pressure).put(0.0);
}

void write_air_temperature(const air_speed_t& air, const Source& from, CdrWriter& out) {
  constexpr double kZeroCelsius = 273.15;
  put_header(out, air.utime, from.frame);
  out.put(air.temperature - kZeroCelsius).put(0.0);
}

void write_ground_truth(const pose_t& pose, const Source& from, CdrWriter& out) {
  put_header(out, pose.utime, from.world);
  out.put(from.base);
  put_vector(out, pose.pos);
  put_quaternion(out, pose.orientation);
  put_zeros<36>(out);
  put_vector(out, pose.vel);
  put_vector(out, pose.rotation_rate);
  put_zeros<36>(out);
}

// For a plugin's device: the frame is its own.
void write_device_pose(const pose_t& pose, const Source& from, CdrWriter& out) {
  Source device = from;
  device.base = from.frame;
  write_ground_truth(pose, device, out);
}

bool is_own_pose(const Source& from) { return from.device.kind == "pose"; }
bool is_device_pose(const Source& from) { return !is_own_pose(from); }

void write_image(const image_t& image, const Source& from, CdrWriter& out) {
  const RawPicture raw = raw_picture(image);
  put_header(out, image.utime, from.optical);
  out.put(raw.height).put(raw.width).put(raw.encoding).put(uint8_t{0}).put(raw.step);
  out.put_sequence(std::span<const uint8_t>(raw.data));
}

void write_compressed(const image_t& image, const Source& from, CdrWriter& out) {
  put_header(out, image.utime, from.optical);
  out.put("jpeg");
  if (image.pixelformat == image_t::PIXEL_FORMAT_MJPEG) {
    out.put_sequence(std::span<const uint8_t>(image.data));
  } else {
    out.put_sequence(std::span<const uint8_t>(jpeg_of(image)));
  }
}

void write_camera_info(const camera_info_t& camera, const Source& from, CdrWriter& out) {
  put_header(out, camera.utime, from.optical);
  out.put(static_cast<uint32_t>(camera.height))
      .put(static_cast<uint32_t>(camera.width))
      .put("plumb_bob");
  out.put_sequence(std::span<const double>(camera.distortion));
  const double k[9] = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  const double r[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const double p[12] = {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0};
  out.put_array(std::span<const double>(k))
      .put_array(std::span<const double>(r))
      .put_array(std::span<const double>(p));
  out.put(uint32_t{0}).put(uint32_t{0});  // binning
  out.put(uint32_t{0})
      .put(uint32_t{0})
      .put(uint32_t{0})
      .put(uint32_t{0})
      .put(false);  // region of interest: everything
}

void put_entity(CdrWriter& out, const std::string& name) {
  constexpr uint8_t kLink = 3;
  out.put(uint64_t{0}).put(name).put(kLink);
}

// One contact point each, of what `own` names; the force acts there along the normal.
void put_contacts(int64_t utime, const std::string& own, std::span<const contact_point_t> points,
                  const Source& from, CdrWriter& out) {
  put_header(out, utime, from.world);
  out.put_length(points.size());
  for (const contact_point_t& point : points) {
    put_entity(out, own);
    put_entity(out, point.body);
    out.put_length(1);
    put_vector(out, point.position);
    out.put_length(1);
    put_vector(out, point.normal);
    out.put_length(1).put(point.depth);
    out.put_length(1);
    put_header(out, utime, from.world);
    out.put(own).put(uint32_t{0}).put(point.body).put(uint32_t{0});
    for (const double sign : {1.0, -1.0}) {
      put_vector(out, sign * point.force * point.normal[0], sign * point.force * point.normal[1],
                 sign * point.force * point.normal[2]);
      put_vector(out, 0, 0, 0);
    }
  }
}

void write_contacts(const contact_t& contact, const Source& from, CdrWriter& out) {
  put_contacts(contact.utime, from.device.robot + "/" + from.device.name, contact.points, from,
               out);
}

void write_collisions(const collisions_t& collisions, const Source& from, CdrWriter& out) {
  put_contacts(collisions.utime, from.robot, collisions.points, from, out);
}

// Along the normal, towards the robot; the text is the other body.
void write_collision_arrows(const collisions_t& collisions, const Source& from, CdrWriter& out) {
  constexpr double kLength = 0.3;  // m
  out.put_length(collisions.points.size());
  int32_t id = 0;
  for (const contact_point_t& point : collisions.points) {
    double tip[3];
    for (int i = 0; i < 3; ++i) tip[i] = point.position[i] + kLength * point.normal[i];
    put_arrow(out, collisions.utime, from.world, from.robot, id++,
              {point.position, tip, point.body});
  }
}

void write_bumper(const contact_t& contact, const Source&, CdrWriter& out) {
  out.put(static_cast<bool>(contact.pressed));
}

// The hypothesis and pose of a detection, with certainty.
void put_hypothesis(CdrWriter& out, const std::string& what, const double* position,
                    const double* wxyz) {
  out.put_length(1).put(what).put(1.0);
  put_vector(out, position);
  put_quaternion(out, wxyz);
  put_zeros<36>(out);
}

constexpr double kNowhere[3] = {0, 0, 0}, kUnturned[4] = {1, 0, 0, 0};

void write_logical_camera(const logical_camera_t& seen, const Source& from, CdrWriter& out) {
  put_header(out, seen.utime, from.frame);
  out.put_length(seen.objects.size());
  for (const logical_object_t& object : seen.objects) {
    put_header(out, seen.utime, from.frame);
    put_hypothesis(out, object.model, object.position, object.orientation);
    put_vector(out, object.position);
    put_quaternion(out, object.orientation);
    put_vector(out, kNowhere);  // its size is not known
    out.put(object.model);
  }
}

// The class is the label's number, the id is the model's name.
void write_boxes_2d(const boxes_2d_t& seen, const Source& from, CdrWriter& out) {
  put_header(out, seen.utime, from.optical);
  out.put_length(seen.boxes.size());
  for (const box_2d_t& box : seen.boxes) {
    put_header(out, seen.utime, from.optical);
    put_hypothesis(out, std::to_string(box.label), kNowhere, kUnturned);
    out.put(box.x).put(box.y).put(0.0).put(box.width).put(box.height).put(box.name);
  }
}

void write_boxes_3d(const boxes_3d_t& seen, const Source& from, CdrWriter& out) {
  put_header(out, seen.utime, from.frame);
  out.put_length(seen.boxes.size());
  for (const box_3d_t& box : seen.boxes) {
    put_header(out, seen.utime, from.frame);
    put_hypothesis(out, std::to_string(box.label), box.center, box.orientation);
    put_vector(out, box.center);
    put_quaternion(out, box.orientation);
    put_vector(out, box.size);
    out.put(box.name);
  }
}

// Whose topic it is: a device's, each transducer's, the robot's, or that of each tree of tf.
enum class Scope { device, element, robot, tf };

template <class Message>
struct Row {
  const char* topic;
  const char* type;
  Qos qos;
  void (*write)(const Message&, const Source&, CdrWriter&);
  bool (*applies)(const Source&) = nullptr;                 // null: always applies
  bool (*is_due)(const Message&, const Source&) = nullptr;  // null: due with every message
  Scope scope = Scope::device;
};

bool is_camera(const std::string& kind) {
  return kind == "camera" || (kind.ends_with("_camera") && kind != "logical_camera");
}
bool is_segmentation(const Source& from) { return from.device.kind == "segmentation_camera"; }
bool is_thermal(const Source& from) { return from.device.kind == "thermal_camera"; }
bool is_colour(const Source& from) {
  return from.part.empty() && !is_segmentation(from) && !is_thermal(from);
}
bool is_depth(const Source& from) { return from.part == "depth"; }
bool is_labels(const Source& from) { return from.part == "labels"; }

// The conversions of each type.
template <class Message>
std::span<const Row<Message>> rows();

#define RUEDO_ROWS(Message, ...)                           \
  template <>                                              \
  std::span<const Row<Message>> rows<Message>() {          \
    static constexpr Row<Message> kRows[] = {__VA_ARGS__}; \
    return kRows;                                          \
  }

RUEDO_ROWS(planar_lidar_t, {"scan", "sensor_msgs/msg/LaserScan", kSensorQos, write_scan})
RUEDO_ROWS(lidar_t, {"points", "sensor_msgs/msg/PointCloud2", kSensorQos, write_points})
RUEDO_ROWS(sonar_t,
           {"range", "sensor_msgs/msg/Range", kSensorQos, write_range, nullptr, is_fresh,
            Scope::element},
           {"sonar", "sensor_msgs/msg/PointCloud", kSensorQos, write_sonar_points})
RUEDO_ROWS(odometry_t,
           {"odom", "nav_msgs/msg/Odometry", kStateQos, write_odometry, nullptr, nullptr,
            Scope::robot},
           {"tf", "tf2_msgs/msg/TFMessage", kTfQos, write_odometry_frame, nullptr, nullptr,
            Scope::tf},
           {"joint_states", "sensor_msgs/msg/JointState", kStateQos, write_wheels, has_wheels,
            nullptr, Scope::robot})
RUEDO_ROWS(joint_state_t,
           {"joint_states", "sensor_msgs/msg/JointState", kStateQos, write_joints, nullptr, nullptr,
            Scope::robot},
           {"tf", "tf2_msgs/msg/TFMessage", kTfQos, write_joint_frames, moves_links, nullptr,
            Scope::tf})
RUEDO_ROWS(imu_t, {"imu", "sensor_msgs/msg/Imu", kSensorQos, write_imu})
RUEDO_ROWS(navsat_t, {"fix", "sensor_msgs/msg/NavSatFix", kSensorQos, write_fix},
           {"fix_velocity", "geometry_msgs/msg/TwistStamped", kSensorQos, write_fix_velocity})
RUEDO_ROWS(magnetometer_t,
           {"magnetic_field", "sensor_msgs/msg/MagneticField", kSensorQos, write_magnetic_field})
RUEDO_ROWS(force_torque_t, {"wrench", "geometry_msgs/msg/WrenchStamped", kSensorQos, write_wrench})
RUEDO_ROWS(altimeter_t,
           {"altimeter", "ros_gz_interfaces/msg/Altimeter", kSensorQos, write_altimeter})
RUEDO_ROWS(air_pressure_t,
           {"pressure", "sensor_msgs/msg/FluidPressure", kSensorQos, write_pressure})
RUEDO_ROWS(air_speed_t,
           {"differential_pressure", "sensor_msgs/msg/FluidPressure", kSensorQos,
            write_differential_pressure},
           {"air_temperature", "sensor_msgs/msg/Temperature", kSensorQos, write_air_temperature})
RUEDO_ROWS(pose_t,
           {"ground_truth", "nav_msgs/msg/Odometry", kStateQos, write_ground_truth, is_own_pose,
            nullptr, Scope::robot},
           {"pose", "nav_msgs/msg/Odometry", kStateQos, write_device_pose, is_device_pose})
RUEDO_ROWS(image_t, {"image_raw", "sensor_msgs/msg/Image", kSensorQos, write_image, is_colour},
           {"image_raw/compressed", "sensor_msgs/msg/CompressedImage", kSensorQos, write_compressed,
            is_colour},
           {"depth", "sensor_msgs/msg/Image", kSensorQos, write_image, is_depth},
           {"labels", "sensor_msgs/msg/Image", kSensorQos, write_image, is_labels},
           {"segmentation", "sensor_msgs/msg/Image", kSensorQos, write_image, is_segmentation},
           {"thermal", "sensor_msgs/msg/Image", kSensorQos, write_image, is_thermal})
RUEDO_ROWS(logical_camera_t,
           {"detections", "vision_msgs/msg/Detection3DArray", kSensorQos, write_logical_camera})
RUEDO_ROWS(boxes_2d_t,
           {"detections", "vision_msgs/msg/Detection2DArray", kSensorQos, write_boxes_2d})
RUEDO_ROWS(boxes_3d_t,
           {"detections", "vision_msgs/msg/Detection3DArray", kSensorQos, write_boxes_3d})
RUEDO_ROWS(camera_info_t,
           {"camera_info", "sensor_msgs/msg/CameraInfo", kSensorQos, write_camera_info})
RUEDO_ROWS(contact_t, {"contacts", "ros_gz_interfaces/msg/Contacts", kSensorQos, write_contacts},
           {"bumper", "std_msgs/msg/Bool", kSensorQos, write_bumper})
RUEDO_ROWS(collisions_t,
           {"collisions", "ros_gz_interfaces/msg/Contacts", kSensorQos, write_collisions, nullptr,
            nullptr, Scope::robot},
           {"collisions/markers", MarkerArrays::kType, kSensorQos, write_collision_arrows, nullptr,
            nullptr, Scope::robot})

#undef RUEDO_ROWS

}  // namespace

struct Conversions::Route {
  virtual ~Route() = default;
  virtual bool run(std::span<const uint8_t> message, const Wanted& wanted, const Emit& emit) = 0;
};

// Everything known about a run, looked up by robot and device.
struct Conversions::Plan {
  const ConversionOptions& options;
  Names& names;
  std::map<std::string, const robot_info_t*> robots;
  std::map<std::string, const device_info_t*> devices;  // by "ROBOT/DEVICE"
  // number of uses of a robot's topic by its devices
  std::map<std::pair<std::string, std::string>, int> uses;
  std::map<std::string, RobotFrames> links;
  std::map<std::string, std::shared_ptr<odometry_twist_t>> twists = {};  // by robot

  std::vector<MovedLink> moved(const std::string& robot, const std::vector<RobotFrames::Moved>& all,
                               const std::string& prefix) const {
    const std::vector<LinkFrame>& frames = links.at(robot).frames;
    std::vector<MovedLink> moved;
    for (const RobotFrames::Moved& each : all) {
      MovedLink& link = moved.emplace_back();
      link.sign = each.sign;
      if (each.frame == 0) continue;
      link.frame = frames[each.frame];
      link.parent = prefix + frames[link.frame->parent].name;
      link.child = prefix + link.frame->name;
    }
    return moved;
  }

  Source source(const channel_info_t& channel) const {
    return source(channel, names.frame(channel.robot, ""));
  }

  // prefix: of the robot's frames.
  Source source(const channel_info_t& channel, const std::string& prefix) const {
    Source from;
    from.robot = channel.robot;
    const std::string name = channel.robot + "/" + channel.device;
    if (const auto robot = robots.find(channel.robot); robot != robots.end())
      from.wheels = robot->second->wheels;
    if (const auto device = devices.find(name); device != devices.end())
      from.device = *device->second;
    if (const auto twist = twists.find(channel.robot); twist != twists.end())
      from.twist = twist->second;
    const std::string original = original_name(channel.name);
    if (original.starts_with(name + "/")) from.part = original.substr(name.size() + 1);
    if (const auto robot = links.find(channel.robot); robot != links.end()) {
      from.still = robot->second.still;
      from.turned = moved(channel.robot, robot->second.wheels, prefix);
      from.moved = moved(channel.robot, robot->second.joints, prefix);
    }
    from.rate = channel.rate;
    from.distro = options.distro;
    from.world = "world";
    from.base = prefix + "base_link";
    from.odom = prefix + "odom";
    from.frame = prefix + ros_name(channel.device);
    from.optical = from.frame + "_optical";
    return from;
  }

  std::string original_name(const std::string& bus_name) const {
    for (const auto& [from, to] : options.channels) {
      if (to == bus_name) return from;
    }
    return bus_name;
  }

  template <class Message>
  void count(const channel_info_t& channel) {
    for (const Row<Message>& row : rows<Message>()) {
      if (!row.applies || row.applies(source(channel))) ++uses[{channel.robot, row.topic}];
    }
  }

  // "scan" if the robot has one; otherwise "DEVICE/scan".
  template <class Message>
  std::string topic(const Row<Message>& row, const channel_info_t& channel) {
    const bool alone = row.scope == Scope::robot || uses[{channel.robot, row.topic}] == 1;
    return names.topic(channel.robot, (alone ? "" : ros_name(channel.device) + "/") + row.topic);
  }
};

namespace {

template <class Message>
class TypedRoute : public Conversions::Route {
 public:
  void add(const Row<Message>& row, Source source, size_t topic) {
    entries_.push_back({&row, std::move(source), topic});
  }

  bool run(std::span<const uint8_t> message, const Conversions::Wanted& wanted,
           const Conversions::Emit& emit) override {
    bool decoded = false;
    for (const Entry& entry : entries_) {
      if (!wanted(entry.topic)) continue;
      if (!decoded && decode_checked(message.data(), message.size(), message_) != DecodeFault::none)
        return false;
      decoded = true;
      if (entry.row->is_due && !entry.row->is_due(message_, entry.source)) continue;
      out_.clear();
      entry.row->write(message_, entry.source, out_);
      emit(entry.topic, out_.bytes());
    }
    return true;
  }

 private:
  struct Entry {
    const Row<Message>* row;
    Source source;
    size_t topic;
  };
  std::vector<Entry> entries_;
  Message message_;
  CdrWriter out_;
};

// Publishes nothing of its own: ROS has the velocity in odometry's message.
class TwistRoute : public Conversions::Route {
 public:
  explicit TwistRoute(std::shared_ptr<odometry_twist_t> twist) : twist_(std::move(twist)) {
    twist_->utime = -1;
  }

  bool run(std::span<const uint8_t> message, const Conversions::Wanted&,
           const Conversions::Emit&) override {
    return decode_checked(message.data(), message.size(), *twist_) == DecodeFault::none;
  }

 private:
  std::shared_ptr<odometry_twist_t> twist_;
};

// Calls visit.operator()<Message>() with the type of that name; this is the list of all types that
// are converted.
template <class Visit>
void with_type(const std::string& type, const Visit& visit) {
  const auto match = [&]<class... Messages>() {
    (static_cast<void>(type == Messages::getTypeName() &&
                       (visit.template operator()<Messages>(), true)),
     ...);
  };
  match.template operator()<planar_lidar_t, lidar_t, sonar_t, odometry_t, joint_state_t, imu_t,
                            pose_t, image_t, camera_info_t, contact_t, collisions_t, navsat_t,
                            magnetometer_t, altimeter_t, air_pressure_t, air_speed_t,
                            force_torque_t, logical_camera_t, boxes_2d_t, boxes_3d_t>();
}

}  // namespace

Conversions::Conversions(const std::vector<world_info_t>& info, const ConversionOptions& options,
                         Names& names) {
  Plan plan{options, names, {}, {}, {}, options.robots()};
  const auto each_channel = [&](const auto& visit) {
    for (const world_info_t& part : info) {
      for (const channel_info_t& channel : part.channels) {
        if (!channel.input && !channel.robot.empty()) visit(channel);
      }
    }
  };
  std::set<std::string> robots;
  for (const world_info_t& part : info) {
    for (const robot_info_t& robot : part.robots) {
      plan.robots[robot.name] = &robot;
      robots.insert(robot.name);
    }
    for (const device_info_t& device : part.devices)
      plan.devices[device.robot + "/" + device.name] = &device;
  }
  names.update(robots);
  each_channel([&](const channel_info_t& channel) {
    if (channel.type != odometry_twist_t::getTypeName()) return;
    auto& twist = plan.twists[channel.robot] = std::make_shared<odometry_twist_t>();
    routes_[channel.name] = std::make_unique<TwistRoute>(twist);
  });
  each_channel([&](const channel_info_t& channel) {
    with_type(channel.type, [&]<class Message>() { plan.count<Message>(channel); });
  });
  each_channel([&](const channel_info_t& channel) {
    with_type(channel.type, [&]<class Message>() { add_route<Message>(channel, plan); });
  });
  for (const auto& [name, device] : plan.devices) add_frames(*device, plan);
  for (const auto& [name, robot] : plan.links) add_links(name, robot, names);
  for (const std::string& robot : robots) {
    add_alias(robot, "odom", names);
    add_alias(robot, "base_link", names);
  }
  frames_[names.topic("", "tf_static")];  // also where nothing is on it
  for (const auto& [topic, frames] : frames_) {
    CdrWriter out;
    out.put_length(frames.size());
    for (const Frame& frame : frames)
      put_transform(out, 0, frame.parent, frame.child, frame.position, frame.orientation);
    standing_.push_back({{topic, "tf2_msgs/msg/TFMessage", kLatchedQos}, out.bytes()});
  }
}

Conversions::~Conversions() = default;

template <class Message>
void Conversions::add_route(const channel_info_t& channel, Plan& plan) {
  auto route = std::make_unique<TypedRoute<Message>>();
  std::vector<size_t>& topics = topics_of_[channel.name];
  const auto add = [&](const Row<Message>& row, const Source& from, const std::string& name) {
    topics.push_back(add_topic({name, row.type, row.qos}));
    route->add(row, from, topics.back());
  };
  for (const Row<Message>& row : rows<Message>()) {
    Source from = plan.source(channel);
    if (row.applies && !row.applies(from)) continue;
    if (row.scope == Scope::tf) {
      for (const Names::TfTree& tree : plan.names.tf_trees(channel.robot))
        add(row, plan.source(channel, tree.prefix), plan.names.topic(tree.robot, row.topic));
      continue;
    }
    const std::string name = plan.topic(row, channel);
    if (row.scope != Scope::element) {
      add(row, from, name);
      continue;
    }
    const std::string array = from.frame;
    for (int i = 0; i < from.device.nelements; ++i) {
      from.element = i;
      from.frame = array + "_" + std::to_string(i);
      add(row, from, name + "_" + std::to_string(i));
    }
  }
  routes_[channel.name] = std::move(route);
}

size_t Conversions::add_topic(Topic topic) {
  const auto [at, fresh] = by_name_.try_emplace(topic.name + " " + topic.type, topics_.size());
  if (fresh) topics_.push_back(std::move(topic));
  return at->second;
}

void Conversions::add_frame(const std::string& robot, const std::string& parent,
                            const std::string& child, const Pose& X, Names& names) {
  const Quat& q = X.rotation;
  for (const Names::TfTree& tree : names.tf_trees(robot)) {
    Frame frame{tree.prefix + parent, tree.prefix + child, {}, {q.w(), q.x(), q.y(), q.z()}};
    std::copy(X.translation.data(), X.translation.data() + 3, frame.position);
    frames_[names.topic(tree.robot, "tf_static")].push_back(std::move(frame));
  }
}

// Ties the frame of messages to that of the trees that have it under another name.
void Conversions::add_alias(const std::string& robot, const std::string& name, Names& names) {
  const std::string in_messages = names.frame(robot, name);
  for (const Names::TfTree& tree : names.tf_trees(robot)) {
    if (const std::string own = tree.prefix + name; own != in_messages)
      frames_[names.topic(tree.robot, "tf_static")].push_back(
          {own, in_messages, {0, 0, 0}, {1, 0, 0, 0}});
  }
}

void Conversions::add_frames(const device_info_t& device, const Plan& plan) {
  // z forward, x right, y down
  static const Pose kOptical{Quat(0.5, -0.5, 0.5, -0.5), Vec3::Zero()};
  if (device.kind == "odometry" || device.kind == "pose" || device.kind == "motion" ||
      device.kind == "collisions" || device.kind == "joints")
    return;
  const std::string frame = ros_name(device.name);
  const auto add = [&](const std::string& parent, const std::string& child, const Pose& X) {
    add_frame(device.robot, parent, child, X, plan.names);
    add_alias(device.robot, child, plan.names);
  };
  const double* q = device.orientation;
  const Pose X_BD{Quat(q[0], q[1], q[2], q[3]),
                  Vec3(device.position[0], device.position[1], device.position[2])};
  std::string parent = "base_link";
  Pose X_PD = X_BD;
  if (const auto robot = plan.links.find(device.robot); robot != plan.links.end()) {
    const auto carrier = robot->second.carriers.find(device.name);
    if (carrier != robot->second.carriers.end()) {
      const LinkFrame& link = robot->second.frames[carrier->second];
      parent = link.name;
      X_PD = link.X_BF.inverse() * X_BD;
    }
  }
  add(parent, frame, X_PD);
  if (is_camera(device.kind)) add(frame, frame + "_optical", kOptical);
  for (size_t i = 0; i < device.element_pose.size(); ++i) {
    const std::vector<double>& e = device.element_pose[i];
    add(frame, frame + "_" + std::to_string(i),
        Pose::from_xyz_rpy(Vec3(e[0], e[1], e[2]), Vec3(e[3], e[4], e[5])));
  }
}

void Conversions::add_links(const std::string& name, const RobotFrames& robot, Names& names) {
  for (size_t i = 1; i < robot.frames.size(); ++i) {
    const LinkFrame& link = robot.frames[i];
    if (link.motion == LinkFrame::Motion::none)
      add_frame(name, robot.frames[link.parent].name, link.name, link.X_PF, names);
  }
  CdrWriter out;
  out.put(robot.description);
  standing_.push_back(
      {{names.topic(name, "robot_description"), "std_msgs/msg/String", kLatchedQos}, out.bytes()});
}

const std::vector<size_t>& Conversions::topics_of(const std::string& channel) const {
  static const std::vector<size_t> none;
  const auto found = topics_of_.find(channel);
  return found == topics_of_.end() ? none : found->second;
}

bool Conversions::convert(const std::string& channel, std::span<const uint8_t> message,
                          const Wanted& wanted, const Emit& emit) {
  const auto route = routes_.find(channel);
  return route != routes_.end() && route->second->run(message, wanted, emit);
}

void put_time(CdrWriter& out, int64_t utime) {
  const int64_t us = ((utime % 1'000'000) + 1'000'000) % 1'000'000;
  out.put(static_cast<int32_t>((utime - us) / 1'000'000)).put(static_cast<uint32_t>(us * 1000));
}

void put_header(CdrWriter& out, int64_t utime, const std::string& frame) {
  put_time(out, utime);
  out.put(frame);
}

std::vector<uint8_t> clock_message(int64_t utime) {
  CdrWriter out;
  put_time(out, utime);
  return out.bytes();
}

}  // namespace ruedo::ros2
