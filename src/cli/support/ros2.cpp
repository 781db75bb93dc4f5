// The one place where commands meet ROS 2.
#include "cli/support/ros2.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>

#include "bridges/ros2/commands.h"
#include "cli/support/commands.h"
#include "cli/support/range.h"
#include "ruedo/element.h"
#include "ruedo/errors.h"
#include "run/run.h"

#ifdef RUEDO_ROS2
#include "bridges/dds/cyclone_transport.h"
#include "bridges/dds/self_test.h"
#include "bridges/ros2/node.h"
#include "run/queued_sink.h"
#include "world/model/body_layout.h"
#endif

namespace ruedo::cli {

CLI::Option* add_ros2_options(CLI::App& command, Ros2Arguments& arguments) {
  CLI::Option* ros2 =
      command
          .add_option("--ros2", arguments.distro,
                      "be a ROS 2 node, of that release (default: $ROS_DISTRO, or jazzy)")
          ->type_name("[DISTRO]")
          ->expected(0, 1);
  command
      .add_option("--ros2-clock", arguments.clock_hz,
                  "maximum rate of /clock, per second of sim time")
      ->type_name("HZ")
      ->capture_default_str()
      ->check(within(0.1, 10000.0))
      ->needs(ros2);
  command
      .add_option("--ros2-services", arguments.services,
                  "how services are mapped: as each call came, or as one middleware does")
      ->type_name("RMW")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "cyclonedds", "fastrtps"}))
      ->needs(ros2);
  command
      .add_option("--ros2-stamped", arguments.stamped,
                  "cmd_vel is a TwistStamped (default: from kilted on); the other type is read "
                  "where somebody publishes it")
      ->type_name("on|off")
      ->check(CLI::IsMember({"on", "off"}))
      ->needs(ros2);
  command
      .add_option(
          "--ros2-tf", arguments.tf,
          "frames of a robot with a namespace: ALICE/odom on /tf, odom on /ALICE/tf, or both")
      ->type_name("LAYOUT")
      ->capture_default_str()
      ->check(CLI::IsMember({"prefixed", "namespaced", "both"}))
      ->needs(ros2);
  return ros2;
}

Ros2Arguments with_names(Ros2Arguments arguments, const std::vector<std::string>& remaps,
                         const std::vector<run::WaitForOption>& wait_for) {
  for (auto& [name, other] : parse_remaps(remaps))
    (name.starts_with('/') ? arguments.topics : arguments.channels)
        .emplace_back(std::move(name), std::move(other));
  for (const run::WaitForOption& option : wait_for) {
    if (option.channel.starts_with('/')) arguments.wait_for.push_back(option.channel);
  }
  if (!arguments.on && !(arguments.topics.empty() && arguments.wait_for.empty()))
    throw InputError({}, "names of ROS topics (/...) in --remap and --wait-for go with --ros2");
  return arguments;
}

std::vector<run::WaitForOption> with_channels(std::vector<run::WaitForOption> options,
                                              const world::WorldModel& world,
                                              const Ros2Arguments& arguments) {
  std::vector<std::string> robots;
  for (const world::ModelInstance& model : world.models) {
    if (model.is_robot() && !model.removed) robots.push_back(model.name);
  }
  ros2::Names names(robots.size() == 1 ? robots.front() : "", arguments.topics,
                    ros2::parse_tf_layout(arguments.tf));
  names.update({robots.begin(), robots.end()});
  std::vector<std::string> topics;
  for (const std::string& robot : robots) {
    for (const auto& [topic, channel] : ros2::command_topics(robot, names)) {
      topics.push_back(topic);
      for (run::WaitForOption& option : options) {
        if (option.channel == topic) option.channel = channel;
      }
    }
  }
  for (const run::WaitForOption& option : options) {
    if (!option.channel.starts_with('/')) continue;
    const std::string near = nearest_word(option.channel, topics);
    throw InputError({}, "--wait-for: there is no ROS topic '" + option.channel +
                             "' that takes commands" +
                             (near.empty() ? "" : "; did you mean '" + near + "'?"));
  }
  return options;
}

