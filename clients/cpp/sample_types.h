// How each kind of sample comes off the wire.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "ruedo/client.h"
#include "wire_reader.h"

namespace ruedo::client {

// All kinds of samples, each with its message type.
#define RUEDO_SAMPLE_TYPES(X)        \
  X(Scan, planar_lidar_t)            \
  X(LidarScan, lidar_t)              \
  X(SonarReading, sonar_t)           \
  X(Odometry, odometry_t)            \
  X(OdometryTwist, odometry_twist_t) \
  X(Pose, pose_t)                    \
  X(Image, image_t)                  \
  X(CameraInfo, camera_info_t)       \
  X(Imu, imu_t)                      \
  X(Contact, contact_t)              \
  X(Collisions, collisions_t)        \
  X(Joints, joint_state_t)           \
  X(MotionStatus, motion_status_t)   \
  X(NavSat, navsat_t)                \
  X(Magnetometer, magnetometer_t)    \
  X(Altimeter, altimeter_t)          \
  X(AirPressure, air_pressure_t)     \
  X(AirSpeed, air_speed_t)           \
  X(ForceTorque, force_torque_t)     \
  X(LogicalCamera, logical_camera_t) \
  X(Boxes2D, boxes_2d_t)             \
  X(Boxes3D, boxes_3d_t)

// A message type: its name and fingerprint, and how it becomes a sample.
struct SampleDecoder {
  const char* type;
  int64_t fingerprint;
  std::shared_ptr<const Sample> (*decode)(WireReader&);  // throws WireError
};

// nullptr when this client does not know the type.
const SampleDecoder* find_decoder(const std::string& type);

// Of any type: fingerprint 0.
const SampleDecoder* raw_decoder();
RawSample raw_sample(WireReader in);

// The message type that a sample is made from: message_type<Scan>() is "planar_lidar_t".
template <class SampleType>
const char* message_type();

// Of a whole message. Throws TypeMismatch, with the channel.
template <class SampleType>
SampleType decoded(const std::string& channel, const std::vector<uint8_t>& bytes) {
  const SampleDecoder& decoder = *find_decoder(message_type<SampleType>());
  try {
    WireReader in(bytes.data(), bytes.size());
    if (in.int64() == decoder.fingerprint)
      return static_cast<const SampleType&>(*decoder.decode(in));
  } catch (const WireError& error) {
    throw TypeMismatch(channel + ": a message is no valid " + decoder.type + ": " + error.what());
  }
  throw TypeMismatch(channel + " carries another type than " + decoder.type +
                     ", or another version of it");
}

template <>
inline RawSample decoded<RawSample>(const std::string&, const std::vector<uint8_t>& bytes) {
  return raw_sample(WireReader(bytes.data(), bytes.size()));
}

}  // namespace ruedo::client
