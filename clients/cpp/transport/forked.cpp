// The count of forks, and what is closed in their children.
#include "transport/forked.h"

#include <sys/socket.h>

#include <atomic>
#include <mutex>
#include <set>

namespace ruedo::client {
namespace {

std::atomic<int> forks{0};

struct Pipes {
  std::mutex mutex;  // held during a fork
  std::set<FileHandle*> open;
};

Pipes& pipes() {
  static auto* const all = new Pipes;  // a simulation may be a static object, which goes later
  return *all;
}

int register_handlers() {
  return pthread_atfork([] { pipes().mutex.lock(); }, [] { pipes().mutex.unlock(); },
                        [] {
                          ++forks;
                          for (FileHandle* const end : pipes().open) *end = FileHandle();
                          pipes().open.clear();
                          pipes().mutex.unlock();
                        });
}

}  // namespace

int fork_count() {
  static const int registered = register_handlers();
  return static_cast<void>(registered), forks.load(std::memory_order_relaxed);
}

FileHandle ParentsPipe::open() {
  fork_count();  // its handlers are needed from now on
  const std::lock_guard lock(pipes().mutex);
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return FileHandle();
  end_ = FileHandle(ends[1]);
  pipes().open.insert(&end_);
  return FileHandle(ends[0]);
}

void ParentsPipe::write(std::string_view text) {
  const std::lock_guard lock(pipes().mutex);
  if (end_) ::send(end_.get(), text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
}

void ParentsPipe::close() {
  const std::lock_guard lock(pipes().mutex);
  pipes().open.erase(&end_);
  end_ = FileHandle();
}

}  // namespace ruedo::client
