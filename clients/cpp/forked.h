// What was made before a fork is the parent's: in the child its threads do not run, its locks may
// be held for ever, and its server is not the child's to end.
#pragma once

namespace ruedo::client {

// Grows in the child of each fork.
int fork_count();

// Whether this process is another one than that which made it.
class Forked {
 public:
  explicit operator bool() const { return fork_count() != made_at_; }

 private:
  const int made_at_ = fork_count();
};

}  // namespace ruedo::client
