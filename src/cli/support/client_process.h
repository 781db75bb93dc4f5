// A command line of the user's, run beside a simulation: with LCM_DEFAULT_URL in its environment,
// in a process group of its own, and ended with this program, however that ends.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <sys/types.h>

#include "system/leftovers.h"

namespace ruedo::cli {

class ClientProcess {
 public:
  // Runs `command` by bash, with the variables ("NAME=VALUE") added to the environment, and with
  // the descriptors of `inherited` open. The exit code of each part counts: the first command that
  // fails ends it (`set -e`); a pipeline fails as one of its programs does; background processes
  // are waited for. `ended` is called, from a thread of its own, when it ends. Throws
  // EnvironmentError if no process can be started.
  ClientProcess(const std::string& command, const std::vector<std::string>& variables,
                std::function<void()> ended, const std::vector<int>& inherited = {});
  ~ClientProcess();

  bool is_over() const { return over_; }

  // Ends it: it may end by itself for half of that time, then it gets SIGTERM, and SIGKILL when the
  // time is over.
  void end(std::chrono::duration<double> grace);

  // Waits until it has ended by itself.
  void wait();

  // The fault of its end: "exit code 3", "signal 11"; "" for exit code 0, and if it obeyed
  // SIGTERM. After end() or wait().
  std::string fault() const;
  bool was_told_to_end() const { return told_; }
  bool was_killed() const { return killed_; }

 private:
  void wait_until(std::chrono::steady_clock::time_point time) const;
  void reap();

  pid_t pid_ = -1;
  std::atomic<bool> over_{false};
  bool told_ = false, killed_ = false;
  int status_ = 0;
  std::optional<LeftoverGroup> leftover_;
  std::thread waiter_;
};

}  // namespace ruedo::cli
