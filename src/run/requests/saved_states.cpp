// A short list: looked through for each request.
#include "run/requests/saved_states.h"

#include <algorithm>
#include <utility>

#include <sys/stat.h>

namespace ruedo::run {

SavedStates::Identity SavedStates::identity_of(const std::string& path) {
  struct stat file{};
  if (::stat(path.c_str(), &file) != 0) return {};
  return {file.st_dev, file.st_ino, file.st_size,
          file.st_ctim.tv_sec * 1'000'000'000 + file.st_ctim.tv_nsec};
}

void SavedStates::keep(const std::string& path, SavedState state) {
  forget(path);
  kept_.push_back({path, identity_of(path), std::move(state)});
  size_t links = 0;
  for (const Kept& one : kept_) links += one.state.world->layout().links.size();
  while (kept_.size() > 1 && (kept_.size() > kMost || links > kMostLinks)) {
    links -= kept_.front().state.world->layout().links.size();
    kept_.pop_front();
  }
}

const SavedState* SavedStates::find(const std::string& path) {
  const auto kept =
      std::find_if(kept_.begin(), kept_.end(), [&](const Kept& one) { return one.path == path; });
  return kept != kept_.end() && kept->identity == identity_of(path) ? &kept->state : nullptr;
}

void SavedStates::forget(const std::string& path) {
  kept_.remove_if([&](const Kept& one) { return one.path == path; });
}

}  // namespace ruedo::run
