// What is called at the program's end, and the count of ends under way.
#include "ends.h"

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <set>

#include "forked.h"

namespace ruedo::client {
namespace {

constexpr std::chrono::seconds kPatience(10);

struct Called {
  std::mutex mutex;
  std::set<const AtProgramEnd*> all;
};

struct Ends {
  std::mutex mutex;
  std::condition_variable news;
  int under_way = 0;
};

void await_ends() {
  auto& all = of_this_process<Ends>();
  std::unique_lock lock(all.mutex);
  all.news.wait_for(lock, kPatience, [&] { return all.under_way == 0; });
}

}  // namespace

// After the destructors of static objects, whichever were made first: those may end simulations.
[[gnu::destructor]] void call_at_program_end() {
  {
    auto& called = of_this_process<Called>();
    const std::lock_guard lock(called.mutex);
    for (const AtProgramEnd* one : called.all) one->call_();
  }
  await_ends();
}

AtProgramEnd::AtProgramEnd(std::function<void()> call) : call_(std::move(call)) {
  auto& called = of_this_process<Called>();
  const std::lock_guard lock(called.mutex);
  called.all.insert(this);
}

AtProgramEnd::~AtProgramEnd() {
  auto& called = of_this_process<Called>();
  const std::lock_guard lock(called.mutex);
  called.all.erase(this);
}

EndUnderWay::EndUnderWay() {
  auto& all = of_this_process<Ends>();
  const std::lock_guard lock(all.mutex);
  ++all.under_way;
  // Beside an exit() that waits, another thread may return from main(): each takes one of the two.
  std::atexit(await_ends);
}

EndUnderWay::~EndUnderWay() {
  auto& all = of_this_process<Ends>();
  const std::lock_guard lock(all.mutex);
  --all.under_way;
  all.news.notify_all();
}

}  // namespace ruedo::client
