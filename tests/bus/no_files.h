// This process has no file descriptor left, until the end of the object.
#pragma once

#include <chrono>
#include <ctime>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
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

// A server of this process, at that address, has no descriptor for a connection: it waits, and
// does not retry all the time.
template <class Address>
void newcomer_costs_nothing(int newcomer, const Address& address) {
  const NoFiles none;
  ASSERT_EQ(::connect(newcomer, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  const std::clock_t before = std::clock();
  std::this_thread::sleep_for(std::chrono::seconds(2));
  EXPECT_LT(std::clock() - before, CLOCKS_PER_SEC / 5);  // of the processor's time
}
