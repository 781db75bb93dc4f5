// Batches and renewals of the scenes share one queue, so that they keep their order.
#include "engine/module_thread.h"

#include <cfenv>
#include <chrono>
#include <utility>

#include <pthread.h>

namespace ruedo::engine {
namespace {

constexpr int64_t kQuickNs = 50'000;
constexpr size_t kQueued = 16;

}  // namespace

ModuleThread::ModuleThread(Module& module, Host host)
    : module_(module), host_(std::move(host)), queue_(kQueued) {}

ModuleThread::~ModuleThread() {
  if (!thread_.joinable()) return;
  queue_.push(nullptr);
  thread_.join();
}

void ModuleThread::start(const SceneMakers& makers) {
  std::promise<void> ready;
  thread_ = std::thread([this, &ready, &makers] {
    pthread_setname_np(pthread_self(), module_.name().substr(0, 15).c_str());
    std::fesetenv(
        // default rounding and denormal modes, whatever libraries did to the parent thread
        FE_DFL_ENV);
    try {
      module_.make_scenes(makers);
      ready.set_value();
    } catch (...) {
      ready.set_exception(std::current_exception());
      return;
    }
    work();
    module_.drop_renderer();  // its context belongs to this thread
  });
  try {
    ready.get_future().get();
  } catch (...) {
    thread_.join();
    throw;
  }
}

void ModuleThread::renew_scenes(const SceneMakers& makers) {
  if (!module_.has_scenes()) return;
  std::promise<void> made;
  makers_ = &makers;
  made_ = &made;
  queue_.push(&renewal_);
  made.get_future().get();
}

void ModuleThread::hand_over(Batch& batch, int64_t last_step) {
  module_.pass(last_step);
  in_hand_.fetch_add(1, std::memory_order_relaxed);
  queue_.push(&batch);
}

// A renderer's context belongs to the module's thread.
bool ModuleThread::is_quick() const {
  return !module_.has_renderer() && in_hand_.load(std::memory_order_acquire) == 0 &&
         cost_ns_.load(std::memory_order_relaxed) < kQuickNs;
}

void ModuleThread::work_here(Batch& batch, int64_t last_step) {
  module_.pass(last_step);
  work_through(batch);
}

void ModuleThread::work() {
  while (Batch* batch = queue_.pop()) {
    if (batch == &renewal_) {
      std::promise<void>* made = made_;
      try {
        module_.make_scenes(*makers_);
        made->set_value();
      } catch (...) {
        made->set_exception(std::current_exception());
      }
      continue;
    }
    work_through(*batch);
    in_hand_.fetch_sub(1, std::memory_order_release);
  }
}

void ModuleThread::work_through(Batch& batch) {
  if (host_.before_batch) host_.before_batch(module_.name());
  const bool due = module_.is_due(batch.first_step + batch.count);
  const auto begin = std::chrono::steady_clock::now();
  try {
    module_.process(batch, batch.outputs[index_], host_.left_off);
  } catch (const std::exception& error) {
    if (!batch.failed.exchange(true))
      batch.failure = "module " + module_.name() + ": " + error.what();
  }
  if (due)
    cost_ns_.store((std::chrono::steady_clock::now() - begin) / std::chrono::nanoseconds(1),
                   std::memory_order_relaxed);
  if (batch.pending.fetch_sub(1, std::memory_order_acq_rel) == 1) host_.finished.set();
}

}  // namespace ruedo::engine
