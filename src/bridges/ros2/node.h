// A run as a ROS 2 node: published messages go out as ROS messages, commands come in.
//
// A slow sink: it belongs behind a QueuedSink. It reaches the run only through `inject`, as if from
// the bus.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bridges/ros2/commands.h"
#include "bridges/ros2/messages/conversions.h"
#include "bridges/ros2/messages/diagnostics.h"
#include "bridges/ros2/messages/markers.h"
#include "bridges/ros2/services/requests.h"
#include "bridges/ros2/services/services.h"
#include "bridges/ros2/transport.h"
#include "run/sink.h"

namespace ruedo::ros2 {

struct NodeOptions {
  ConversionOptions conversion;
  double clock_hz = 100.0;  // maximum rate of /clock, in sim time
  bool stamped = false;     // cmd_vel is a TwistStamped
  ServiceMapping mapping = ServiceMapping::automatic;
  JointNames joints = [](const std::string&) { return std::vector<std::string>(); };
  // As it is now; null: not known.
  std::function<std::shared_ptr<const world::WorldModel>()> world = [] {
    return std::shared_ptr<const world::WorldModel>();
  };
  // Messages that the bus lost, and that this node missed; the thread that calls the sink.
  std::function<std::pair<uint64_t, uint64_t>()> losses = [] {
    return std::pair<uint64_t, uint64_t>();
  };
};

class Node : public run::Sink {
 public:
  using Inject = std::function<void(const std::string& channel, std::span<const uint8_t> message)>;

  // info: at the start of the run. Throws InputError for a remap without a match, EnvironmentError.
  Node(NodeOptions options, std::unique_ptr<Transport> transport,
       const std::vector<world_info_t>& info, Inject inject);
  ~Node() override;

  // Commands are accepted from start() to stop().
  void start();
  void stop();

  Hears hears() const override {
    // Of records what clients draw.
    return {.samples = true, .records = true, .services = true, .repeated = false};
  }
  bool wants(const std::string& channel) const override;
  uint64_t audience() const override { return audience_; }
  void announce(const std::shared_ptr<const run::Announcement>& announcement) override;
  void begin_step(const run::Step& step) override;
  void message(const run::Published& message) override;
  void flush() override;

  struct Counts {
    uint64_t sent = 0, received = 0, dropped = 0, faulty = 0;
  };
  Counts counts() const {
    return {sent_, received_, dropped_, faulty_ + services_->faulty() + transport_->refused()};
  }
  // Before the run begins: whether anybody subscribes to a sensor's topic or publishes on a
  // command's, and how many of each.
  bool is_read() const;
  bool is_written(const std::string& topic);
  size_t peers() const;

  std::vector<Topic> outputs() const;
  std::vector<Topic> inputs() const;
  std::vector<Topic> services() const { return services_->list(); }

 private:
  void take_over(const std::vector<world_info_t>& info);  // what there is from now on
  void add_pictures(const std::vector<world_info_t>& info);
  void look_for_readers();  // of pictures
  void look_for_writers();  // of commands of the other type
  struct Input;
  void listen(const std::vector<world_info_t>& info);
  void add_command(std::map<std::string, Input>& inputs, const Command& command);
  void add_input(std::map<std::string, Input>& inputs, Input input, Transport::Handler handler);
  void tell_standing();
  void tell_graph();  // ros_discovery_info
  void on_command(const Command& command, std::span<const uint8_t> cdr);
  void receive_pose(const std::string& robot, const std::string& topic,
                    const Sample& sample);  // initialpose
  bool may_warn();                          // once a second, whatever others send
  void count_faulty(const std::string& topic, const std::string& type, size_t size);
  void send(Writer& writer, std::span<const uint8_t> cdr);
  Endpoint endpoint(const Topic& topic, Role role = Role::topic) const;

  NodeOptions options_;
  std::unique_ptr<Transport> transport_;
  Inject inject_;  // declared before its users
  Names names_;

  // For the thread that calls the sink.
  std::unique_ptr<Conversions> conversions_;
  std::map<std::string, std::unique_ptr<Writer>> writers_;  // by name and type
  std::vector<Writer*> writer_of_topic_;
  Topic clock_topic_, drawn_topic_, diagnostics_topic_;
  std::unique_ptr<Writer> clock_, diagnosed_, graph_;
  Diagnostics diagnostics_;
  std::unique_ptr<DrawnTopic> drawn_;
  int64_t time_us_ = 0;  // sim time
  struct Standing {
    std::unique_ptr<Writer> writer;
    std::vector<uint8_t> cdr;  // the newest
  };
  std::map<std::string, Standing> standing_;  // by name and type
  struct Input {
    Topic topic;
    std::string target;               // a command's channel, a pose's robot
    std::vector<std::string> joints;  // that it commands
    std::unique_ptr<Reader> reader;
  };
  std::map<std::string, Input> inputs_;  // by name and type
  std::vector<Command> others_;          // those that are read while somebody publishes them
  Requests requests_;
  std::unique_ptr<Services> services_;
  std::string reply_channel_;
  int64_t clock_period_us_, next_clock_us_ = 0;
  Requests::Clock::time_point next_look_;

  mutable std::mutex pictures_mutex_;
  std::map<std::string, bool> pictures_;  // channels of pictures, and whether anybody reads them
  std::atomic<uint64_t> audience_{0};

  std::atomic<bool> injecting_{false};
  std::atomic<uint64_t> sent_{0}, received_{0}, dropped_{0}, faulty_{0};
  std::atomic<int64_t> last_warning_ns_{0};
};

}  // namespace ruedo::ros2
