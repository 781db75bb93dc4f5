// The states of a step.
#include "robot/motion_log.h"

namespace ruedo::robot {

void MotionLog::mention(const MotionState& state) {
  shown_ends_ = 0;  // of the step before: already read
  if (new_ends_ < kEnds) ends_[new_ends_++] = state;
}

void MotionLog::advance() {
  const bool changed = shown_.id != current_.id || shown_.kind != current_.kind ||
                       shown_.state != current_.state || shown_.reason != current_.reason;
  const int64_t changes = shown_.changes + static_cast<int64_t>(new_ends_) + (changed ? 1 : 0);
  shown_ = current_;
  shown_.changes = changes;
  shown_ends_ = new_ends_;
  new_ends_ = 0;
}

}  // namespace ruedo::robot
