// The worker's thread, and the bounds on what waits for it.
#include "run/requests/model_worker.h"

#include <algorithm>
#include <utility>

#include <pthread.h>

#include "ruedo/errors.h"

namespace ruedo::run {

ModelWorker::ModelWorker(engine::ModelStore& store, engine::Wakeup& ready,
                         std::function<void()> before)
    : store_(store), ready_(ready), before_(std::move(before)) {}

ModelWorker::~ModelWorker() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    if (budget_) budget_->leave_off();
  }
  changed_.notify_all();
  thread_.join();
}

engine::Outcome ModelWorker::add(Order order) {
  {
    const std::lock_guard lock(mutex_);
    const auto of_session = std::count_if(
        waiting_.begin(), waiting_.end(),
        [&](const Order& other) { return other.request.session == order.request.session; });
    if (waiting_.size() >= kMostWaiting || static_cast<size_t>(of_session) >= kMostOfSession) {
      return engine::Outcome::refuse(
          reply_t::REFUSED,
          std::to_string(waiting_.size()) + " models are still loading: retry when they are there");
    }
    waiting_.push_back(std::move(order));
    if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
  }
  changed_.notify_all();
  return engine::Outcome::later();
}

std::optional<ModelWorker::Made> ModelWorker::take_made() {
  const std::lock_guard lock(mutex_);
  if (made_) changed_.notify_all();
  return std::exchange(made_, std::nullopt);
}

void ModelWorker::keep(const std::function<bool(const request_t&)>& wanted) {
  const std::lock_guard lock(mutex_);
  auto next = waiting_.begin();
  if (budget_ && !wanted(next++->request)) budget_->leave_off();
  const auto unwanted = [&](const Order& order) { return !wanted(order.request); };
  waiting_.erase(std::remove_if(next, waiting_.end(), unwanted), waiting_.end());
}

void ModelWorker::work() {
  pthread_setname_np(pthread_self(), "models");
  for (;;) {
    Order order;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return over_ || (!waiting_.empty() && !made_); });
      if (over_) return;
      order = waiting_.front();
      budget_ = std::make_shared<world::LoadBudget>(kTime, kMeshBytes);
    }
    Made made = make(std::move(order));
    {
      const std::lock_guard lock(mutex_);
      waiting_.pop_front();
      budget_.reset();
      made_ = std::move(made);
    }
    ready_.set();
  }
}

ModelWorker::Made ModelWorker::make(Order order) {
  Made made{{std::move(order)}, {}, ""};
  if (before_) before_();
  try {
    made.loaded = store_.load(made.body, budget_.get());
  } catch (const std::exception& error) {
    made.fault = error.what();
  }
  // A mesh over the budget may only be left out when the user loads a file, not in a SPAWN.
  if (!budget_->fault().empty())
    made.fault = "the model costs too much to be made ready: " + budget_->fault();
  return made;
}

}  // namespace ruedo::run
