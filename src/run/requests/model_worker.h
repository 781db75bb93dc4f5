// Prepares the models of SPAWN requests: reads and checks them, and imports their meshes, in a
// thread beside the run.
//
// One after the other, in the order of the requests, each under a budget of time and memory, and
// none before the previous one was added. The publisher adds finished models to the world between
// two steps.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "engine/edits/edits.h"
#include "engine/queue.h"
#include "ruedo/request_t.hpp"
#include "world/document/load_budget.h"

namespace ruedo::run {

class ModelWorker {
 public:
  static constexpr size_t kMostWaiting = 32, kMostOfSession = 2;  // models; more are refused
  static constexpr auto kTime = std::chrono::seconds(30);         // for a model
  static constexpr size_t kMeshBytes = size_t{512} << 20;         // of a model

  struct Order {
    request_t request;
    spawn_request_t body;
  };
  struct Made : Order {
    world::LoadedModel loaded;
    std::string fault;  // "": there is a model
  };

  // ready: set whenever take() may have something. before: called in the worker's thread before
  // each model; may be empty. Both, and the store, must outlive it.
  ModelWorker(engine::ModelStore& store, engine::Wakeup& ready, std::function<void()> before);
  ~ModelWorker();  // abandons what is left

  // For the publisher's thread, as is take_made(). The outcome is pending, or a refusal.
  engine::Outcome add(Order order);
  std::optional<Made> take_made();
  // Makes no model of an order for which that is false.
  void keep(const std::function<bool(const request_t&)>& wanted);

 private:
  void work();
  Made make(Order order);

  engine::ModelStore& store_;
  engine::Wakeup& ready_;
  const std::function<void()> before_;
  std::mutex mutex_;  // of all that follows
  std::condition_variable changed_;
  std::deque<Order> waiting_;
  std::shared_ptr<world::LoadBudget> budget_;  // while the first is being made
  std::optional<Made> made_;
  bool over_ = false;
  std::thread thread_;  // started with the first order
};

}  // namespace ruedo::run
