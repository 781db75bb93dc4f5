// Objects made before a fork belong to the parent: in the child their threads do not run, their
// locks may be held for ever, and the child must not end their server.
#pragma once

#include <pthread.h>

#include <string_view>

#include "system/file_handle.h"

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

// One for all of this process. A fork's child begins with a new one: a thread of the parent that
// the child lacks may hold its lock. It outlives every static object, which may still use it.
template <class State>
State& of_this_process() {
  static State* state = new State;
  static const int registered = pthread_atfork(nullptr, nullptr, [] { state = new State; });
  return static_cast<void>(registered), *state;
}

// An end for writing, which no child of a fork keeps open: the reader must notice when this process
// closes it, or ends. It is a socket's, to which writing raises no SIGPIPE.
class ParentsPipe {
 public:
  ParentsPipe() = default;
  ~ParentsPipe() { close(); }
  ParentsPipe(const ParentsPipe&) = delete;
  ParentsPipe& operator=(const ParentsPipe&) = delete;

  FileHandle open();  // the end for reading; none: errno says why
  // Does not wait: it drops the text if the pipe is full or has no reader. Thread safe, as
  // close().
  void write(std::string_view text);
  void close();

 private:
  FileHandle end_;
};

}  // namespace ruedo::client
