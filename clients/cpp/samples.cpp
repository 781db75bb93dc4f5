// The samples: decoding, and what little they can compute.
#include <algorithm>
#include <cmath>
#include <fstream>

#include "ruedo/air_pressure_t.hpp"
#include "ruedo/air_speed_t.hpp"
#include "ruedo/altimeter_t.hpp"
#include "ruedo/boxes_2d_t.hpp"
#include "ruedo/boxes_3d_t.hpp"
#include "ruedo/camera_info_t.hpp"
#include "ruedo/collisions_t.hpp"
#include "ruedo/contact_t.hpp"
#include "ruedo/force_torque_t.hpp"
#include "ruedo/image_t.hpp"
#include "ruedo/imu_t.hpp"
#include "ruedo/joint_state_t.hpp"
#include "ruedo/lidar_t.hpp"
#include "ruedo/logical_camera_t.hpp"
#include "ruedo/magnetometer_t.hpp"
#include "ruedo/motion_status_t.hpp"
#include "ruedo/navsat_t.hpp"
#include "ruedo/odometry_t.hpp"
#include "ruedo/odometry_twist_t.hpp"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/pose_t.hpp"
#include "ruedo/sonar_t.hpp"
#include "sample_types.h"

namespace ruedo::client {

double Scan::nearest(double from_angle, double to_angle) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < ranges.size(); ++i) {
    if (angle(i) >= from_angle && angle(i) <= to_angle)
      nearest = std::min(nearest, static_cast<double>(ranges[i]));
  }
  return nearest;
}

double Pose::heading() const {
  const auto [w, x, y, z] = orientation;
  return std::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
}

void Image::save(const std::string& path) const {
  std::ofstream file(path, std::ios::binary);
  if (format == Format::jpeg) {
    file.write(reinterpret_cast<const char*>(data.data()),
               static_cast<std::streamsize>(data.size()));
  } else if (format == Format::rgb || format == Format::bgr || format == Format::gray) {
    const int channels = format == Format::gray ? 1 : 3;
    const size_t row_bytes =
        static_cast<size_t>(std::max(width, 0)) * static_cast<size_t>(channels);
    const size_t stride = row_stride > 0 ? static_cast<size_t>(row_stride) : row_bytes;
    if (width <= 0 || height <= 0 || stride < row_bytes ||
        data.size() / stride < static_cast<size_t>(height)) {
      throw Error(path + ": the picture's size does not fit its " + std::to_string(data.size()) +
                  " bytes");
    }
    file << (channels == 1 ? "P5 " : "P6 ") << width << ' ' << height << " 255\n";
    std::string row(row_bytes, '\0');
    for (size_t y = 0; y < static_cast<size_t>(height); ++y) {
      std::copy_n(data.begin() + static_cast<std::ptrdiff_t>(y * stride), row_bytes, row.begin());
      if (format == Format::bgr) {
        for (size_t x = 0; x < row_bytes; x += 3) std::swap(row[x], row[x + 2]);
      }
      file << row;
    }
  } else {
    throw Error(path + ": this kind of picture has no common file format");
  }
  file.close();
  if (!file) throw Error(path + " cannot be written");
}

