// A program that reads untrusted files in a process of its own, with limits on time and memory, and
// the folder that it writes to.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <sys/resource.h>

namespace ruedo::model {

// A new folder below the system's temporary one; removed with all that is in it.
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
};

struct ProcessLimits {
  rlim_t cpu_s = 0;
  rlim_t file_bytes = 0;    // of each file that it writes
  rlim_t memory_bytes = 0;  // of addresses; 0: no limit
  int wall_s = 0;
};

// Runs words[0], found as a shell finds it, in a process group of its own, with its error messages
// in the file `log` and no other input and output. The status as waitpid() gives it, with exit code
// 127 where there is no such program; nullopt: it ran out of real time, or `give_up`, which is
// asked every 20 ms, said so, and it was killed with its children. Throws std::runtime_error.
std::optional<int> run_limited(std::vector<std::string> words, const std::string& log,
                               const ProcessLimits& limits,
                               const std::function<bool()>& give_up = nullptr);

}  // namespace ruedo::model
