// The thread of a module: takes batches in order, runs the module on them, and reports when it is
// done.
#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <string>
#include <thread>

#include "engine/batch.h"
#include "engine/module.h"
#include "engine/queue.h"

namespace ruedo::engine {

class ModuleThread {
 public:
  struct Host {
    Wakeup& finished;                   // set when the last module finishes a batch
    const std::atomic<bool>& left_off;  // once true, samples are no longer wanted
    // For tests: called in the module's thread before each batch.
    std::function<void(const std::string& module)> before_batch;
  };

  // The module must outlive it.
  ModuleThread(Module& module, Host host);
  ~ModuleThread();  // ends the thread; batches in the queue are finished first

  // Starts the thread and waits until the module's scenes are created. Throws what creating them
  // threw.
  void start(const SceneMakers& makers);
  // Between two batches: waits until they are rebuilt; throws what creating them threw.
  void renew_scenes(const SceneMakers& makers);

  bool running() const { return thread_.joinable(); }

  const Module& module() const { return module_; }
  bool has_batches() const { return in_hand_.load(std::memory_order_relaxed) > 0; }
  void set_index(size_t index) { index_ = index; }  // of its output in each batch

  // For the thread that makes batches: passes one on.
  void hand_over(Batch& batch, int64_t last_step);
  // For batches of a few steps: whether processing it would take less time than waking the module's
  // thread, judged by the last one; if so, does it in the caller's thread.
  bool is_quick() const;
  void work_here(Batch& batch, int64_t last_step);

 private:
  void work();
  void work_through(Batch& batch);

  Module& module_;
  Host host_;
  size_t index_ = 0;
  Queue<Batch*> queue_;
  Batch renewal_;  // a marker in the queue: makers_ wait
  const SceneMakers* makers_ = nullptr;
  std::promise<void>* made_ = nullptr;
  std::atomic<int> in_hand_{0};              // batches in its queue
  std::atomic<int64_t> cost_ns_{INT64_MAX};  // of the last batch in which something was due
  std::thread thread_;
};

}  // namespace ruedo::engine
