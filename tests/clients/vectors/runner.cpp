// Runs the test vectors against the C++ client; runner.py describes the output.
#include <arpa/inet.h>
#include <poll.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>

#include "core.h"
#include "samples/sample_types.h"
#include "server_process.h"
#include "transport/transport.h"

using namespace ruedo::client;

namespace {

void add(std::string& line, double value) {
  char text[64];
  std::snprintf(text, sizeof text, " %.6f", value);
  line += text;
}
void add(std::string& line, float value) { add(line, static_cast<double>(value)); }
void add(std::string& line, int64_t value) { line += " " + std::to_string(value); }
void add(std::string& line, int32_t value) { add(line, int64_t{value}); }
void add(std::string& line, bool value) { add(line, int64_t{value}); }

template <class Values>
void row(std::string line, const Values& values) {
  for (const auto value : values) add(line, value);
  std::puts(line.c_str());
}

template <class SampleType>
const SampleType* as(const std::string& type, const Sample& sample) {
  return type == message_type<SampleType>() ? static_cast<const SampleType*>(&sample) : nullptr;
}

std::vector<double> last_and_first(double first, double step, int count) {
  return {first, first + step * (count - 1)};
}

void mean(const std::string& type, const Sample& sample) {
  row("utime", std::vector{sample.utime});
  if (const auto* scan = as<Scan>(type, sample)) {
    row("ranges", scan->ranges);
    row("intensities", scan->intensities);
    row("angles", scan->ranges.empty()
                      ? std::vector<double>()
                      : std::vector{scan->angle(0), scan->angle(scan->ranges.size() - 1)});
  } else if (const auto* lidar = as<LidarScan>(type, sample)) {
    row("shape", std::vector{lidar->layers, lidar->columns});
    row("ranges", lidar->ranges);
    row("intensities", lidar->intensities);
    row("azimuths", last_and_first(lidar->azimuth_min, lidar->azimuth_step, lidar->columns));
    row("elevations", last_and_first(lidar->elevation_min, lidar->elevation_step, lidar->layers));
  } else if (const auto* image = as<Image>(type, sample)) {
    row("picture", std::vector{image->width, image->height, image->row_stride});
    std::printf("format %s\n", to_string(image->format));
    row("data", std::vector<int32_t>(image->data.begin(), image->data.end()));
  } else if (const auto* camera = as<CameraInfo>(type, sample)) {
    row("picture", std::vector{camera->width, camera->height});
    row("focus", std::vector{camera->fx, camera->fy, camera->cx, camera->cy});
    row("distortion", camera->distortion);
  } else if (const auto* sonar = as<SonarReading>(type, sample)) {
    row("ranges", sonar->ranges);
    row("fired_utime", sonar->fired_utime);
    row("fresh", sonar->fresh);
  } else if (const auto* odometry = as<Odometry>(type, sample)) {
    row("pose", std::vector{odometry->x, odometry->y, odometry->theta});
    row("twist", std::vector{odometry->v, odometry->omega});
    row("angles", odometry->wheel_angles);
    row("rates", odometry->wheel_rates);
    row("ticks", odometry->ticks);
    row("resets", std::vector{odometry->resets});
  } else if (const auto* twist = as<OdometryTwist>(type, sample)) {
    row("twist", std::vector{twist->vx, twist->vy, twist->omega});
    row("covariance", twist->covariance);
  } else if (const auto* pose = as<Pose>(type, sample)) {
    row("position", pose->position);
    row("orientation", pose->orientation);
    row("velocity", pose->velocity);
    row("rotation_rate", pose->rotation_rate);
    row("acceleration", pose->acceleration);
    row("heading", std::vector{pose->heading()});
  } else if (const auto* imu = as<Imu>(type, sample)) {
    row("orientation", imu->orientation);
    row("angular_velocity", imu->angular_velocity);
    row("linear_acceleration", imu->linear_acceleration);
  } else if (const auto* navsat = as<NavSat>(type, sample)) {
    row("place", std::vector{navsat->latitude_deg, navsat->longitude_deg, navsat->altitude});
    row("velocity", navsat->velocity);
  } else if (const auto* magnetometer = as<Magnetometer>(type, sample)) {
    row("field", magnetometer->field);
  } else if (const auto* altimeter = as<Altimeter>(type, sample)) {
    row("altitude", std::vector{altimeter->altitude, altimeter->velocity});
  } else if (const auto* air = as<AirPressure>(type, sample)) {
    row("pressure", std::vector{air->pressure});
  } else if (const auto* pitot = as<AirSpeed>(type, sample)) {
    row("air", std::vector{pitot->differential_pressure, pitot->temperature});
  } else if (const auto* wrench = as<ForceTorque>(type, sample)) {
    row("force", wrench->force);
    row("torque", wrench->torque);
  } else if (const auto* logical = as<LogicalCamera>(type, sample)) {
    for (const LogicalObject& o : logical->objects) {
      std::vector<double> values(o.position.begin(), o.position.end());
      values.insert(values.end(), o.orientation.begin(), o.orientation.end());
      row("object " + o.model, values);
    }
  } else if (const auto* flat = as<Boxes2D>(type, sample)) {
    row("picture", std::vector{flat->width, flat->height});
    for (const Box2D& b : flat->boxes)
      row("box " + b.name + " " + std::to_string(b.label),
          std::vector{b.x, b.y, b.width, b.height});
  } else if (const auto* solid = as<Boxes3D>(type, sample)) {
    for (const Box3D& b : solid->boxes) {
      std::vector<double> values(b.center.begin(), b.center.end());
      values.insert(values.end(), b.orientation.begin(), b.orientation.end());
      values.insert(values.end(), b.size.begin(), b.size.end());
      row("box " + b.name + " " + std::to_string(b.label), values);
    }
  } else if (const auto* contact = as<Contact>(type, sample)) {
    row("pressed", std::vector{int64_t{contact->pressed}});
    for (const ContactPoint& p : contact->points) {
      row("point " + p.body, std::vector{p.position[0], p.position[1], p.position[2], p.normal[0],
                                         p.normal[1], p.normal[2], p.force, p.depth});
    }
  } else if (const auto* collisions = as<Collisions>(type, sample)) {
    std::printf("blocked by %s\n", collisions->blocked_by.c_str());
    for (const ContactPoint& p : collisions->points) {
      row("point " + p.body, std::vector{p.position[0], p.position[1], p.position[2], p.normal[0],
                                         p.normal[1], p.normal[2], p.force, p.depth});
    }
  } else if (const auto* joints = as<Joints>(type, sample)) {
    for (size_t i = 0; i < joints->names.size(); ++i) {
      row("joint " + joints->names[i],
          std::vector{joints->positions[i], joints->velocities[i], joints->efforts[i]});
    }
  } else if (const auto* motion = as<MotionStatus>(type, sample)) {
    row("id", std::vector{motion->id});
    std::printf("%s %s %s\n", to_string(motion->kind), to_string(motion->state),
                to_string(motion->reason));
    row("amounts", std::vector{motion->progress, motion->remaining});
    row("twist", std::vector{motion->v, motion->omega});
  }
}

void decode() {
  for (std::string line; std::getline(std::cin, line); std::puts(".")) {
    std::istringstream words(line);
    std::string type, hex;
    words >> type >> hex;
    std::vector<uint8_t> bytes;
    for (size_t i = 0; i + 1 < hex.size(); i += 2)
      bytes.push_back(static_cast<uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
    const SampleDecoder& decoder = *find_decoder(type);
    try {
      WireReader in(bytes.data(), bytes.size());
      if (in.int64() != decoder.fingerprint) throw WireError("another type");
      mean(type, *decoder.decode(in));
    } catch (const WireError&) {
      std::puts("broken");
    }
  }
}

// Frames on standard input and output: the lengths of channel and message, and both.
class PipeTransport : public Transport {
 public:
  void subscribe(const std::string&) override {}
  void unsubscribe(const std::string&) override {}
  void publish(const std::string& channel, const uint8_t* bytes, size_t size) override {
    const std::lock_guard lock(mutex_);
    const uint32_t head[] = {htonl(static_cast<uint32_t>(channel.size())),
                             htonl(static_cast<uint32_t>(size))};
    std::fwrite(head, 1, sizeof head, stdout);
    std::fwrite(channel.data(), 1, channel.size(), stdout);
    std::fwrite(bytes, 1, size, stdout);
    std::fflush(stdout);
  }
  bool receive(std::chrono::milliseconds timeout, const Receiver& receiver) override {
    pollfd waiting{0, POLLIN, 0};
    if (::poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0) return false;
    uint32_t head[2];
    read_all(head, sizeof head);
    std::string channel(ntohl(head[0]), '\0'), bytes(ntohl(head[1]), '\0');
    read_all(channel.data(), channel.size());
    read_all(bytes.data(), bytes.size());
    receiver(channel, reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
    return true;
  }

 private:
  static void read_all(void* to, size_t size) {
    for (auto* at = static_cast<char*>(to); size > 0;) {
      const ssize_t got = ::read(0, at, size);
      if (got <= 0) std::_Exit(3);
      at += got;
      size -= static_cast<size_t>(got);
    }
  }
  std::mutex mutex_;
};

void converse(int argc, char** argv) {
  auto core = std::make_shared<Core>("memq://", "test", nullptr, std::make_unique<PipeTransport>());
  core->join(300.0);
  const Simulation sim(core);
  try {
    const Robot robot = sim.robot("p3at");
    for (int i = 2; i < argc; ++i) {
      if (std::string(argv[i]) == "pause") {
        sim.pause();
        continue;
      }
      const int64_t n = std::atoll(argv[i]);
      const Observations seen = sim.step(
          n,
          n > 0 ? std::vector<Command>{robot.velocity_command(0.5, 0.0)} : std::vector<Command>{},
          300.0);
      std::string line = "step " + std::to_string(seen.step) + " " + std::to_string(seen.utime) +
                         " " + std::to_string(seen.state_hash);
      for (const auto& m : seen.messages) {
        line += " " + std::to_string(m.step) + ":" + m.channel + ":" +
                std::to_string(crc32(m.bytes.data(), m.bytes.size()));
      }
      std::fprintf(stderr, "%s\n", line.c_str());
    }
  } catch (const LeaseLost& error) {
    std::fprintf(stderr, "LeaseLost: %s\n", error.what());
  } catch (const RunEnded& error) {
    std::fprintf(stderr, "RunEnded: %s\n", error.what());
  } catch (const NoServer& error) {
    std::fprintf(stderr, "NoServer: %s\n", error.what());
  } catch (const RequestError& error) {
    std::fprintf(stderr, "RequestError %s: %s\n", to_string(error.code), error.what());
  } catch (const NotSupported& error) {
    std::fprintf(stderr, "NotSupported: %s\n", error.what());
  } catch (const Error& error) {
    std::fprintf(stderr, "RuedoError: %s\n", error.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  std::string(argv[1]) == "decode" ? decode() : converse(argc, argv);
  std::fflush(stdout);
  std::_Exit(0);  // a conversation ends where it ends: the script may be gone
}
