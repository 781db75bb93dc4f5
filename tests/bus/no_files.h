// This process has no file descriptor left, until the end of the object.
#pragma once

#include <vector>

#include <sys/resource.h>
#include <unistd.h>

class NoFiles {
 public:
  NoFiles() {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    rlimit few = before_;
    few.rlim_cur = 256;
    ::setrlimit(RLIMIT_NOFILE, &few);
    for (int file; (file = ::dup(STDERR_FILENO)) >= 0;) taken_.push_back(file);
  }
  ~NoFiles() {
    for (const int file : taken_) ::close(file);
    ::setrlimit(RLIMIT_NOFILE, &before_);
  }
  NoFiles(const NoFiles&) = delete;
  NoFiles& operator=(const NoFiles&) = delete;

 private:
  rlimit before_{};
  std::vector<int> taken_;
};
