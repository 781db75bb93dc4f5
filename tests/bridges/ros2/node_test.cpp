// The node over a transport that the test provides.
#include "bridges/ros2/node.h"

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ruedo/camera_info_t.hpp"
#include "ruedo/image_t.hpp"
#include "ruedo/joint_command_t.hpp"
#include "ruedo/odometry_t.hpp"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/velocity_command_t.hpp"

namespace ruedo::ros2 {
namespace {

// The state that the test and the transport share.
struct Middleware {
  std::map<std::string, size_t> readers;                    // of a topic, elsewhere
  std::map<std::string, std::vector<std::string>> written;  // by topic
  std::multimap<std::string, Transport::Handler> read;      // by topic
  std::set<std::string> published;                          // "TOPIC TYPE", by others
  std::multiset<std::string> ends;                          // the topics of the node's own
};

class FakeWriter : public Writer {
 public:
  FakeWriter(std::string topic, std::shared_ptr<Middleware> shared)
      : topic_(std::move(topic)), shared_(std::move(shared)) {
    shared_->ends.insert(topic_);
  }
  ~FakeWriter() override { shared_->ends.erase(shared_->ends.find(topic_)); }
  bool write(std::span<const uint8_t> cdr) override {
    shared_->written[topic_].emplace_back(cdr.begin(), cdr.end());
    return true;
  }
  bool reply(std::span<const uint8_t>, const SampleIdentity&) override { return true; }
  size_t readers() const override { return shared_->readers[topic_]; }
  Gid gid() const override { return {}; }

 private:
  std::string topic_;
  std::shared_ptr<Middleware> shared_;
};

class FakeReader : public Reader {
 public:
  FakeReader(const std::string& topic, Transport::Handler handler,
             std::shared_ptr<Middleware> shared)
      : shared_(std::move(shared)), at_(shared_->read.emplace(topic, std::move(handler))) {}
  ~FakeReader() override { shared_->read.erase(at_); }
  size_t writers() const override { return 0; }
  Gid gid() const override { return {}; }

 private:
  std::shared_ptr<Middleware> shared_;
  std::multimap<std::string, Transport::Handler>::iterator at_;
};

class FakeTransport : public Transport {
 public:
  explicit FakeTransport(std::shared_ptr<Middleware> shared) : shared_(std::move(shared)) {}
  std::unique_ptr<Writer> add_writer(const Endpoint& endpoint) override {
    return std::make_unique<FakeWriter>(endpoint.topic.name, shared_);
  }
  std::unique_ptr<Reader> add_reader(const Endpoint& endpoint, Handler handler) override {
    return std::make_unique<FakeReader>(endpoint.topic.name, std::move(handler), shared_);
  }
  bool is_published(const Topic& topic) override {
    return shared_->published.contains(topic.name + " " + topic.type);
  }
  void start() override {}
  void stop() override {}
  Gid gid() const override { return {}; }
  std::string where() const override { return "nowhere"; }
  uint64_t refused() const override { return 0; }

