// A program that reads untrusted files in a process of its own, with limits on time and memory.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/resource.h>

#include "system/sandbox.h"

namespace ruedo {

struct ProcessLimits {
  rlim_t cpu_s = 0;
  rlim_t output_bytes = 0;  // of stdout and of stderr
  rlim_t memory_bytes = 0;  // address space; 0: no limit
  int wall_s = 0;
  std::optional<Sandbox> sandbox{};
};

struct ProcessResult {
  // As waitpid() gives it, with exit code 127 if there is no such program, 126 if its sandbox
  // cannot be entered; nullopt if the process was killed because of its wall time or of `give_up`.
  std::optional<int> status;
  std::string output;    // stdout
  std::string messages;  // the end of stderr, 64 KiB at most
};

// Runs words[0], found in PATH, in a process group of its own, with `input` as its stdin. Its
// stdout and stderr stay in memory: a full disk is no fault, and nothing is left behind
// when the two processes are killed. `give_up` is polled every 20 ms; true kills the process and
// its children. Throws EnvironmentError if no process can be started.
ProcessResult run_limited(std::vector<std::string> words, const ProcessLimits& limits,
                          const std::function<bool()>& give_up = nullptr,
                          std::string_view input = {});

}  // namespace ruedo
