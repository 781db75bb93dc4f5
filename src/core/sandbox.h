// Confines this process: its access to files by Landlock, its system calls by seccomp. What the
// kernel does not support is reported.
//
// For untrusted worlds, meshes and logs: a bug in the code that reads them reaches no file beyond
// those that it needs.
#pragma once

#include <string>
#include <vector>

namespace ruedo {

struct Sandbox {
  // Files, and folders with all below them. What is not there is passed over.
  std::vector<std::string> readable;  // beside what every program reads: the system's libraries,
                                      // and what comes with Ruedo
  std::vector<std::string> runnable;  // and readable: programs beside the system's and Ruedo's own
  std::vector<std::string> writable;  // and readable
  bool alone =
      false;  // no network, no other program, no signal to others, nothing but the lists above
};

// What this kernel lacks of it: "" is nothing.
std::string missing_for_sandbox();

// From now on, for this thread and all threads and programs that it starts; nothing takes it back.
// Begin with it: threads that run already stay outside. Where the kernel lacks a part, the others
// hold; ask missing_for_sandbox() first where that will not do. Throws EnvironmentError when the
// kernel refuses what it says to have.
void enter(const Sandbox& sandbox);

}  // namespace ruedo
