// A private server: on a free port, and ended when this process does, however that ends.
//
// The server watches its standard input (--follow-stdin) and ends when the pipe closes: the kernel
// closes it for a process that was killed, too, and it does not depend on which thread started it,
// as PR_SET_PDEATHSIG does.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "ruedo/client.h"
#include "system/file_handle.h"
#include "transport/forked.h"

namespace ruedo::client {

class ServerProcess {
 public:
  ServerProcess(const std::string& world, const LaunchOptions& options);  // throws LaunchError
  ~ServerProcess();

  const std::string& url() const { return url_; }
  // How the server ended, with the last lines it printed; nothing while it runs. Thread safe, as is
  // end().
  std::optional<std::string> ended();
  bool is_done();  // it has ended with exit code 0
  // How far this client has come (progress.h). Where the pipe is full, a later line says it all.
  void tell(const std::string& line) { stdin_.write(line); }
  std::vector<std::string> warnings();  // of the server since the last call, each once
  // Closes the pipe, which ends the server; kills it when it has not ended after 5 s.
  void end();

 private:
  std::string written(const std::string& text);
  void start(const std::vector<std::string>& command, bool verbose);
  void await_port(Duration timeout);
  bool poll();  // true when it has ended; with the mutex held
  std::string how() const;
  std::string last_lines() const;

  std::string url_, command_;
  std::filesystem::path folder_;  // of the socket, and of a world's text; empty: not made
  std::mutex mutex_;
  pid_t pid_ = -1;
  std::optional<int> status_;  // nothing: it is not known
  bool ended_ = false;
  ParentsPipe stdin_;
  FileHandle output_, token_;  // token_: keeps the port (free_url)
  off_t heard_ = 0;            // bytes of the output that warnings() has read
  std::set<std::string> warned_;
};

}  // namespace ruedo::client
