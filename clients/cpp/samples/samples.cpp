// The few computations of samples, and samples of any type. Their decoders are made from
// proto/vocabulary.toml.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "joint.h"
#include "samples/sample_types.h"

namespace ruedo::client {

double Scan::nearest(double from_angle, double to_angle) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < ranges.size(); ++i) {
    if (angle(i) >= from_angle && angle(i) <= to_angle)
      nearest = std::min(nearest, static_cast<double>(ranges[i]));
  }
  return nearest;
}

size_t Joints::index(const std::string& joint) const { return index_of(names, joint, "there is"); }

double Joints::position(const std::string& joint) const { return positions.at(index(joint)); }

double Joints::velocity(const std::string& joint) const { return velocities.at(index(joint)); }

double Joints::effort(const std::string& joint) const { return efforts.at(index(joint)); }

namespace {

constexpr double kRadian = 3.14159265358979323846 / 180.0;  // of a degree

double mixed(double first, double second, double share) {
  return (1.0 - share) * first + share * second;
}

template <class Numbers>
Numbers mixed(const Numbers& first, const Numbers& second, double share) {
  Numbers made = first;
  for (size_t i = 0; i < made.size() && i < second.size(); ++i) {
    made[i] = static_cast<typename Numbers::value_type>(
        mixed(static_cast<double>(first[i]), static_cast<double>(second[i]), share));
  }
  return made;
}

// The linear way between unit quaternions, normalised: for the small angles between two samples it
// is the shortest.
Quaternion turned(const Quaternion& first, Quaternion second, double share) {
  double dot = 0.0, norm = 0.0;
  for (size_t i = 0; i < 4; ++i) dot += first[i] * second[i];
  for (double& one : second) one = dot < 0.0 ? -one : one;
  Quaternion made = mixed(first, second, share);
  for (const double one : made) norm += one * one;
  for (double& one : made) one /= std::sqrt(norm);
  return made;
}

double share_of(const Sample& first, const Sample& second, int64_t at) {
  return static_cast<double>(at - first.utime) / static_cast<double>(second.utime - first.utime);
}

}  // namespace

std::vector<Vector3> Scan::points(const Transform& device) const {
  std::vector<Vector3> points;
  for (size_t i = 0; i < ranges.size(); ++i) {
    const double range = static_cast<double>(ranges[i]);
    if (std::isfinite(range))
      points.push_back(device.apply({range * std::cos(angle(i)), range * std::sin(angle(i)), 0.0}));
  }
  return points;
}

namespace {

// Earth-centred, Earth-fixed coordinates, m: WGS 84 (NIMA TR8350.2, eq. 4-14).
Vector3 earth_centred(const NavSat& fix) {
  constexpr double kAxis = 6378137.0, kFlattening = 1.0 / 298.257223563;
  constexpr double kSquared = kFlattening * (2.0 - kFlattening);
  const double latitude = fix.latitude_deg * kRadian, longitude = fix.longitude_deg * kRadian;
  const double sine = std::sin(latitude), normal = kAxis / std::sqrt(1.0 - kSquared * sine * sine);
  const double along = (normal + fix.altitude) * std::cos(latitude);
  return {along * std::cos(longitude), along * std::sin(longitude),
          ((1.0 - kSquared) * normal + fix.altitude) * sine};
}

}  // namespace

Vector3 NavSat::enu(const NavSat& origin) const {
  const Vector3 here = earth_centred(*this), there = earth_centred(origin);
  const double x = here[0] - there[0], y = here[1] - there[1], z = here[2] - there[2];
  const double latitude = origin.latitude_deg * kRadian, longitude = origin.longitude_deg * kRadian;
  const double along = std::cos(longitude) * x + std::sin(longitude) * y;
  return {-std::sin(longitude) * x + std::cos(longitude) * y,
          -std::sin(latitude) * along + std::cos(latitude) * z,
          std::cos(latitude) * along + std::sin(latitude) * z};
}

Odometry Odometry::interpolated(const Odometry& later, int64_t at) const {
  const double share = share_of(*this, later, at);
  Odometry made = *this;
  made.utime = at;
  for (double Odometry::* field :
       {&Odometry::x, &Odometry::y, &Odometry::theta, &Odometry::v, &Odometry::omega})
    made.*field = mixed(this->*field, later.*field, share);
  made.wheel_angles = mixed(wheel_angles, later.wheel_angles, share);
  made.wheel_rates = mixed(wheel_rates, later.wheel_rates, share);
  return made;
}

Pose Pose::interpolated(const Pose& later, int64_t at) const {
  const double share = share_of(*this, later, at);
  Pose made = *this;
  made.utime = at;
  made.orientation = turned(orientation, later.orientation, share);
  for (Vector3 Pose::* field :
       {&Pose::position, &Pose::velocity, &Pose::rotation_rate, &Pose::acceleration})
    made.*field = mixed(this->*field, later.*field, share);
  return made;
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

#define RUEDO_MESSAGE_TYPE(SampleType, type) \
  template <>                                \
  const char* message_type<SampleType>() {   \
    return #type;                            \
  }
RUEDO_SAMPLE_TYPES(RUEDO_MESSAGE_TYPE)
#undef RUEDO_MESSAGE_TYPE

}  // namespace ruedo::client
