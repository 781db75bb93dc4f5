// The Unix domain socket: its owner, that nothing is lost, and malicious clients.
#include "bus/unix_server.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <list>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bus/stream_connection.h"
#include "bus/unix_socket.h"
#include "no_files.h"
#include "ruedo/errors.h"

namespace fs = std::filesystem;

namespace ruedo::bus {
namespace {

struct Folder {
  fs::path path;
  Folder() {
    std::string name = (fs::temp_directory_path() / "ruedo-unix-XXXXXX").string();
    path = ::mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path); }
  LcmUrl url(const std::string& name = "bus.sock") const {
    return {"unix", (path / name).string(), 0, ""};
  }
};

// A server that keeps what it hears on "in".
struct Served {
  Folder folder;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> heard;
  UnixServer server{folder.url()};
  Served() {
    server.listen({"in"}, [this](const std::string&, const uint8_t* data, size_t size) {
      const std::lock_guard lock(mutex);
      heard.emplace_back(data, data + size);
      changed.notify_all();
    });
  }
  void publish(const std::string& channel, const std::string& text) {
    server.publish(channel, reinterpret_cast<const uint8_t*>(text.data()), text.size());
  }
  void wait_until_heard(size_t count) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return heard.size() >= count; });
  }
};

struct Client {
  StreamConnection connection;
  std::vector<std::pair<std::string, std::string>> came;
  // Returns when the server has received what follows the subscription, and thus the subscription.
  Client(Served& served, const std::vector<std::string>& channels)
      : connection(connect_unix(served.folder.url().host)) {
    size_t before = 0;
    {
      const std::lock_guard lock(served.mutex);
      before = served.heard.size();
    }
    for (const std::string& channel : channels) connection.subscribe(channel);
    say("in", "subscribed");
    served.wait_until_heard(before + 1);
  }
  void say(const std::string& channel, const std::string& text) {
    EXPECT_TRUE(
        connection.publish(channel, reinterpret_cast<const uint8_t*>(text.data()), text.size()));
  }
  bool receive(int timeout_ms = -1) {
    return connection.receive(timeout_ms,
                              [this](std::string_view channel, const uint8_t* data, size_t size) {
                                came.emplace_back(channel, std::string(data, data + size));
                              });
  }
  void take_until(size_t count) {
    while (came.size() < count && !connection.is_over()) receive();
  }
};

using Messages = std::vector<std::pair<std::string, std::string>>;

TEST(UnixServer, BothWaysInOrder) {
  Served served;
  Client one(served, {"a", "b"}), other(served, {"b"});
  served.publish("a", "1");
  served.publish("c", "nobody's");
  served.publish("b", "2");
  served.publish("a", "3");
  served.server.flush();
  one.take_until(3);
  EXPECT_EQ(one.came, (Messages{{"a", "1"}, {"b", "2"}, {"a", "3"}}));
  other.take_until(1);
  EXPECT_EQ(other.came, (Messages{{"b", "2"}}));
  one.say("in", "x");
  one.say("b", "to the other");  // as on any LCM bus
  served.wait_until_heard(3);
  EXPECT_EQ(served.heard.back(), "x");
  other.take_until(2);
  EXPECT_EQ(other.came.back(), (std::pair<std::string, std::string>{"b", "to the other"}));
}

TEST(UnixServer, KnowsTheSubscribedChannels) {
  const Folder folder;
  UnixServer bus(folder.url());
  bus.listen({"in"}, [](const std::string&, const uint8_t*, size_t) {});
  const auto wait_for_change = [&bus](uint64_t before) {
    while (bus.audience() == before) std::this_thread::yield();
    return bus.audience();
  };
  EXPECT_FALSE(bus.is_heard("a"));
  uint64_t audience = bus.audience();
  {
    StreamConnection connection(connect_unix(folder.url().host));
    connection.subscribe("a");
    audience = wait_for_change(audience);
    EXPECT_TRUE(bus.is_heard("a"));
    EXPECT_FALSE(bus.is_heard("b"));
  }
  wait_for_change(audience);
  EXPECT_FALSE(bus.is_heard("a"));
}

