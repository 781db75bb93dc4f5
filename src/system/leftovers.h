// Things that a process must not leave behind, however it ends: a socket's name, a child process's
// folder, the processes that a shell has started.
#pragma once

#include <string>

#include <sys/types.h>

namespace ruedo {

// Marks a file or folder for as long as it lives. Removes nothing itself.
class Leftover {
 public:
  explicit Leftover(std::string path);
  ~Leftover();
  Leftover(const Leftover&) = delete;
  Leftover& operator=(const Leftover&) = delete;

 private:
  const std::string path_;
};

// Likewise for a group of processes, which are killed.
class LeftoverGroup {
 public:
  explicit LeftoverGroup(pid_t group);
  ~LeftoverGroup();
  LeftoverGroup(const LeftoverGroup&) = delete;
  LeftoverGroup& operator=(const LeftoverGroup&) = delete;

 private:
  const pid_t group_;
};

// Removes what is marked, before the process ends at once. Not in a signal handler.
void remove_leftovers();

}  // namespace ruedo
