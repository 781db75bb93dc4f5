#include "system/leftovers.h"

#include <csignal>
#include <filesystem>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

namespace ruedo {
namespace {

std::mutex mutex;
std::multiset<std::string>& marked() {
  static auto* const paths = new std::multiset<std::string>;  // outlives every thread
  return *paths;
}

std::set<pid_t>& groups() {
  static auto* const ids = new std::set<pid_t>;
  return *ids;
}

}  // namespace

Leftover::Leftover(std::string path) : path_(std::move(path)) {
  const std::lock_guard lock(mutex);
  marked().insert(path_);
}

Leftover::~Leftover() {
  const std::lock_guard lock(mutex);
  marked().erase(marked().find(path_));
}

LeftoverGroup::LeftoverGroup(pid_t group) : group_(group) {
  const std::lock_guard lock(mutex);
  groups().insert(group_);
}

LeftoverGroup::~LeftoverGroup() {
  const std::lock_guard lock(mutex);
  groups().erase(group_);
}

void remove_leftovers() {
  const std::lock_guard lock(mutex);
  for (const pid_t group : groups()) ::kill(-group, SIGKILL);
  std::error_code error;
  for (const std::string& path : marked()) std::filesystem::remove_all(path, error);
}

}  // namespace ruedo
