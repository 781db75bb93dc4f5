// A program that reads untrusted files in a process of its own, with limits on time and memory, and
// the folder that it writes to.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <sys/resource.h>

#include "core/leftovers.h"

namespace ruedo::model {

// A new folder in the system's temporary folder; removed with its contents.
class TemporaryFolder {
 public:
  // Throws std::runtime_error.
  explicit TemporaryFolder(const std::string& purpose);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string operator/(const char* name) const { return path_ + "/" + name; }

 private:
  std::string path_;
  std::optional<Leftover> leftover_;
};

struct ProcessLimits {
  rlim_t cpu_s = 0;
  rlim_t file_bytes = 0;    // size limit of each file that it writes
  rlim_t memory_bytes = 0;  // address space; 0: no limit
  int wall_s = 0;
};

// Runs words[0], found in PATH, in a process group of its own. Its stderr goes to the file `log`;
// stdin and stdout are closed off. Returns the status as waitpid() gives it, with exit code 127 if
// there is no such program; nullopt if it ran out of wall time, or if `give_up`, which is polled
// every 20 ms, returned true: it was then killed with its children. Throws std::runtime_error.
std::optional<int> run_limited(std::vector<std::string> words, const std::string& log,
                               const ProcessLimits& limits,
                               const std::function<bool()>& give_up = nullptr);

}  // namespace ruedo::model
