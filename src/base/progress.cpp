#include "base/progress.h"

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

namespace ruedo {
namespace {

struct Board {
  std::mutex mutex;
  std::vector<const Progress*> running;  // in the order in which they began
  std::function<void()> watcher;
};

Board& board() {
  static Board one;
  return one;
}

// Changes the running task, and notifies the watcher, which may read it again.
template <class Change>
void tell(Change change) {
  std::function<void()> watcher;
  {
    const std::lock_guard lock(board().mutex);
    change(board().running);
    watcher = board().watcher;
  }
  if (watcher) watcher();
}

}  // namespace

Progress::Progress(std::string what, int64_t whole) : what_(std::move(what)), whole_(whole) {
  tell([this](auto& running) { running.push_back(this); });
}

Progress::~Progress() {
  tell([this](auto& running) { std::erase(running, this); });
}

std::optional<Progress::State> Progress::latest() {
  const std::lock_guard lock(board().mutex);
  if (board().running.empty()) return {};
  const Progress& last = *board().running.back();
  return State{last.what_, last.done_.load(std::memory_order_relaxed), last.whole_, last.begin_};
}

void Progress::watch(std::function<void()> watcher) {
  const std::lock_guard lock(board().mutex);
  board().watcher = std::move(watcher);
}

}  // namespace ruedo
