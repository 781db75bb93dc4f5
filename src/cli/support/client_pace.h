// The progress of a regression's client: the run waits for it, at any rate.
//
// Clients of Ruedo's libraries write their progress to a pipe that they inherit (RUEDO_PROGRESS is
// its descriptor), as a program that launched a server does, with their identity in each line. The
// run waits for the slowest. Before the first line of any client, and after the last writing client
// has ended, the run waits for the next one; it does not wait for a client that writes no line, a
// plain LCM program, once it was heard.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "run/backpressure.h"
#include "system/file_handle.h"

namespace ruedo::run {
class Run;
}

namespace ruedo::cli {

class ClientPace {
 public:
  // waits: the run does not begin before a client was heard. Throws EnvironmentError.
  explicit ClientPace(bool waits);
  ~ClientPace();
  ClientPace(const ClientPace&) = delete;

  int inherited() const { return told_.get(); }  // by the client
  std::string variable() const;                  // of its environment: NAME=VALUE

  void pace(run::Run* run);  // null: from now on it is not paced
  // A command or a request has come from the bus. Any thread.
  void heard();
  bool was_heard() const { return heard_; }

 private:
  using Client = std::pair<int64_t, int64_t>;  // process, number of its connection
  struct Known {
    run::LauncherProgress progress;
    FileHandle process;  // readable when it has ended
  };

  void watch();
  void read_lines();  // with the mutex held, as the next
  void on_line(std::string line);
  void tell();

  FileHandle read_, told_, stop_;
  const bool waits_;
  std::atomic<bool> heard_{false}, holds_{false};
  std::mutex mutex_;
  run::Run* run_ = nullptr;
  std::map<Client, Known> clients_;
  bool followed_ = false;  // the run has their progress
  std::string said_;
  std::thread thread_;
};

}  // namespace ruedo::cli
