// The action simulation_interfaces/SimulateSteps, as ROS maps actions: three services and two
// topics. One goal at a time; it takes a step, sends feedback, and takes the next.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "bridges/ros2/services/requests.h"
#include "bridges/ros2/services/service_server.h"

namespace ruedo::ros2 {

class StepAction {
 public:
  // faulty: counts malformed requests. Throws EnvironmentError.
  StepAction(const ServiceContext& context, Requests& requests, std::atomic<uint64_t>& faulty);

  Topic topic() const;  // the action's name and type
  std::vector<const Reader*> readers() const;
  std::vector<const Writer*> writers() const;

 private:
  using Uuid = std::array<uint8_t, 16>;
  // action_msgs/msg/GoalStatus
  enum Status : int8_t {
    unknown = 0,
    executing = 2,
    canceling = 3,
    succeeded = 4,
    canceled = 5,
    aborted = 6
  };
  struct Goal {
    Uuid id{};
    int64_t accepted_ns = 0;  // of this machine's clock
    uint64_t steps = 0, done = 0;
    Status status = executing;
    uint8_t result = 0;
    std::string text;
    std::vector<CallPointer> waiting;  // for the result

    bool is_over() const { return status >= succeeded; }
  };
  static constexpr size_t kMostGoals = 32, kMostWaiting = 32;  // remembered; of a goal

  void send_goal(const CallPointer& call);
  void cancel_goal(const CallPointer& call);
  void get_result(const CallPointer& call);

  // All with mutex_ held, but for step() and stepped().
  Goal* find(const Uuid& id);
  Goal* active();
  void end(Goal& goal, Status status, uint8_t result, const std::string& text);
  void tell_status();
  static void answer_result(const CallPointer& call, Status status, uint8_t result,
                            const std::string& text);

  void step();
  void stepped(const reply_t& reply);

  Requests& requests_;
  std::atomic<uint64_t>& faulty_;
  std::string name_;
  std::unique_ptr<Writer> feedback_, status_;

  std::mutex mutex_;
  std::deque<Goal> goals_;  // the newest last

  std::unique_ptr<ServiceServer> send_goal_, cancel_goal_, get_result_;  // the last: they call
};

}  // namespace ruedo::ros2
