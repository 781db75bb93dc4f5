// Faults of callbacks, and how a program ends that has not seen them, or whose regression run is
// over.
#include "callbacks/callback_faults.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <set>
#include <utility>

#include "ruedo/client.h"
#include "transport/forked.h"

namespace ruedo::client {
namespace {

struct Unthrown {
  std::mutex mutex;
  std::set<std::shared_ptr<CallbackFaults>> all;
};

std::terminate_handler terminate_otherwise = nullptr;

// An uncaught RunEnded ends the program of a regression run as if it were done.
[[noreturn]] void end_with_the_run() {
  try {
    if (const auto error = std::current_exception()) std::rethrow_exception(error);
  } catch (const RunEnded&) {
    const bool failed = print_unthrown_faults();
    std::fflush(nullptr);
    std::_Exit(failed ? EXIT_FAILURE : EXIT_SUCCESS);
  } catch (...) {  // NOLINT(bugprone-empty-catch): the other handler reports it
  }
  terminate_otherwise();
  std::abort();
}

[[maybe_unused]] const bool ends_with_the_run = [] {
  const char* regress = std::getenv("RUEDO_REGRESS");
  if (!regress || std::strcmp(regress, "1") != 0) return false;
  terminate_otherwise = std::set_terminate(end_with_the_run);
  return true;
}();

}  // namespace

std::string text_of(const std::exception_ptr& fault) {
  try {
    std::rethrow_exception(fault);
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "it threw something other than a std::exception";
  }
}

bool CallbackFaults::keep(std::exception_ptr fault, const std::string& what) {
  {
    const std::lock_guard lock(mutex_);
    if (kept_.fault) return false;
    kept_ = {std::move(fault), what};
  }
  auto& unthrown = of_this_process<Unthrown>();
  const std::lock_guard lock(unthrown.mutex);
  unthrown.all.insert(shared_from_this());
  return true;
}

CallbackFaults::Kept CallbackFaults::take() {
  {
    auto& unthrown = of_this_process<Unthrown>();
    const std::lock_guard lock(unthrown.mutex);
    unthrown.all.erase(shared_from_this());
  }
  const std::lock_guard lock(mutex_);
  return std::exchange(kept_, {});
}

void CallbackFaults::rethrow() {
  {
    const std::lock_guard lock(mutex_);
    if (!kept_.fault) return;
    has_thrown_ = true;
  }
  if (const Kept kept = take(); kept.fault) std::rethrow_exception(kept.fault);
}

void CallbackFaults::print() {
  const Kept kept = take();
  if (!kept.fault) return;
  std::fprintf(stderr, "ruedo: a callback on %s failed: %s\n", kept.what.c_str(),
               text_of(kept.fault).c_str());
  if (has_thrown_) return;
  auto& unthrown = of_this_process<Unthrown>();
  const std::lock_guard lock(unthrown.mutex);
  unthrown.all.insert(shared_from_this());
}

bool print_unthrown_faults() {
  std::set<std::shared_ptr<CallbackFaults>> all;
  {
    auto& unthrown = of_this_process<Unthrown>();
    const std::lock_guard lock(unthrown.mutex);
    all = unthrown.all;
  }
  for (const auto& faults : all) faults->print();
  return !all.empty();
}

}  // namespace ruedo::client
