// Two Cyclone domains of this process that look like one to the network: what one sends reaches
// the other through the kernel's sockets alone.
#include "bridges/dds/self_test.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridges/dds/cyclone_transport.h"
#include "ruedo/errors.h"

namespace ruedo::dds {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr size_t kPicture = size_t{640} * 480 * 3 + 64;  // bytes of CDR
constexpr int kPictures = 30;
constexpr milliseconds kPeriod{67}, kLook{10}, kRest{300}, kPatience{5000};
constexpr uint32_t kFirstDomain = 1000;  // this process's name for it: beyond those of ROS
constexpr int kQuietDomains = 100, kFirstQuiet = 101;

std::unique_ptr<ros2::Transport> open(uint32_t number, const std::string& internal) {
  const int shown = kFirstQuiet + getpid() % kQuietDomains;  // ROS's own nodes are below 102
  CycloneOptions options;
  options.domain = kFirstDomain + number;
  options.own = fmt::format(
      "<CycloneDDS><Domain Id=\"any\"><Discovery><ExternalDomainId>{}</ExternalDomainId>"
      "<MaxAutoParticipantIndex>9</MaxAutoParticipantIndex></Discovery><Internal>{}</Internal>"
      "</Domain></CycloneDDS>",
      shown, internal);
  return open_cyclone(options);
}

int default_buffer() {
  const int udp = socket(AF_INET, SOCK_DGRAM, 0);
  int bytes = 0;
  socklen_t size = sizeof bytes;
  if (udp < 0 || getsockopt(udp, SOL_SOCKET, SO_RCVBUF, &bytes, &size) != 0)
    throw EnvironmentError("ROS 2: this system gives no UDP socket");
  close(udp);
  return bytes;
}

}  // namespace

PictureCount send_pictures_to_self() {
  const ros2::Endpoint sensor{ros2::Role::topic,
                              {"/ruedo_doctor", "sensor_msgs/msg/Image", {false, false, 5}},
                              "",
                              "",
                              nullptr};
  ros2::Endpoint picture = sensor;
  picture.topic.qos = ros2::kSensorQos;
  std::atomic<int> arrived{0};
  const auto sender = open(0, "");
  const int buffer = default_buffer();
  const auto receiver = open(  // Linux doubles what a program asks for
      1, fmt::format("<SocketReceiveBufferSize min=\"default\" max=\"{}B\"/>", buffer / 2));
  const auto reader = receiver->add_reader(sensor, [&](const ros2::Sample&) { ++arrived; });
  const auto writer = sender->add_writer(picture);
  receiver->start();
  for (const auto end = Clock::now() + kPatience; !writer->is_read() || reader->writers() == 0;
       std::this_thread::sleep_for(kLook)) {
    if (Clock::now() > end)
      throw EnvironmentError("ROS 2: a reader in this process did not find its writer");
  }
  std::vector<uint8_t> cdr(kPicture);
  cdr[1] = 1;  // little-endian
  auto next = Clock::now();
  for (int i = 0; i < kPictures; ++i) {
    writer->write(cdr);
    std::this_thread::sleep_until(next += kPeriod);
  }
  std::this_thread::sleep_for(kRest);
  receiver->stop();
  return {kPictures, arrived, buffer};
}

}  // namespace ruedo::dds
