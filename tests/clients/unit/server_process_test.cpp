// The process of a private server, beside what its program does with processes.
#include "server_process.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

using namespace ruedo::client;
namespace fs = std::filesystem;

namespace {

// With a server that ends, as Ruedo's does, when its standard input does.
class ServerProcesses : public testing::Test {
 protected:
  ServerProcesses() {
    unsetenv("RUEDO");
    options.program = folder / "server";
    options.url = "udpm://239.255.76.67:7667?ttl=0";
    std::ofstream(options.program) << "#!/bin/sh\nread never\nexit 7\n";
    fs::permissions(options.program, fs::perms::owner_all);
  }
  ~ServerProcesses() override { fs::remove_all(folder); }

  static std::string ended(ServerProcess& server) {
    server.end();
    const std::string how = server.ended().value();
    return how.substr(0, how.find(':'));
  }

  const fs::path folder = [] {
    std::string name = fs::temp_directory_path() / "ruedo-test-XXXXXX";
    return fs::path(mkdtemp(name.data()));
  }();
  LaunchOptions options;
};

TEST_F(ServerProcesses, AForksChildKeepsNoneAlive) {
  ServerProcess server("world", options);
  const pid_t child = fork();
  if (child == 0) {
    pause();
    _exit(0);
  }
  EXPECT_EQ(ended(server), "the server ended (exit code 7)");
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
}

TEST_F(ServerProcesses, OneThatIsAwaitedElsewhereHasEnded) {
  signal(SIGCHLD, SIG_IGN);
  ServerProcess server("world", options);
  EXPECT_EQ(ended(server), "the server ended (exit code unknown)");
  signal(SIGCHLD, SIG_DFL);
}

}  // namespace
