// One list for the whole process, since warnings come from everywhere.
#include "base/warnings.h"

#include <algorithm>
#include <mutex>

namespace ruedo {
namespace {

std::mutex mutex;
std::vector<Warning>& kept() {
  static std::vector<Warning> warnings;
  return warnings;
}

}  // namespace

void keep_warning(std::string kind, std::string text) {
  const std::lock_guard lock(mutex);
  std::vector<Warning>& warnings = kept();
  if (warnings.size() >= kMostWarnings) return;
  if (warnings.size() + 1 == kMostWarnings) text = "The terminal has further warnings.";
  warnings.push_back({std::move(kind), std::move(text)});
}

std::vector<Warning> warnings_from(size_t first) {
  const std::lock_guard lock(mutex);
  const std::vector<Warning>& warnings = kept();
  const size_t begin = std::min(first, warnings.size());
  return {warnings.begin() + static_cast<std::ptrdiff_t>(begin), warnings.end()};
}

}  // namespace ruedo