std::string nodes_that_do_not_hear() {
  const char* middleware = std::getenv("RMW_IMPLEMENTATION");
  if (!middleware || std::string_view(middleware) != "rmw_zenoh_cpp") return "";
  return "RMW_IMPLEMENTATION is rmw_zenoh_cpp; nodes with it do not hear this run, which speaks "
         "DDS: start them with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp or rmw_fastrtps_cpp";
}

#ifdef RUEDO_ROS2

namespace {

constexpr size_t kMostQueued = size_t{64} << 20;           // bytes
constexpr auto kLook = std::chrono::milliseconds(10);      // between two looks at the participants
constexpr auto kSettled = std::chrono::milliseconds(300);  // since the last one came
constexpr auto kPatience = std::chrono::seconds(1);

ros2::Distro distro_of(const Ros2Arguments& arguments) {
  if (!arguments.distro.empty()) return ros2::parse_distro(arguments.distro);
  const char* named = std::getenv("ROS_DISTRO");
  if (!named || !*named) return ros2::Distro::jazzy;
  try {
    return ros2::parse_distro(named);
  } catch (const InputError& error) {
    throw InputError({}, std::string("ROS_DISTRO: ") + error.what() +
                             "; name a release whose messages are the same, as in --ros2 jazzy");
  }
}

std::vector<std::string> joints_of(const world::WorldModel& world, const std::string& robot) {
  const world::BodyLayout layout(world);
  std::vector<std::string> names;
  for (const world::RobotPlacement& placement : layout.robots) {
    const world::ModelInstance& instance = world.models[placement.instance];
    if (instance.name != robot || instance.removed) continue;
    for (const JointIndex joint : placement.joints)
      names.push_back(instance.model->joints[layout.joints[joint].joint].name);
  }
  return names;
}

ros2::NodeOptions node_options(run::Run& server, const Ros2Arguments& arguments) {
  ros2::NodeOptions options;
  std::vector<std::string> robots;
  for (const world_info_t& part : server.info()) {
    for (const robot_info_t& robot : part.robots) robots.push_back(robot.name);
  }
  options.conversion = {
      distro_of(arguments), robots.size() == 1 ? robots.front() : "",
      arguments.topics,     ros2::parse_tf_layout(arguments.tf),
      arguments.channels,   [&server] { return ros2::robot_frames(*server.world()); }};
  options.clock_hz = arguments.clock_hz;
  options.stamped = arguments.stamped.empty() ? options.conversion.distro >= ros2::Distro::kilted
                                              : arguments.stamped == "on";
  options.mapping = ros2::parse_mapping(arguments.services);
  options.joints = [&server](const std::string& robot) {
    return joints_of(*server.world(), robot);
  };
  options.world = [&server] { return server.world(); };
  return options;
}

struct CycloneNetwork : Ros2Network {
  std::unique_ptr<ros2::Transport> transport = dds::open_cyclone(dds::options_from_environment());
};

class CycloneNode : public Ros2Node {
 public:
  CycloneNode(run::Run& server, const Ros2Arguments& arguments,
              std::unique_ptr<ros2::Transport> transport)
      : server_(server),
        wait_for_(arguments.wait_for),
        where_(fmt::format("{}, {}", ros2::name_of(distro_of(arguments)), transport->where())),
        node_(options(arguments), std::move(transport), server.info(),
              [&server](const std::string& channel, std::span<const uint8_t> message) {
                server.on_message(channel, message.data(), message.size());
              }),
        queue_(node_, {.thread = "ros2", .most_bytes = kMostQueued}) {
    server.add(queue_);
    node_.start();
  }
  ~CycloneNode() override {
    node_.stop();
    const ros2::Node::Counts counts = node_.counts();
    if (counts.faulty > 0)
      spdlog::warn("ROS 2: {} messages that came were faulty, too large or too many, and ignored",
                   counts.faulty);
    if (const uint64_t lost = counts.dropped + queue_.missed(); lost > 0)
      spdlog::warn("ROS 2: {} messages were dropped: it did not follow the run", lost);
  }

