// Each test enters a sandbox in a child process, because a sandbox cannot be left.
#include "system/sandbox.h"

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "temporary_folder.h"

namespace ruedo {
namespace {

// The result of `action` in a child within the sandbox: 0, or an errno.
int within(const Sandbox& sandbox, const std::function<int()>& action) {
  const pid_t child = fork();
  if (child == 0) {
    enter(sandbox);
    _exit(action());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

int opened(const std::string& path, int flags) {
  const int file = open(path.c_str(), flags, 0600);
  return file < 0 ? errno : (close(file), 0);
}

int connected() {
  const int made = socket(AF_INET, SOCK_DGRAM, 0);
  return made < 0 ? errno : (close(made), 0);
}

int ran(const char* program) {
  const pid_t child = fork();
  if (child < 0) return errno;
  if (child == 0) {
    execl(program, program, static_cast<char*>(nullptr));
    _exit(errno);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WEXITSTATUS(status);
}

class SandboxTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(missing_for_sandbox(), "");
    read_ = folder_.write("read/a.txt", "a");
    written_ = folder_.write("written/a.txt", "a");
    outside_ = folder_.write("outside/a.txt", "a");
    sandbox_.readable = {folder_.path() + "/read", folder_.path() + "/nowhere"};
    sandbox_.writable = {folder_.path() + "/written"};
  }

  TemporaryFolder folder_;
  std::string read_, written_, outside_;
  Sandbox sandbox_;
};

TEST_F(SandboxTest, ReachesTheListedFilesAndNoOthers) {
  for (const bool alone : {false, true}) {
    sandbox_.alone = alone;
    EXPECT_EQ(within(sandbox_, [&] { return opened(read_, O_RDONLY); }), 0);
    EXPECT_EQ(within(sandbox_, [&] { return opened(read_, O_WRONLY); }), EACCES);
    EXPECT_EQ(within(sandbox_, [&] { return opened(written_, O_RDWR | O_TRUNC); }), 0);
    EXPECT_EQ(
        within(sandbox_,
               [&] { return opened(folder_.path() + "/written/new.txt", O_WRONLY | O_CREAT); }),
        0);
    EXPECT_EQ(within(sandbox_, [&] { return opened(outside_, O_RDONLY); }), EACCES);
    EXPECT_EQ(
        within(sandbox_,
               [&] { return opened(folder_.path() + "/outside/new.txt", O_WRONLY | O_CREAT); }),
        EACCES);
    EXPECT_EQ(within(sandbox_, [&] { return opened("/etc/shadow", O_RDONLY); }), EACCES);
    EXPECT_EQ(within(sandbox_, [&] { return unlink(outside_.c_str()) == 0 ? 0 : errno; }), EACCES);
    EXPECT_EQ(within(sandbox_, [&] { return opened("/proc/1/environ", O_RDONLY); }), EACCES);
  }
}

// A symbolic link is followed to its target.
TEST_F(SandboxTest, LinksLeadNowhere) {
  ASSERT_EQ(symlink(outside_.c_str(), (folder_.path() + "/read/link").c_str()), 0);
  EXPECT_EQ(within(sandbox_, [&] { return opened(folder_.path() + "/read/link", O_RDONLY); }),
            EACCES);
}

int executed(const char* program) {
  return execl(program, program, static_cast<char*>(nullptr)), errno;
}

int result(long returned) { return returned < 0 ? errno : 0; }

TEST_F(SandboxTest, AloneItReachesNoOtherProcess) {
  const auto chmod_it = [&] { return result(chmod(read_.c_str(), 0600)); };
  EXPECT_EQ(within(sandbox_, connected), 0);
  EXPECT_EQ(within(sandbox_, [] { return ran("/bin/true"); }), 0);
  EXPECT_EQ(within(sandbox_, chmod_it), 0);
  sandbox_.alone = true;
  EXPECT_EQ(within(sandbox_, connected), EPERM);
  EXPECT_EQ(within(sandbox_, [] { return ran("/bin/true"); }), EPERM) << "no process beside it";
  EXPECT_EQ(within(sandbox_, [] { return executed("/bin/true"); }), 0) << "but instead of it";
  EXPECT_EQ(within(sandbox_,
                   [] {
                     std::thread([] {}).join();
                     return 0;
                   }),
            0);
  EXPECT_EQ(within(sandbox_, [] { return result(kill(getppid(), 0)); }), EPERM);
  EXPECT_EQ(within(sandbox_, [] { return result(tgkill(getppid(), getppid(), 0)); }), EPERM);
  EXPECT_EQ(within(sandbox_, chmod_it), EPERM);
  EXPECT_EQ(
      within(sandbox_, [&] { return result(syscall(452, AT_FDCWD, read_.c_str(), 0600, 0)); }),
      EPERM)
      << "fchmodat2";
  EXPECT_EQ(
      within(sandbox_, [&] { return result(utimensat(AT_FDCWD, read_.c_str(), nullptr, 0)); }),
      EPERM);
  sandbox_.system = false;
  EXPECT_EQ(within(sandbox_, [] { return executed("/bin/true"); }), EPERM);
}

// Its shell would execute that.
TEST_F(SandboxTest, CannotTypeIntoTheTerminal) {
  for (const bool alone : {false, true}) {
    sandbox_.alone = alone;
    EXPECT_EQ(within(sandbox_, [] { return result(ioctl(STDIN_FILENO, TIOCSTI, "x")); }), EPERM);
  }
}

}  // namespace
}  // namespace ruedo
