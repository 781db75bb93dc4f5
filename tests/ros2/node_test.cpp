// The node over a transport that the test provides.
#include "ros2/node.h"

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ros2/cdr.h"
#include "ruedo/camera_info_t.hpp"
#include "ruedo/decode.h"
#include "ruedo/image_t.hpp"
#include "ruedo/joint_command_t.hpp"
#include "ruedo/planar_lidar_t.hpp"

namespace ruedo::ros2 {
namespace {

using Readers = std::map<std::string, size_t>;               // of a topic
using Handlers = std::map<std::string, Transport::Handler>;  // likewise

class FakeWriter : public Writer {
 public:
  FakeWriter(std::string topic, std::shared_ptr<Readers> readers)
      : topic_(std::move(topic)), readers_(std::move(readers)) {}
  bool write(std::span<const uint8_t>) override { return true; }
  bool reply(std::span<const uint8_t>, const SampleIdentity&) override { return true; }
  size_t readers() const override { return (*readers_)[topic_]; }
  Gid gid() const override { return {}; }

 private:
  std::string topic_;
  std::shared_ptr<Readers> readers_;
};

class FakeReader : public Reader {
 public:
  size_t writers() const override { return 0; }
  Gid gid() const override { return {}; }
};

class FakeTransport : public Transport {
 public:
  explicit FakeTransport(std::shared_ptr<Readers> readers,
                         std::shared_ptr<Handlers> handlers = std::make_shared<Handlers>())
      : readers_(std::move(readers)), handlers_(std::move(handlers)) {}
  std::unique_ptr<Writer> add_writer(const Endpoint& endpoint) override {
    return std::make_unique<FakeWriter>(endpoint.topic.name, readers_);
  }
  std::unique_ptr<Reader> add_reader(const Endpoint& endpoint, Handler handler) override {
    (*handlers_)[endpoint.topic.name] = std::move(handler);
    return std::make_unique<FakeReader>();
  }
  void start() override {}
  void stop() override {}
  Gid gid() const override { return {}; }
  std::string where() const override { return "nowhere"; }
  uint64_t refused() const override { return 0; }

 private:
  std::shared_ptr<Readers> readers_;
  std::shared_ptr<Handlers> handlers_;
};

template <class Message>
channel_info_t channel(const std::string& name, const std::string& device) {
  channel_info_t info{};
  info.name = name;
  info.robot = "p3at";
  info.device = device;
  info.type = Message::getTypeName();
  info.fingerprint = Message::getHash();
  return info;
}

world_info_t robot_with_a_camera() {
  world_info_t info{};
  info.robots.resize(1);
  info.robots[0].name = "p3at";
  info.channels = {channel<image_t>("p3at/camera", "camera"),
                   channel<camera_info_t>("p3at/camera/info", "camera"),
                   channel<planar_lidar_t>("p3at/lrf", "lrf")};
  for (const char* name : {"camera", "lrf"}) {
    device_info_t device{};
    device.robot = "p3at";
    device.name = device.kind = name;
    device.orientation[0] = 1.0;
    info.devices.push_back(device);
  }
  info.nrobots = static_cast<int32_t>(info.robots.size());
  info.ndevices = static_cast<int32_t>(info.devices.size());
  info.nchannels = static_cast<int32_t>(info.channels.size());
  return info;
}

TEST(Node, WantsPicturesThatSomebodyReads) {
  const auto readers = std::make_shared<Readers>();
  Node node({}, std::make_unique<FakeTransport>(readers), {robot_with_a_camera()},
            [](const std::string&, std::span<const uint8_t>) {});
  node.flush();
  EXPECT_FALSE(node.wants("p3at/camera"));
  EXPECT_FALSE(node.wants("p3at/camera/info"));
  EXPECT_TRUE(node.wants("p3at/lrf"));
  for (const char* topic : {"/p3at/image_raw/compressed", "/p3at/image_raw"}) {
    const uint64_t before = node.audience();
    (*readers)[topic] = 1;
    while (!node.wants("p3at/camera")) node.flush();
    EXPECT_GT(node.audience(), before);
    EXPECT_FALSE(node.wants("p3at/camera/info"));
    (*readers)[topic] = 0;
    while (node.wants("p3at/camera")) node.flush();
    EXPECT_GT(node.audience(), before + 1);
  }
}

// A robot whose joints are commanded, or none.
std::shared_ptr<run::Announcement> announced(bool arm) {
  world_info_t info{};
  if (arm) {
    info.channels = {channel<joint_command_t>("arm/joint_command", "")};
    info.channels[0].robot = "arm";
    info.channels[0].input = true;
  }
  info.nchannels = static_cast<int32_t>(info.channels.size());
  auto announcement = std::make_shared<run::Announcement>();
  announcement->info = {info};
  return announcement;
}

std::vector<uint8_t> numbers(const std::vector<double>& values) {
  CdrWriter out;
  out.put_length(0).put(uint32_t{0}).put_length(values.size());
  for (const double value : values) out.put(value);
  const std::span<const uint8_t> bytes = out.bytes();
  return {bytes.begin(), bytes.end()};
}

// Regression: they went to the joints of the first robot of the name.
TEST(Node, CommandsAreForTheRobotThatIsThere) {
  const auto handlers = std::make_shared<Handlers>();
  std::vector<std::string> joints{"a", "b"};
  NodeOptions options;
  options.joints = [&](const std::string&) { return joints; };
  std::vector<joint_command_t> heard;
  Node node(std::move(options),
            std::make_unique<FakeTransport>(std::make_shared<Readers>(), handlers),
            announced(true)->info, [&](const std::string&, std::span<const uint8_t> bytes) {
              joint_command_t command;
              ASSERT_EQ(decode_checked(bytes.data(), bytes.size(), command), DecodeFault::none);
              heard.push_back(std::move(command));
            });
  node.start();
  const auto send = [&](const std::vector<double>& values) {
    const std::vector<uint8_t> cdr = numbers(values);
    heard.clear();
    Sample sample;
    sample.cdr = cdr;
    handlers->at("/arm/forward_position_controller/commands")(sample);
  };
  send({1.0, 2.0});
  ASSERT_EQ(heard.size(), 1u);
  EXPECT_EQ(heard[0].name, joints);
  node.announce(announced(false));
  send({1.0, 2.0});
  EXPECT_EQ(heard.size(), 0u);
  joints = {"x", "y", "z"};
  node.announce(announced(true));
  send({1.0, 2.0, 3.0});
  ASSERT_EQ(heard.size(), 1u);
  EXPECT_EQ(heard[0].name, joints);
}

}  // namespace
}  // namespace ruedo::ros2