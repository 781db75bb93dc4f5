// What was made before a fork is the parent's: in the child its threads do not run, its locks may
// be held for ever, and its server is not the child's to end.
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

// One for all of this process. A fork's child begins with a new one: in the parent's a lock may be
// held, by a thread that is not there. It outlives every static object, which may still use it.
template <class State>
State& of_this_process() {
  static State* state = new State;
  static const int registered = pthread_atfork(nullptr, nullptr, [] { state = new State; });
  return static_cast<void>(registered), *state;
}

// An end for writing, which no child of a fork keeps open: who reads is to know when this process
// closes it, or ends. It is a socket's, to which writing raises no SIGPIPE.
class ParentsPipe {
 public:
  ParentsPipe() = default;
  ~ParentsPipe() { close(); }
  ParentsPipe(const ParentsPipe&) = delete;
  ParentsPipe& operator=(const ParentsPipe&) = delete;

  FileHandle open();  // the end for reading; none: errno says why
  // Does not wait: it drops the text where the pipe is full or nobody reads it. Thread safe, as
  // close().
  void write(std::string_view text);
  void close();

 private:
  FileHandle end_;
};

}  // namespace ruedo::client
