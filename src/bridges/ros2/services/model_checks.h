// Reads models before the request to spawn them, to report their errors: in a thread of its
// own, one after the other, each under a budget of time and memory.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "bridges/ros2/services/results.h"
#include "world/document/load_budget.h"

namespace ruedo::ros2 {

class ModelChecks {
 public:
  static constexpr size_t kMostWaiting = 32;

  // name: as in the file.
  using Then = std::function<void(const Result& result, const std::string& name)>;

  ModelChecks() = default;
  ~ModelChecks();  // abandons what is left

  // uri: a name or a file, "": text holds the model. Calls `then` once, in the thread, or at once
  // if too many wait.
  void add(std::string uri, std::string text, std::string world_file, Then then);

 private:
  struct Order {
    std::string uri, text, world_file;
    Then then;
  };
  void work();

  std::mutex mutex_;  // of all that follows
  std::condition_variable changed_;
  std::deque<Order> waiting_;
  std::shared_ptr<world::LoadBudget> budget_;  // while a model is read
  bool over_ = false;
  std::thread thread_;  // started with the first order
};

}  // namespace ruedo::ros2
