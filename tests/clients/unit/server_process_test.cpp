// The process of a private server, beside what its program does with processes.
#include "server_process.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

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
    set_program("");
  }
  ~ServerProcesses() override { fs::remove_all(folder); }

  // first: what its program does before it reads its standard input to the end.
  void set_program(const std::string& first) const {
    std::ofstream(options.program) << "#!/bin/sh\n" << first << "\ncat > " << told << "\nexit 7\n";
    fs::permissions(options.program, fs::perms::owner_all);
  }

  static std::string ended(ServerProcess& server) {
    server.end();
    const std::string how = server.ended().value();
    return how.substr(0, how.find(':'));
  }

  const fs::path folder = [] {
    std::string name = fs::temp_directory_path() / "ruedo-test-XXXXXX";
    return fs::path(mkdtemp(name.data()));
  }();
  const fs::path told = folder / "told";
  LaunchOptions options;
};

TEST_F(ServerProcesses, AForkedChildKeepsNoServerAlive) {
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

TEST_F(ServerProcesses, AServerReapedElsewhereCountsAsEnded) {
  signal(SIGCHLD, SIG_IGN);
  ServerProcess server("world", options);
  EXPECT_EQ(ended(server), "the server ended (exit code unknown)");
  signal(SIGCHLD, SIG_DFL);
}

TEST_F(ServerProcesses, TellsTheServerThisClientsProgress) {
  ServerProcess server("world", options);
  server.tell("0 20000 40000\n");
  EXPECT_EQ(ended(server), "the server ended (exit code 7)");
  server.tell("0 20000 50000\n");  // without a reader, and no signal comes
  std::ifstream in(told);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "0 20000 40000\n");
}

TEST_F(ServerProcesses, AServerThatReadsNothingDelaysNoClient) {
  set_program("sleep 1");
  ServerProcess server("world", options);
  for (int i = 0; i < 100'000; ++i) server.tell("0 " + std::to_string(i) + " 0\n");
  EXPECT_FALSE(server.ended());  // it sleeps still
  EXPECT_EQ(ended(server), "the server ended (exit code 7)");
}

TEST_F(ServerProcesses, ReportsEachWarningOnce) {
  set_program(
      "echo a result\n"
      "{ echo 'ruedo: info: ready'; echo 'ruedo: a lamp'; echo 'ruedo: a lamp'; } >&2\n"
      "printf 'ruedo: \\033[1ma colour\\nhalf' >&2");
  ServerProcess server("world", options);
  std::vector<std::string> said;
  while (said.size() < 2) {
    for (const std::string& line : server.warnings()) said.push_back(line);
  }
  EXPECT_EQ(said, (std::vector<std::string>{"ruedo: a lamp", "ruedo: ?[1ma colour"}));
  EXPECT_EQ(server.warnings(), std::vector<std::string>{});
}

}  // namespace