 private:
  std::shared_ptr<Middleware> shared_;
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

world_info_t arm(const std::string& name) {
  world_info_t info{};
  info.robots.resize(1);
  info.robots[0].name = name;
  info.channels.push_back(channel<joint_command_t>(name + "/joint_command", ""));
  info.channels[0].robot = name;
  info.channels[0].input = true;
  info.nrobots = info.nchannels = 1;
  return info;
}

std::shared_ptr<const run::Announcement> announcement(std::vector<world_info_t> info) {
  auto announcement = std::make_shared<run::Announcement>();
  announcement->info = std::move(info);
  return announcement;
}

TEST(Node, WantsOnlyPicturesWithReaders) {
  const auto shared = std::make_shared<Middleware>();
  Node node({}, std::make_unique<FakeTransport>(shared), {robot_with_a_camera()},
            [](const std::string&, std::span<const uint8_t>) {});
  node.flush();
  EXPECT_FALSE(node.wants("p3at/camera"));
  EXPECT_FALSE(node.wants("p3at/camera/info"));
  EXPECT_TRUE(node.wants("p3at/lrf"));
  for (const char* topic : {"/p3at/image_raw/compressed", "/p3at/image_raw"}) {
    const uint64_t before = node.audience();
    shared->readers[topic] = 1;
    while (!node.wants("p3at/camera")) node.flush();
    EXPECT_GT(node.audience(), before);
    EXPECT_FALSE(node.wants("p3at/camera/info"));
    shared->readers[topic] = 0;
    while (node.wants("p3at/camera")) node.flush();
    EXPECT_GT(node.audience(), before + 1);
  }
  node.announce(announcement({robot_with_a_camera()}));  // after a reset
  EXPECT_FALSE(node.wants("p3at/camera"));
}

TEST(Node, PublishesTheDescriptionOfAReplacedRobot) {
  const auto shared = std::make_shared<Middleware>();
  RobotFrames frames;
  frames.description = "<robot name='first'/>";
  NodeOptions options;
  options.conversion.robots = [&] { return std::map<std::string, RobotFrames>{{"arm", frames}}; };
  Node node(options, std::make_unique<FakeTransport>(shared), {arm("arm")},
            [](const std::string&, std::span<const uint8_t>) {});
  const std::vector<std::string>& told = shared->written["/arm/robot_description"];
  ASSERT_EQ(told.size(), 1u);
  node.announce(announcement({arm("arm")}));
  EXPECT_EQ(told.size(), 1u);  // it is as it was
  frames.description = "<robot name='second'/>";
  node.announce(announcement({arm("arm")}));
  ASSERT_EQ(told.size(), 2u);
  EXPECT_NE(told.back().find(frames.description), std::string::npos);
}

world_info_t base(const std::string& name) {
  world_info_t info = arm(name);
  info.channels = {channel<velocity_command_t>(name + "/velocity", "")};
  info.channels[0].robot = name;
  info.channels[0].input = true;
  return info;
}

TEST(Node, ReadsOneTypeOfCmdVelAndTheOtherOnceItIsPublished) {
  constexpr const char* kTypes[] = {"geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"};
  for (const bool stamped : {false, true}) {
    const auto shared = std::make_shared<Middleware>();
    NodeOptions options;
    options.stamped = stamped;
    Node node(options, std::make_unique<FakeTransport>(shared), {base("p3at")},
              [](const std::string&, std::span<const uint8_t>) {});
    const auto types = [&] {
      std::set<std::string> found;
      for (const Topic& topic : node.inputs())
        if (topic.name == "/p3at/cmd_vel") found.insert(topic.type);
      return found;
    };
    EXPECT_EQ(types(), std::set<std::string>{kTypes[stamped]});
    shared->published.insert(std::string("/p3at/cmd_vel ") + kTypes[!stamped]);
    EXPECT_FALSE(node.is_written("/p3at/cmd_vel"));  // reads the other type from now on
    EXPECT_EQ(types().size(), 2u);
    node.announce(announcement({base("p3at")}));
    EXPECT_EQ(types().size(), 2u);
    EXPECT_EQ(shared->read.count("/p3at/cmd_vel"), 2u);
    shared->published.clear();
    EXPECT_FALSE(node.is_written("/p3at/cmd_vel"));
    EXPECT_EQ(types(), std::set<std::string>{kTypes[stamped]});
  }
}

TEST(Node, CommandsTheJointsOfTheCurrentRobot) {
  const auto shared = std::make_shared<Middleware>();
  std::vector<std::string> joints{"a", "b"};
  NodeOptions options;
  options.joints = [&](const std::string&) { return joints; };
  std::vector<std::string> commanded;
  Node node(options, std::make_unique<FakeTransport>(shared), {arm("arm")},
            [&](const std::string&, std::span<const uint8_t> message) {
              joint_command_t command;
              command.decode(message.data(), 0, static_cast<int>(message.size()));
              commanded = command.name;
            });
  node.start();
  const auto send = [&](const std::vector<double>& positions) {
    CdrWriter cdr;
    cdr.put_length(0).put(uint32_t{0}).put_sequence(std::span<const double>(positions));
    Sample sample;
    sample.cdr = cdr.bytes();
    commanded.clear();
    const auto readers = shared->read.equal_range("/arm/forward_position_controller/commands");
    for (auto reader = readers.first; reader != readers.second; ++reader) reader->second(sample);
  };
  send({0.5, 0.7});
  EXPECT_EQ(commanded, joints);
  joints = {"x", "y", "z"};
  node.announce(announcement({arm("arm")}));
  send({0.5, 0.7});
  EXPECT_EQ(commanded, std::vector<std::string>());
  send({0.5, 0.7, 0.9});
  EXPECT_EQ(commanded, joints);
}

TEST(Node, ForgetsRemovedRobots) {
  const auto shared = std::make_shared<Middleware>();
  NodeOptions options;
  Node node(options, std::make_unique<FakeTransport>(shared), {arm("first")},
            [](const std::string&, std::span<const uint8_t>) {});
  const auto read = [&] {
    std::multiset<std::string> topics;
    for (const auto& [topic, handler] : shared->read) topics.insert(topic);
    return topics;
  };
  const std::multiset<std::string> ends = shared->ends, topics = read();
  node.announce(announcement({arm("first"), arm("second")}));
  EXPECT_GT(read().size(), topics.size());
  node.announce(announcement({arm("first")}));
  EXPECT_EQ(shared->ends, ends);
  EXPECT_EQ(read(), topics);
}

using FramesByTopic = std::map<std::string, std::set<std::string>>;  // "PARENT CHILD"

// The tf messages of a robot p3at with a namespace, and the frame of its scan.
FramesByTopic tf_frames(TfLayout layout, std::string& of_scan) {
  const auto shared = std::make_shared<Middleware>();
  world_info_t info = robot_with_a_camera();
  info.channels.push_back(channel<odometry_t>("p3at/odometry", ""));
  info.nchannels = static_cast<int32_t>(info.channels.size());
  NodeOptions options;
  options.conversion.tf = layout;
  Node node(options, std::make_unique<FakeTransport>(shared), {info},
            [](const std::string&, std::span<const uint8_t>) {});
  for (const char* topic : {"/tf", "/tf_static", "/p3at/tf", "/p3at/tf_static", "/p3at/scan"})
    shared->readers[topic] = 1;
  const auto publish = [&](const std::string& name, const auto& message) {
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    node.message({run::Kind::sample, 0, 0, name, {}, 0, bytes.data(), bytes.size()});
  };
  publish("p3at/odometry", odometry_t{});
  publish("p3at/lrf", planar_lidar_t{});
  FramesByTopic found;
  for (const auto& [topic, messages] : shared->written) {
    for (const std::string& message : messages) {
      CdrReader in(std::span(reinterpret_cast<const uint8_t*>(message.data()), message.size()));
      if (topic == "/p3at/scan") {
        in.get<int32_t>(), in.get<uint32_t>();
        of_scan = in.get_text();
      }
      if (topic.find("/tf") == std::string::npos) continue;
      for (size_t left = in.get_length(1); left > 0; --left) {
        in.get<int32_t>(), in.get<uint32_t>();
        const std::string parent = in.get_text(), child = in.get_text();
        for (int i = 0; i < 7; ++i) in.get<double>();
        found[topic].insert(parent + " " + child);
      }
    }
  }
  return found;
}

TEST(Node, PublishesFramesWithPrefixesAndInNamespaces) {
  const std::set<std::string> still = {"base_link camera", "base_link lrf",
                                       "camera camera_optical"};
  const auto prefixed = [](const std::set<std::string>& frames) {
    std::set<std::string> all;
    for (const std::string& each : frames) {
      const size_t gap = each.find(' ');
      all.insert("p3at/" + each.substr(0, gap) + " p3at/" + each.substr(gap + 1));
    }
    return all;
  };
  std::string of_scan;
  const FramesByTopic with_names = tf_frames(TfLayout::prefixed, of_scan);
  EXPECT_EQ(with_names, (FramesByTopic{{"/tf", {"p3at/odom p3at/base_link"}},
                                       {"/tf_static", prefixed(still)}}));
  EXPECT_EQ(of_scan, "p3at/lrf");
  const FramesByTopic in_namespace = tf_frames(TfLayout::namespaced, of_scan);
  EXPECT_EQ(in_namespace,
            (FramesByTopic{{"/p3at/tf", {"odom base_link"}}, {"/p3at/tf_static", still}}));
  EXPECT_EQ(of_scan, "lrf");

  // Messages have the names of /tf, which /p3at/tf knows, too.
  std::set<std::string> tied = still;
  for (const char* name : {"odom", "base_link", "lrf", "camera", "camera_optical"})
    tied.insert(std::string(name) + " p3at/" + name);
  EXPECT_EQ(tf_frames(TfLayout::both, of_scan),
            (FramesByTopic{{"/tf", with_names.at("/tf")},
                           {"/tf_static", with_names.at("/tf_static")},
                           {"/p3at/tf", in_namespace.at("/p3at/tf")},
                           {"/p3at/tf_static", tied}}));
  EXPECT_EQ(of_scan, "p3at/lrf");
}

TEST(Node, CommandsTheRobotOfTheRosName) {
  const auto shared = std::make_shared<Middleware>();
  NodeOptions options;
  options.joints = [](const std::string&) { return std::vector<std::string>{"a"}; };
  std::vector<std::string> commanded;
  Node node(
      options, std::make_unique<FakeTransport>(shared), {arm("a-b"), arm("a_b")},
      [&](const std::string& channel, std::span<const uint8_t>) { commanded.push_back(channel); });
  node.start();
  CdrWriter cdr;
  cdr.put_length(0).put(uint32_t{0}).put_length(1).put(0.5);
  Sample sample;
  sample.cdr = cdr.bytes();
  for (const char* robot : {"a_b", "a_b_2"}) {
    const std::string topic = std::string("/") + robot + "/forward_position_controller/commands";
    ASSERT_EQ(shared->read.count(topic), 1u);
    shared->read.find(topic)->second(sample);
  }
  EXPECT_EQ(commanded, (std::vector<std::string>{"a_b/joint_command", "a-b/joint_command"}));
}

}  // namespace
}  // namespace ruedo::ros2
