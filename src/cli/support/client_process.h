// A command line of the user's, run beside a simulation: with LCM_DEFAULT_URL in its environment,
// in a process group of its own, and ended with this program, however that ends.
#pragma once

#include <atomic>
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
  // Runs `command` by the shell, with the variables ("NAME=VALUE") added to the environment.
  // `ended` is called, from a thread of its own, when it ends. Throws EnvironmentError when there
  // are no processes.
  ClientProcess(const std::string& command, const std::vector<std::string>& variables,
                std::function<void()> ended);
  ~ClientProcess();

  // Asks it to end, and kills it when it has not ended after some seconds. True when it had already
  // ended by itself.
  bool end();

  // Waits until it has ended by itself.
  void wait();

  // What is wrong with how it ended: "exit code 3", "signal 11"; "" for exit code 0. After end() or
  // wait().
  std::string fault() const;

 private:
  pid_t pid_ = -1;
  std::atomic<bool> over_{false};
  int status_ = 0;
  std::optional<LeftoverGroup> leftover_;
  std::thread waiter_;
};

}  // namespace ruedo::cli
