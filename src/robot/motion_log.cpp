// The queue of states to be shown.
#include "robot/motion_log.h"

#include <algorithm>

namespace ruedo::robot {

void MotionLog::set(const MotionState& state) { current_ = state; }

void MotionLog::mention(const MotionState& state) {
  if (mentioned_ < kMentions) mentions_[mentioned_++] = state;
}

void MotionLog::advance() {
  const int64_t changes = shown_.changes;
  if (mentioned_ > 0) {
    shown_ = mentions_[0];
    std::move(mentions_.begin() + 1, mentions_.begin() + static_cast<std::ptrdiff_t>(mentioned_), mentions_.begin());
    --mentioned_;
    shown_.changes = changes + 1;
    return;
  }
  const bool changed = shown_.id != current_.id || shown_.kind != current_.kind || shown_.state != current_.state ||
                       shown_.reason != current_.reason;
  shown_ = current_;
  shown_.changes = changes + (changed ? 1 : 0);
}

}  // namespace ruedo::robot
