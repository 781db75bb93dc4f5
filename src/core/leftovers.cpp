#include "core/leftovers.h"

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

}  // namespace

Leftover::Leftover(std::string path) : path_(std::move(path)) {
  const std::lock_guard lock(mutex);
  marked().insert(path_);
}

Leftover::~Leftover() {
  const std::lock_guard lock(mutex);
  marked().erase(marked().find(path_));
}

void remove_leftovers() {
  const std::lock_guard lock(mutex);
  std::error_code error;
  for (const std::string& path : marked()) std::filesystem::remove_all(path, error);
}

}  // namespace ruedo