TEST(UnixServer, IsPrivateToItsUser) {
  Served served;
  struct stat status{};
  ASSERT_EQ(::stat(served.folder.url().host.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0600u);
  if (::geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
  fs::permissions(served.folder.path, fs::perms::all);  // and even for one who could open it
  ASSERT_EQ(::chmod(served.folder.url().host.c_str(), 0666), 0);
  const pid_t stranger = ::fork();
  if (stranger == 0) {
    if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(9);
    const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = served.folder.url().host;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    if (::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      ::_exit(8);
    char byte;
    ::_exit(::recv(socket, &byte, 1, 0) == 0 ? 1 : 2);  // it is closed at once
  }
  int ended = 0;
  ::waitpid(stranger, &ended, 0);
  EXPECT_EQ(WEXITSTATUS(ended), 1);
  EXPECT_EQ(served.server.refused(), 1u);
}

TEST(UnixServer, WithoutFileDescriptorsNewcomersWaitAndCostNothing) {
  Served served;
  const FileHandle newcomer(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  served.folder.url().host.copy(address.sun_path, sizeof address.sun_path - 1);
  newcomer_costs_nothing(newcomer.get(), address);
  while (served.server.connections() == 0) std::this_thread::yield();
}

TEST(UnixServer, ASlowClientLosesNothing) {
  Served served;
  Client slow(served, {"bulk"});
  const std::string block(60'000, 'x');
  for (int i = 0; i < 500; ++i) {  // 30 MB: more than any socket's buffer
    served.publish("bulk", std::to_string(i) + block);
    if (i % 10 == 0) served.server.flush();
  }
  served.server.flush();
  EXPECT_EQ(served.server.failed(), 0u);
  slow.take_until(500);
  ASSERT_EQ(slow.came.size(), 500u);
  for (int i = 0; i < 500; ++i) ASSERT_EQ(slow.came[i].second, std::to_string(i) + block) << i;
}

// 3 000 rounds of "state", "event" and "bulk" for a client that takes nothing meanwhile.
Messages flooded(Served& served, Client& slow) {
  const std::string block(2'000, 'x');
  for (int i = 0; i < 3'000; ++i) {  // 6 MB
    served.publish("state", std::to_string(i));
    if (i % 100 == 0) served.publish("event", std::to_string(i));
    served.publish("bulk", std::to_string(i) + block);
    served.server.flush();
  }
  served.publish("end", "");
  served.server.flush();
  while ((slow.came.empty() || slow.came.back().first != "end") && !slow.connection.is_over())
    slow.receive();
  return slow.came;
}

std::vector<int> numbers_on(const std::string& channel, const Messages& messages) {
  std::vector<int> numbers;
  for (const auto& [name, text] : messages)
    if (name == channel) numbers.push_back(std::stoi(text));
  return numbers;
}

TEST(UnixServer, OfConflatedChannelsASlowClientGetsTheNewest) {
  Served served;
  served.server.conflate({"state", "bulk"});
  Client slow(served, {"state", "event", "bulk", "end"});
  const Messages came = flooded(served, slow);
  for (const char* channel : {"state", "bulk"}) {
    const std::vector<int> numbers = numbers_on(channel, came);
    EXPECT_LT(numbers.size(), 1'500u) << channel;
    EXPECT_EQ(numbers.back(), 2'999) << channel;
    EXPECT_TRUE(std::is_sorted(numbers.begin(), numbers.end())) << channel;
  }
  EXPECT_EQ(numbers_on("event", came).size(), 30u);
  EXPECT_EQ(
      numbers_on("state", came).size() + numbers_on("bulk", came).size() + served.server.replaced(),
      6'000u);
  EXPECT_EQ(served.server.failed(), 0u);
}

TEST(UnixServer, RepliesOvertakeConflatedChannels) {
  Served served;
  served.server.conflate({"state"});
  Client slow(served, {"state", "reply"});
  const std::string block(60'000, 'x');
  for (int i = 0; i < 100; ++i) served.publish("state", block), served.server.flush();
  served.publish("reply", "1");
  served.publish("state", "newest");
  for (int i = 0; i < 5; ++i) served.publish("state", block);
  served.server.flush();
  const auto place_of_reply = [&] {
    return std::find(slow.came.begin(), slow.came.end(),
                     std::pair<std::string, std::string>{"reply", "1"});
  };
  while (place_of_reply() == slow.came.end() && !slow.connection.is_over()) slow.receive();
  EXPECT_LT(place_of_reply() - slow.came.begin(), 12);  // what the kernel had taken already
}

// The test's process is the parent of none, so another one launches.
TEST(UnixServer, TheLauncherGetsAll) {
  Folder folder;
  const pid_t launched = ::fork();
  ASSERT_GE(launched, 0);
  if (launched == 0) {
    UnixServer server(folder.url());
    std::atomic<bool> go{false};
    server.listen({"in"}, [&](const std::string&, const uint8_t*, size_t) { go = true; });
    server.conflate({"state"});
    server.keep_all_for_launcher();
    while (!go) std::this_thread::yield();
    const std::vector<uint8_t> block(2'000);
    for (int i = 0; i < 3'000; ++i)
      server.publish("state", block.data(), block.size()), server.flush();
    server.publish("end", block.data(), 1);
    server.stop();
    ::_exit(server.replaced() == 0 ? 0 : 1);
  }
  while (!is_unix_served(folder.url().host)) std::this_thread::yield();
  StreamConnection connection(connect_unix(folder.url().host));
  connection.subscribe("state");
  connection.subscribe("end");
  const uint8_t byte = 1;
  ASSERT_TRUE(connection.publish("in", &byte, 1));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // it is behind
  int count = 0;
  bool ended = false;
  while (!ended && !connection.is_over()) {
    connection.receive(100, [&](std::string_view channel, const uint8_t*, size_t) {
      ended = channel == "end";
      count += channel == "state";
    });
  }
  EXPECT_EQ(count, 3'000);
  int status = 0;
  ASSERT_EQ(::waitpid(launched, &status, 0), launched);
  EXPECT_EQ(status, 0);
}

TEST(UnixServer, DropsAClientThatReadsNothing) {
  Served served;
  Client never(served, {"bulk"}), quick(served, {"out"});
  const std::string block(1 << 20, 'x');
  for (size_t i = 0; i < UnixServer::kMostBehind / block.size() + 5; ++i) {
    served.publish("bulk", block);
    served.server.flush();
  }
  EXPECT_GT(served.server.failed(), 0u);
  served.publish("out", "1");
  served.server.flush();
  quick.take_until(1);
  EXPECT_EQ(quick.came.size(), 1u);
}

TEST(UnixServer, DropsClientsThatTogetherAreTooFarBehind) {
  Served served;
  std::list<Client> clients;
  for (int i = 0; i < 5; ++i) clients.emplace_back(served, std::vector<std::string>{"bulk"});
  const std::string block(1 << 20, 'x');
  for (int i = 0; i < 60; ++i) {  // less than each alone may be behind
    served.publish("bulk", block);
    served.server.flush();
  }
  EXPECT_GT(served.server.failed(), 0u);
}

TEST(UnixServer, OneTooManyIsSentAway) {
  Served served;
  std::list<StreamConnection> connections;
  for (size_t i = 0; i < UnixServer::kMostClients; ++i)
    connections.emplace_back(connect_unix(served.folder.url().host));
  const FileHandle newcomer = connect_unix(served.folder.url().host);
  char byte;
  EXPECT_EQ(::recv(newcomer.get(), &byte, 1, 0), 0);
  EXPECT_EQ(served.server.refused(), 1u);
}

TEST(UnixServer, DisconnectsAClientWithoutAHello) {
  Served served;
  const FileHandle silent = connect_unix(served.folder.url().host);
  char byte;
  EXPECT_EQ(::recv(silent.get(), &byte, 1, 0), 0);
  EXPECT_EQ(served.server.refused(), 1u);
}

TEST(UnixServer, StopDeliversTheLastMessages) {
  auto served = std::make_unique<Served>();
  Client client(*served, {"out"});
  for (int i = 0; i < 1000; ++i) served->publish("out", "12");
  served->server.stop();
  client.take_until(1000);
  EXPECT_EQ(client.came.size(), 1000u);
  while (client.receive()) {
  }
  EXPECT_TRUE(client.connection.is_over());
}

TEST(UnixServer, PathsAreClaimedAndCleared) {
  const Folder folder;
  {
    UnixServer first(folder.url());
    EXPECT_THROW(UnixServer{folder.url()}, EnvironmentError);
  }
  EXPECT_FALSE(fs::exists(folder.url().host));
  {
    const FileHandle left = listen_unix(folder.url().host);
  }  // a server that was killed
  EXPECT_TRUE(fs::exists(folder.url().host));
  EXPECT_NO_THROW(UnixServer{folder.url()});
  std::ofstream(folder.url("file").host) << "not a socket";
  EXPECT_THROW(UnixServer{folder.url("file")}, EnvironmentError);
  EXPECT_TRUE(fs::exists(folder.url("file").host));
  EXPECT_THROW(UnixServer{folder.url("no/folder")}, EnvironmentError);
  EXPECT_THROW(UnixServer(folder.url(std::string(200, 'x'))), EnvironmentError);
  EXPECT_THROW(connect_unix(folder.url("nobody").host), EnvironmentError);
}

// Scripts wait for the file, and then start what connects.
TEST(UnixServer, AcceptsAsSoonAsTheSocketExists) {
  const Folder folder;
  const std::string path = folder.url().host;
  std::atomic<bool> over = false;
  int refused = 0;
  std::thread waiting([&] {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    while (!over) {
      const FileHandle socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
      const bool connects =
          ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
      refused += !connects && errno == ECONNREFUSED;
    }
  });
  std::vector<FileHandle> listeners;
  for (int i = 0; i < 500; ++i) {
    listeners.push_back(listen_unix(path));  // stays open: a closed one would refuse, rightly
    fs::remove(path);
  }
  over = true;
  waiting.join();
  EXPECT_EQ(refused, 0);
  EXPECT_TRUE(fs::is_empty(folder.path));
}

TEST(UnixServer, OneOfTwoSimultaneousServersServes) {
  const Folder folder;
  const std::string path = folder.url().host;
  for (int round = 0; round < 500; ++round) {
    std::atomic<int> ready = 0;
    FileHandle listeners[2];
    const auto begin = [&](FileHandle& listener) {
      ++ready;
      while (ready < 2) {
      }
      try {
        listener = listen_unix(path);
      } catch (const EnvironmentError&) {  // it is in use
      }
    };
    std::thread other([&] { begin(listeners[1]); });
    begin(listeners[0]);
    other.join();
    ASSERT_NE(static_cast<bool>(listeners[0]), static_cast<bool>(listeners[1])) << round;
    ASSERT_TRUE(is_unix_served(path)) << round;
    fs::remove(path);
  }
  EXPECT_TRUE(fs::is_empty(folder.path));
}

TEST(UnixServer, AFullQueueStillCountsAsServed) {
  const Folder folder;
  const std::string path = folder.url().host;
  const FileHandle listener = listen_unix(path);
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(is_unix_served(path)) << i;  // its queue is full
  EXPECT_THROW(listen_unix(path), EnvironmentError);
}

TEST(UnixServer, GarbageEndsItsConnectionAlone) {
  Served served;
  Client client(served, {"out"});
  uint32_t state = 1;
  for (int i = 0; i < 500; ++i) {
    const FileHandle raw = connect_unix(served.folder.url().host);
    std::vector<uint8_t> noise(1 + static_cast<size_t>(i) % 500);
    for (uint8_t& byte : noise)
      byte = static_cast<uint8_t>((state = state * 1664525 + 1013904223) >> 24);
    if (i % 2 == 0) noise.insert(noise.begin(), {0x28, 0x76, 0x17, 0xfb, 0, 0, 1, 0});
    ::send(raw.get(), noise.data(), noise.size(), MSG_NOSIGNAL);
  }
  client.say("in", "still here");
  served.wait_until_heard(2);
  served.publish("out", "1");
  served.server.flush();
  client.take_until(1);
  EXPECT_EQ(client.came.size(), 1u);
}

}  // namespace
}  // namespace ruedo::bus