  void print() const override {
    fmt::print("ROS 2 ({})\n", where_);
    for (const ros2::Topic& topic : node_.outputs())
      fmt::print("  -> {:<32} {}\n", topic.name, topic.type);
    for (const ros2::Topic& topic : node_.inputs())
      fmt::print("  <- {:<32} {}\n", topic.name, topic.type);
    for (const ros2::Topic& service : node_.services())
      fmt::print("  <> {:<32} {}\n", service.name, service.type);
    std::fflush(stdout);
  }

  // Nothing is published before: a controller that came late would miss the first state, and answer
  // with the second.
  void wait_for_peers() override {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point begin = Clock::now();
    Clock::time_point changed = begin;
    bool told = false;
    for (size_t peers = 0; !wait_for_.empty() && !server_.stopping();
         std::this_thread::sleep_for(kLook)) {
      const Clock::time_point now = Clock::now();
      if (const size_t found = node_.peers(); found != peers) peers = found, changed = now;
      const bool ready = node_.is_read() && std::all_of(wait_for_.begin(), wait_for_.end(),
                                                        [&](const std::string& topic) {
                                                          return node_.is_written(topic);
                                                        });
      if (ready && now >= changed + kSettled) return;
      if (told || now < begin + kPatience) continue;
      told = true;
      spdlog::info("ROS 2: the run begins when somebody publishes on {}, and reads a topic of it",
                   fmt::join(wait_for_, ", "));
    }
  }

 private:
  ros2::NodeOptions options(const Ros2Arguments& arguments) {
    ros2::NodeOptions options = node_options(server_, arguments);
    options.losses = [this] { return std::pair(server_.lost(), queue_.missed()); };
    return options;
  }

  run::Run& server_;
  std::vector<std::string> wait_for_;
  std::string where_;
  ros2::Node node_;
  run::QueuedSink queue_;
};

}  // namespace

std::unique_ptr<Ros2Network> Ros2Network::open(const Ros2Arguments& arguments) {
  if (!arguments.on) return nullptr;
  distro_of(arguments);  // before the network is used
  if (const std::string deaf = nodes_that_do_not_hear(); !deaf.empty())
    spdlog::warn("ROS 2: {}", deaf);
  return std::make_unique<CycloneNetwork>();
}

std::string ros2_network() {
  const ros2::Distro distro = distro_of({});
  return fmt::format("{}, {}", ros2::name_of(distro), CycloneNetwork().transport->where());
}

Ros2Pictures ros2_pictures() {
  const dds::PictureCount count = dds::send_pictures_to_self();
  return {count.sent, count.arrived, count.buffer};
}

std::unique_ptr<Ros2Node> Ros2Node::open(run::Run& server, const Ros2Arguments& arguments,
                                         std::unique_ptr<Ros2Network> network) {
  if (!network) return nullptr;
  return std::make_unique<CycloneNode>(server, arguments,
                                       std::move(static_cast<CycloneNetwork&>(*network).transport));
}

#else

namespace {
constexpr const char* kWithout =
    "this ruedo was built without ROS 2. Install cyclonedds-dev, then configure with "
    "-DRUEDO_ROS2=ON and build again";
}  // namespace

std::unique_ptr<Ros2Network> Ros2Network::open(const Ros2Arguments& arguments) {
  if (!arguments.on) return nullptr;
  throw EnvironmentError(kWithout);
}

std::unique_ptr<Ros2Node> Ros2Node::open(run::Run&, const Ros2Arguments&,
                                         std::unique_ptr<Ros2Network>) {
  return nullptr;
}

std::string ros2_network() { throw EnvironmentError(kWithout); }

Ros2Pictures ros2_pictures() { throw EnvironmentError(kWithout); }

#endif

}  // namespace ruedo::cli
