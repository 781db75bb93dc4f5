// Confines this process: its access to files by Landlock, its system calls by seccomp. Reports
// parts that the kernel does not support.
//
// For untrusted worlds, meshes and logs: a bug in the code that reads them reaches no file beyond
// those that it needs.
#pragma once

#include <string>
#include <vector>

#include <linux/filter.h>

#include "system/file_handle.h"

namespace ruedo {

struct Sandbox {
  // Files, and folders with all below them. Missing ones are ignored.
  std::vector<std::string> readable{};
  std::vector<std::string> runnable{};  // and readable: programs
  std::vector<std::string> writable{};  // and readable
  // The files that every program reads and may run: the system's libraries, and Ruedo's own files.
  // Without it, no program runs either.
  bool system = true;
  // No network, no further process, no signal to others, no other owner, mode or time of a file.
  bool alone = false;
};

// The parts that this kernel lacks; "": none.
std::string missing_for_sandbox();

// From now on, for this thread and all threads and programs that it starts; nothing takes it back.
// Begin with it: threads that run already stay outside. Where the kernel lacks a part, the others
// hold; ask missing_for_sandbox() first where that will not do. Throws EnvironmentError when the
// kernel refuses what it says to have.
void enter(const Sandbox& sandbox);

// A sandbox that a child enters between fork and exec.
class ReadySandbox {
 public:
  explicit ReadySandbox(const Sandbox& sandbox);  // throws as enter()
  // System calls only. False where the kernel refuses it: errno says why.
  bool enter() const;

 private:
  FileHandle ruleset_;               // of Landlock; none where the kernel has none
  std::vector<sock_filter> filter_;  // of seccomp; likewise
};

}  // namespace ruedo
