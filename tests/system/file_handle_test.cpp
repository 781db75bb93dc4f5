// Writing all of some bytes: through a pipe that signals interrupt, and to a full disk.
#include "system/file_handle.h"

#include <cerrno>
#include <string>
#include <thread>

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>

#include <gtest/gtest.h>

namespace ruedo {
namespace {

// A signal without SA_RESTART ends a blocked write() with EINTR, or after a part of the bytes. The
// reader sends one before each of its reads, while the pipe is full.
TEST(WriteAll, WritesOnWhereASignalInterruptsIt) {
  struct sigaction action{}, before{};
  action.sa_handler = [](int) {};
  ASSERT_EQ(::sigaction(SIGUSR1, &action, &before), 0);
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const FileHandle from(ends[0]), to(ends[1]);
  std::string bytes(1'000'000, '.');
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i % 251);
  std::string got;
  const pthread_t writer = ::pthread_self();
  std::thread reader([&] {
    char part[10'000];
    while (got.size() < bytes.size()) {
      ::pthread_kill(writer, SIGUSR1);
      const ssize_t count = ::read(from.get(), part, sizeof part);
      ASSERT_GT(count, 0);
      got.append(part, static_cast<size_t>(count));
    }
  });
  EXPECT_EQ(write_all(to.get(), bytes.data(), bytes.size()), bytes.size());
  reader.join();
  EXPECT_EQ(got, bytes);
  ::sigaction(SIGUSR1, &before, nullptr);
}

TEST(WriteAll, ReportsAFullDisk) {
  const FileHandle full(::open("/dev/full", O_WRONLY | O_CLOEXEC));
  ASSERT_TRUE(full);
  EXPECT_EQ(write_all(full.get(), "abc", 3), 0u);
  EXPECT_EQ(errno, ENOSPC);
}

}  // namespace
}  // namespace ruedo
