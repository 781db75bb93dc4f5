// The one place where commands meet ROS 2.
#include "cli/ros2.h"

#include <cstdlib>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "ruedo/errors.h"

#ifdef RUEDO_ROS2

#include "dds/cyclone_transport.h"
#include "model/body_layout.h"
#include "ros2/node.h"
#include "ros2/tap_bus.h"
#include "run/server.h"

namespace ruedo::cli {
namespace {

ros2::Distro distro_of(const Ros2Arguments& arguments) {
  if (!arguments.distro.empty()) return ros2::parse_distro(arguments.distro);
  const char* named = std::getenv("ROS_DISTRO");
  return named && *named ? ros2::parse_distro(named) : ros2::Distro::jazzy;
}

std::vector<std::string> joints_of(const model::WorldModel& world, const std::string& robot) {
  const model::BodyLayout layout(world);
  std::vector<std::string> names;
  for (const model::RobotPlacement& placement : layout.robots) {
    const model::ModelInstance& instance = world.models[static_cast<size_t>(placement.instance)];
    if (instance.name != robot || instance.removed) continue;
    for (const int joint : placement.joints) names.push_back(instance.model->joints[static_cast<size_t>(layout.joints[static_cast<size_t>(joint)].joint)].name);
  }
  return names;
}

void print_topics(const ros2::Node& node, const std::string& where) {
  fmt::print("ROS 2 ({})\n", where);
  for (const ros2::Topic& topic : node.outputs()) fmt::print("  -> {:<32} {}\n", topic.name, topic.type);
  for (const ros2::Topic& topic : node.inputs()) fmt::print("  <- {:<32} {}\n", topic.name, topic.type);
  std::fflush(stdout);
}

}  // namespace

struct Ros2Bus::Impl {
  ros2::NodeOptions options;
  dds::CycloneOptions network;
  ros2::TapBus tap;
};

Ros2Bus::Ros2Bus(Bus& bus, const Ros2Arguments& arguments) : inner_(bus) {
  if (!arguments.on) return;
  impl_.reset(new Impl{{}, dds::options_from_environment(), ros2::TapBus(bus)});
  impl_->options.conversion.distro = distro_of(arguments);
  impl_->options.clock_hz = arguments.clock_hz;
}

Ros2Bus::~Ros2Bus() = default;

Bus& Ros2Bus::bus() { return impl_ ? impl_->tap : inner_; }

std::shared_ptr<void> Ros2Bus::open(run::Server& server, std::vector<std::pair<std::string, std::string>> topics,
                                    std::vector<std::pair<std::string, std::string>> channels) {
  if (!impl_) return nullptr;
  ros2::NodeOptions options = impl_->options;
  size_t robots = 0;
  for (const world_info_t& part : server.info()) robots += part.robots.size();
  options.conversion.many = robots > 1;
  options.conversion.topics = std::move(topics);
  options.conversion.channels = std::move(channels);
  options.joints = [&server](const std::string& robot) { return joints_of(*server.world(), robot); };
  auto transport = dds::open_cyclone(impl_->network);
  const std::string where = fmt::format("{}, {}", ros2::name_of(options.conversion.distro), transport->where());
  auto node = std::make_shared<ros2::Node>(std::move(options), std::move(transport), server.info(),
                                           [tap = &impl_->tap](const std::string& channel, std::span<const uint8_t> message) { tap->inject(channel, message); });
  print_topics(*node, where);
  node->start();
  impl_->tap.attach(node.get());
  server.on_state([node = node.get()](const Snapshot& snapshot) { node->state(snapshot.time); });
  return {node.get(), [node, tap = &impl_->tap](void*) {
            tap->attach(nullptr);
            node->stop();
            const ros2::Node::Counts counts = node->counts();
            if (counts.dropped > 0) spdlog::warn("ROS 2: {} messages were dropped: readers, or the node itself, did not follow", counts.dropped);
          }};
}

}  // namespace ruedo::cli

#else

namespace ruedo::cli {

struct Ros2Bus::Impl {};

Ros2Bus::Ros2Bus(Bus& bus, const Ros2Arguments& arguments) : inner_(bus) {
  if (arguments.on) {
    throw EnvironmentError("this ruedo was built without ROS 2. Install cyclonedds-dev, then configure with -DRUEDO_ROS2=ON and build again");
  }
}

Ros2Bus::~Ros2Bus() = default;

Bus& Ros2Bus::bus() { return inner_; }

std::shared_ptr<void> Ros2Bus::open(run::Server&, std::vector<std::pair<std::string, std::string>>, std::vector<std::pair<std::string, std::string>>) {
  return nullptr;
}

}  // namespace ruedo::cli

#endif
