// The functions called at the program's end, and the count of ends under way.
#include "ends.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>

#include "callbacks/callback_faults.h"
#include "transport/forked.h"

namespace ruedo::client {
namespace {

constexpr std::chrono::seconds kPatience(10), kLeaveTime(3);

struct Called {
  std::mutex mutex;
  std::set<const AtProgramEnd*> all;
  std::atomic<size_t> count = 0;
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

void call_at_program_end() {
  auto& called = of_this_process<Called>();
  const std::lock_guard lock(called.mutex);
  for (const AtProgramEnd* one : called.all) one->call_();
}

namespace {

// In a thread, and for a moment, since an exit() in a signal's handler stands above what was
// interrupted, which may hold a lock for good.
void call_for_a_moment() {
  auto* const done = new std::promise<void>;
  const std::future<void> called = done->get_future();
  try {
    std::thread([done] {
      call_at_program_end();
      done->set_value();
    }).detach();
    called.wait_for(kLeaveTime);
  } catch (const std::system_error&) {  // NOLINT(bugprone-empty-catch): too many threads
  }
}

// After the destructors of static objects, whichever were made first: those may end simulations.
[[gnu::destructor]] void end_of_program() {
  if (of_this_process<Called>().count > 0) call_for_a_moment();
  await_ends();
  if (!print_unthrown_faults()) return;
  std::fflush(nullptr);
  std::_Exit(EXIT_FAILURE);  // no other way gives an exit code here
}

}  // namespace

AtProgramEnd::AtProgramEnd(std::function<void()> call) : call_(std::move(call)) {
  auto& called = of_this_process<Called>();
  const std::lock_guard lock(called.mutex);
  called.all.insert(this);
  called.count = called.all.size();
}

AtProgramEnd::~AtProgramEnd() {
  auto& called = of_this_process<Called>();
  const std::lock_guard lock(called.mutex);
  called.all.erase(this);
  called.count = called.all.size();
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
