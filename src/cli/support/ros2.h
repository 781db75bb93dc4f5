// --ros2: a run as a ROS 2 node. Without Cyclone DDS in this build it says what is missing.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "run/wait_for.h"
#include "world/model/world_model.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace ruedo::run {
class Run;
}

namespace ruedo::cli {

struct Ros2Arguments {
  bool on = false;
  std::string distro;  // "": $ROS_DISTRO, or jazzy
  double clock_hz = 100.0;
  std::string stamped;                                        // "on", "off"; "": by the release
  std::string services = "auto";                              // how they are mapped
  std::string tf = "both";                                    // ros2::parse_tf_layout()
  std::vector<std::pair<std::string, std::string>> topics;    // --remap of ROS names
  std::vector<std::pair<std::string, std::string>> channels;  // of the bus's
  std::vector<std::string> wait_for;                          // ROS topics on which the run waits
};

// --ros2, which it returns, and the options that go with it.
CLI::Option* add_ros2_options(CLI::App& command, Ros2Arguments& arguments);

// The arguments with ROS's names, which begin with a slash, of --remap and --wait-for; the others
// of --remap are the bus's. Throws InputError for such names without --ros2.
Ros2Arguments with_names(Ros2Arguments arguments, const std::vector<std::string>& remaps,
                         const std::vector<run::WaitForOption>& wait_for);

// Where a node takes part.
class Ros2Network {
 public:
  // Null without --ros2. Before a run is made, whose log empties an earlier one. Throws as
  // Ros2Node::open().
  static std::unique_ptr<Ros2Network> open(const Ros2Arguments& arguments);
  virtual ~Ros2Network() = default;
};

// A node, from its making on; the run's messages come to it once it is attached.
class Ros2Node {
 public:
  // Null without a network. Throws InputError, and EnvironmentError if this build has no Cyclone
  // DDS or no network for it exists.
  static std::unique_ptr<Ros2Node> open(run::Run& server, const Ros2Arguments& arguments,
                                        std::unique_ptr<Ros2Network> network);

  virtual ~Ros2Node() = default;   // after the run, before the server
  virtual void print() const = 0;  // the topics

  // Returns when each topic that the run waits for has a publisher, and a reader of this
  // run; or the run is to end.
  virtual void wait_for_peers() = 0;
};

// Where a node would take part by the environment: "jazzy, domain 0, this machine only". Throws as
// Ros2Node::open().
std::string ros2_network();

// Sends raw pictures to a best-effort reader of its own over DDS, for some seconds: how many
// arrived, and with which buffer (bridges/dds/self_test.h). Throws EnvironmentError.
struct Ros2Pictures {
  int sent = 0, arrived = 0, buffer = 0;
};
Ros2Pictures ros2_pictures();

// Why nodes of this environment would not hear a run; "": they would.
std::string nodes_that_do_not_hear();

// The input channel of each ROS topic among --wait-for. Throws InputError for a topic without
// commands.
std::vector<run::WaitForOption> with_channels(std::vector<run::WaitForOption> options,
                                              const world::WorldModel& world,
                                              const Ros2Arguments& arguments);

}  // namespace ruedo::cli
