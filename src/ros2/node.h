// A run as a ROS 2 node: what the run publishes goes out as ROS messages, commands come in.
//
// offer() and state() are the publisher's: they copy what somebody reads and return; all else is done by the node's own
// thread. When that cannot follow, the oldest messages are dropped and counted. Nothing here reaches the run but through
// `inject`, as if it had come over the bus.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "ros2/commands.h"
#include "ros2/conversions.h"
#include "ros2/transport.h"

namespace ruedo::ros2 {

struct NodeOptions {
  ConversionOptions conversion;
  double clock_hz = 100.0;      // of sim time, at most
  JointNames joints = [](const std::string&) { return std::vector<std::string>(); };
};

class Node {
 public:
  using Inject = std::function<void(const std::string& channel, std::span<const uint8_t> message)>;

  static constexpr size_t kMostQueued = size_t{64} << 20;    // bytes

  // info: of the run as it begins. Throws InputError for a remap of nothing, EnvironmentError.
  Node(NodeOptions options, std::unique_ptr<Transport> transport, const std::vector<world_info_t>& info, Inject inject);
  ~Node();

  void start();
  void stop();    // inject is not called any more

  // A message of the run; sim time has come to a state. The publisher's thread.
  void offer(const std::string& channel, const uint8_t* data, size_t size);
  void state(int64_t utime);

  struct Counts {
    uint64_t sent = 0, received = 0, dropped = 0, faulty = 0;
  };
  Counts counts() const { return {sent_, received_, dropped_, faulty_}; }
  std::vector<Topic> outputs() const;
  std::vector<Topic> inputs() const;

 private:
  struct Item {
    int64_t clock = -1;                    // or a message:
    std::string channel;
    std::vector<uint8_t> bytes;
  };

  void work();
  void handle(const Item& item);
  void handle_info(const Item& item);
  void take_over(const std::vector<world_info_t>& info);    // of robots that have come or gone
  void add_commands(const std::vector<world_info_t>& info);
  void update_wanted();
  void announce();                                          // ros_discovery_info
  void receive(const Command& command, std::span<const uint8_t> cdr);
  void send(Writer& writer, std::span<const uint8_t> cdr);
  Endpoint endpoint(const Topic& topic, Role role = Role::topic) const;

  NodeOptions options_;
  std::unique_ptr<Transport> transport_;
  Inject inject_;
  Names names_;

  // The node's thread's.
  std::unique_ptr<Conversions> conversions_;
  std::map<std::string, std::unique_ptr<Writer>> writers_;    // by name and type
  std::vector<Writer*> writer_of_topic_;
  Topic clock_topic_, static_frames_topic_;
  std::unique_ptr<Writer> clock_, static_frames_, graph_;
  std::map<std::string, std::unique_ptr<Reader>> readers_;
  std::map<std::string, Command> commands_;                   // by name and type
  std::vector<world_info_t> info_, parts_;
  std::string info_channel_;
  int64_t clock_period_us_;

  mutable std::mutex mutex_;    // of what follows
  std::condition_variable wake_;
  std::deque<Item> queue_;
  size_t queued_ = 0;           // bytes
  std::unordered_map<std::string, bool> wanted_;    // channels; looked up only
  int64_t next_clock_us_ = 0;
  bool stopping_ = false;

  std::atomic<bool> injecting_{false};
  std::atomic<uint64_t> sent_{0}, received_{0}, dropped_{0}, faulty_{0};
  std::atomic<int64_t> last_warning_ns_{0};
  std::thread thread_;
};

}  // namespace ruedo::ros2
