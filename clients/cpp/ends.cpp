// The count of ends under way.
#include "ends.h"

#include <pthread.h>

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace ruedo::client {
namespace {

constexpr std::chrono::seconds kPatience(10);

struct Ends {
  std::mutex mutex;
  std::condition_variable news;
  int under_way = 0;
};

// Outlives every static object of the program's. A fork's child has its own.
Ends*& ends() {
  static auto* all = new Ends;
  static const int registered = pthread_atfork(nullptr, nullptr, [] { ends() = new Ends; });
  return static_cast<void>(registered), all;
}

// After the destructors of static objects, whichever were made first: those may end simulations.
[[gnu::destructor]] void await_ends() {
  Ends& all = *ends();
  std::unique_lock lock(all.mutex);
  all.news.wait_for(lock, kPatience, [&] { return all.under_way == 0; });
}

}  // namespace

EndUnderWay::EndUnderWay() {
  const std::lock_guard lock(ends()->mutex);
  ++ends()->under_way;
}

EndUnderWay::~EndUnderWay() {
  const std::lock_guard lock(ends()->mutex);
  --ends()->under_way;
  ends()->news.notify_all();
}

}  // namespace ruedo::client