namespace {

template <class Enum>
struct Word {
  Enum value;
  const char* text;
};

constexpr Word<MotionKind> kKinds[] = {
    {MotionKind::none, "none"},         {MotionKind::advance, "advance"},
    {MotionKind::rotate, "rotate"},     {MotionKind::heading, "heading"},
    {MotionKind::arc, "arc"},           {MotionKind::stop, "stop"},
    {MotionKind::velocity, "velocity"}, {MotionKind::wheels, "wheels"}};
constexpr Word<MotionState> kStates[] = {
    {MotionState::idle, "idle"},   {MotionState::running, "running"}, {MotionState::done, "done"},
    {MotionState::ended, "ended"}, {MotionState::refused, "refused"}, {MotionState::sent, "sent"}};
constexpr Word<MotionReason> kReasons[] = {{MotionReason::none, ""},
                                           {MotionReason::replaced, "replaced"},
                                           {MotionReason::blocked, "blocked"},
                                           {MotionReason::watchdog, "watchdog"},
                                           {MotionReason::not_finite, "not finite"},
                                           {MotionReason::bad_kind, "bad kind"},
                                           {MotionReason::bad_value, "bad value"},
                                           {MotionReason::no_drive, "no drive"},
                                           {MotionReason::not_possible, "not possible"},
                                           {MotionReason::removed, "removed"},
                                           {MotionReason::new_run, "new run"},
                                           {MotionReason::lost, "lost"}};

const Word<MotionKind>* words(MotionKind) { return std::begin(kKinds); }
const Word<MotionState>* words(MotionState) { return std::begin(kStates); }
const Word<MotionReason>* words(MotionReason) { return std::begin(kReasons); }
size_t count(MotionKind) { return std::size(kKinds); }
size_t count(MotionState) { return std::size(kStates); }
size_t count(MotionReason) { return std::size(kReasons); }

template <class Enum>
const Word<Enum>* word_of(Enum value) {
  const Word<Enum>* const end = words(value) + count(value);
  const Word<Enum>* const found =
      std::find_if(words(value), end, [&](const Word<Enum>& word) { return word.value == value; });
  return found == end ? nullptr : found;
}

// A later server may send values that are unknown here.
template <class Enum>
Enum known(int8_t value) {
  return word_of(static_cast<Enum>(value)) ? static_cast<Enum>(value) : Enum::unknown;
}

std::shared_ptr<const Sample> decode_scan(WireReader& in) {
  auto s = std::make_shared<Scan>();
  s->utime = in.int64();
  s->ranges = in.floats(in.count(4));
  s->intensities = in.floats(in.count(4));
  s->angle_min = in.float32();
  s->angle_step = in.float32();
  return s;
}

std::shared_ptr<const Sample> decode_lidar(WireReader& in) {
  auto s = std::make_shared<LidarScan>();
  s->utime = in.int64();
  s->layers = in.int32();
  s->columns = in.int32();
  s->ranges = in.floats(in.count(4));
  s->intensities = in.floats(in.count(4));
  s->azimuth_min = in.float32();
  s->azimuth_step = in.float32();
  s->elevation_min = in.float32();
  s->elevation_step = in.float32();
  const bool fits =
      s->layers >= 0 && s->columns >= 0 &&
      static_cast<size_t>(s->layers) * static_cast<size_t>(s->columns) == s->ranges.size() &&
      (s->intensities.empty() || s->intensities.size() == s->ranges.size());
  if (!fits) throw WireError("sizes that do not fit each other");
  return s;
}

std::shared_ptr<const Sample> decode_sonar(WireReader& in) {
  auto s = std::make_shared<SonarReading>();
  s->utime = in.int64();
  const size_t n = in.count(4 + 8 + 1);
  s->ranges = in.floats(n);
  s->fired_utime = in.int64s(n);
  s->fresh = in.booleans(n);
  return s;
}

std::shared_ptr<const Sample> decode_odometry(WireReader& in) {
  auto s = std::make_shared<Odometry>();
  s->utime = in.int64();
  for (double* value : {&s->x, &s->y, &s->theta, &s->v, &s->omega}) *value = in.float64();
  const size_t n = in.count(8 + 8 + 8);
  s->wheel_angles = in.doubles(n);
  s->wheel_rates = in.doubles(n);
  s->ticks = in.int64s(n);
  s->resets = in.int32();
  return s;
}

std::shared_ptr<const Sample> decode_odometry_twist(WireReader& in) {
  auto s = std::make_shared<OdometryTwist>();
  s->utime = in.int64();
  for (double* value : {&s->vx, &s->vy, &s->omega}) *value = in.float64();
  s->covariance = in.array<9>();
  return s;
}

std::shared_ptr<const Sample> decode_pose(WireReader& in) {
  auto s = std::make_shared<Pose>();
  s->utime = in.int64();
  s->position = in.array<3>();
  s->velocity = in.array<3>();
  s->orientation = in.array<4>();
  s->rotation_rate = in.array<3>();
  s->acceleration = in.array<3>();
  return s;
}

Image::Format image_format(int32_t pixelformat) {
  switch (pixelformat) {
    case image_t::PIXEL_FORMAT_GRAY: return Image::Format::gray;
    case image_t::PIXEL_FORMAT_RGB: return Image::Format::rgb;
    case image_t::PIXEL_FORMAT_BGR: return Image::Format::bgr;
    case image_t::PIXEL_FORMAT_MJPEG: return Image::Format::jpeg;
    case image_t::PIXEL_FORMAT_LE_GRAY16: return Image::Format::gray16;
    case image_t::PIXEL_FORMAT_FLOAT_GRAY32: return Image::Format::float32;
    default: return Image::Format::unknown;
  }
}

std::shared_ptr<const Sample> decode_image(WireReader& in) {
  auto s = std::make_shared<Image>();
  s->utime = in.int64();
  s->width = in.int32();
  s->height = in.int32();
  s->row_stride = in.int32();
  s->format = image_format(in.int32());
  s->data = in.bytes(in.count(1));
  return s;  // the metadata that follows is not used
}

std::shared_ptr<const Sample> decode_camera_info(WireReader& in) {
  auto s = std::make_shared<CameraInfo>();
  s->utime = in.int64();
  s->width = in.int32();
  s->height = in.int32();
  for (double* value : {&s->fx, &s->fy, &s->cx, &s->cy}) *value = in.float64();
  s->distortion = in.array<5>();
  return s;
}

std::shared_ptr<const Sample> decode_imu(WireReader& in) {
  auto s = std::make_shared<Imu>();
  s->utime = in.int64();
  s->orientation = in.array<4>();
  s->angular_velocity = in.array<3>();
  s->linear_acceleration = in.array<3>();
  return s;
}

std::vector<ContactPoint> contact_points(WireReader& in) {
  std::vector<ContactPoint> points(in.count(5 + 8 * 8));
  for (ContactPoint& point : points) {
    point.body = in.string();
    point.position = in.array<3>();
    point.normal = in.array<3>();
    point.force = in.float64();
    point.depth = in.float64();
  }
  return points;
}

std::shared_ptr<const Sample> decode_contact(WireReader& in) {
  auto s = std::make_shared<Contact>();
  s->utime = in.int64();
  s->pressed = in.boolean();
  s->points = contact_points(in);
  return s;
}

std::shared_ptr<const Sample> decode_collisions(WireReader& in) {
  auto s = std::make_shared<Collisions>();
  s->utime = in.int64();
  s->blocked_by = in.text();
  s->points = contact_points(in);
  return s;
}

std::shared_ptr<const Sample> decode_joints(WireReader& in) {
  auto s = std::make_shared<Joints>();
  s->utime = in.int64();
  const size_t n = in.fits(in.int16(), 5 + 3 * 4);
  s->names = in.strings(n);
  s->positions = in.floats(n);
  s->velocities = in.floats(n);
  s->efforts = in.floats(n);
  return s;
}

std::shared_ptr<const Sample> decode_motion(WireReader& in) {
  auto s = std::make_shared<MotionStatus>();
  s->utime = in.int64();
  s->id = in.int64();
  s->kind = known<MotionKind>(in.int8());
  s->state = known<MotionState>(in.int8());
  s->reason = known<MotionReason>(in.int8());
  s->progress = in.float64();
  s->remaining = in.float64();
  s->v = in.float64();
  s->omega = in.float64();
  return s;
}

std::shared_ptr<const Sample> decode_navsat(WireReader& in) {
  auto s = std::make_shared<NavSat>();
  s->utime = in.int64();
  s->latitude_deg = in.float64();
  s->longitude_deg = in.float64();
  s->altitude = in.float64();
  s->velocity = in.array<3>();
  return s;
}

std::shared_ptr<const Sample> decode_magnetometer(WireReader& in) {
  auto s = std::make_shared<Magnetometer>();
  s->utime = in.int64();
  s->field = in.array<3>();
  return s;
}

std::shared_ptr<const Sample> decode_altimeter(WireReader& in) {
  auto s = std::make_shared<Altimeter>();
  s->utime = in.int64();
  s->altitude = in.float64();
  s->velocity = in.float64();
  return s;
}

std::shared_ptr<const Sample> decode_air_pressure(WireReader& in) {
  auto s = std::make_shared<AirPressure>();
  s->utime = in.int64();
  s->pressure = in.float64();
  return s;
}

std::shared_ptr<const Sample> decode_air_speed(WireReader& in) {
  auto s = std::make_shared<AirSpeed>();
  s->utime = in.int64();
  s->differential_pressure = in.float64();
  s->temperature = in.float64();
  return s;
}

std::shared_ptr<const Sample> decode_force_torque(WireReader& in) {
  auto s = std::make_shared<ForceTorque>();
  s->utime = in.int64();
  s->force = in.array<3>();
  s->torque = in.array<3>();
  return s;
}

std::shared_ptr<const Sample> decode_logical_camera(WireReader& in) {
  auto s = std::make_shared<LogicalCamera>();
  s->utime = in.int64();
  s->objects.resize(in.count(5 + 7 * 8));
  for (LogicalObject& object : s->objects) {
    object.model = in.string();
    object.position = in.array<3>();
    object.orientation = in.array<4>();
  }
  return s;
}

std::shared_ptr<const Sample> decode_boxes_2d(WireReader& in) {
  auto s = std::make_shared<Boxes2D>();
  s->utime = in.int64();
  s->width = in.int32();
  s->height = in.int32();
  s->boxes.resize(in.count(4 + 5 + 4 * 8));
  for (Box2D& box : s->boxes) {
    box.label = in.int32();
    box.name = in.string();
    for (double* value : {&box.x, &box.y, &box.width, &box.height}) *value = in.float64();
  }
  return s;
}

std::shared_ptr<const Sample> decode_boxes_3d(WireReader& in) {
  auto s = std::make_shared<Boxes3D>();
  s->utime = in.int64();
  s->boxes.resize(in.count(4 + 5 + 10 * 8));
  for (Box3D& box : s->boxes) {
    box.label = in.int32();
    box.name = in.string();
    box.center = in.array<3>();
    box.orientation = in.array<4>();
    box.size = in.array<3>();
  }
  return s;
}

const SampleDecoder kDecoders[] = {
    {"planar_lidar_t", planar_lidar_t::getHash(), decode_scan},
    {"lidar_t", lidar_t::getHash(), decode_lidar},
    {"sonar_t", sonar_t::getHash(), decode_sonar},
    {"odometry_t", odometry_t::getHash(), decode_odometry},
    {"odometry_twist_t", odometry_twist_t::getHash(), decode_odometry_twist},
    {"pose_t", pose_t::getHash(), decode_pose},
    {"image_t", image_t::getHash(), decode_image},
    {"camera_info_t", camera_info_t::getHash(), decode_camera_info},
    {"imu_t", imu_t::getHash(), decode_imu},
    {"contact_t", contact_t::getHash(), decode_contact},
    {"collisions_t", collisions_t::getHash(), decode_collisions},
    {"joint_state_t", joint_state_t::getHash(), decode_joints},
    {"motion_status_t", motion_status_t::getHash(), decode_motion},
    {"navsat_t", navsat_t::getHash(), decode_navsat},
    {"magnetometer_t", magnetometer_t::getHash(), decode_magnetometer},
    {"altimeter_t", altimeter_t::getHash(), decode_altimeter},
    {"air_pressure_t", air_pressure_t::getHash(), decode_air_pressure},
    {"air_speed_t", air_speed_t::getHash(), decode_air_speed},
    {"force_torque_t", force_torque_t::getHash(), decode_force_torque},
    {"logical_camera_t", logical_camera_t::getHash(), decode_logical_camera},
    {"boxes_2d_t", boxes_2d_t::getHash(), decode_boxes_2d},
    {"boxes_3d_t", boxes_3d_t::getHash(), decode_boxes_3d},
};

}  // namespace

template <class Enum>
static const char* text_of(Enum value) {
  const Word<Enum>* const word = word_of(value);
  return word ? word->text : "unknown";
}
const char* to_string(MotionKind kind) { return text_of(kind); }
const char* to_string(MotionState state) { return text_of(state); }
const char* to_string(MotionReason reason) { return text_of(reason); }

RawSample raw_sample(WireReader in) {
  RawSample sample;
  sample.bytes = in.whole();
  return sample;
}

const SampleDecoder* raw_decoder() {
  static const SampleDecoder decoder{"", 0, [](WireReader& in) -> std::shared_ptr<const Sample> {
                                       return std::make_shared<RawSample>(raw_sample(in));
                                     }};
  return &decoder;
}

const SampleDecoder* find_decoder(const std::string& type) {
  for (const SampleDecoder& decoder : kDecoders) {
    if (type == decoder.type) return &decoder;
  }
  return nullptr;
}

#define RUEDO_MESSAGE_TYPE(SampleType, type) \
  template <>                                \
  const char* message_type<SampleType>() {   \
    return #type;                            \
  }
RUEDO_SAMPLE_TYPES(RUEDO_MESSAGE_TYPE)
#undef RUEDO_MESSAGE_TYPE

}  // namespace ruedo::client
