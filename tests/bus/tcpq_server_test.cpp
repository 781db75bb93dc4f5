// The tcpq server over loopback, against LCM's own client and against malicious connections.
#include "bus/tcpq_server.h"

#include <chrono>
#include <functional>
#include <thread>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <lcm/lcm-cpp.hpp>

#include "no_files.h"
#include "ruedo/errors.h"
#include "system/file_handle.h"

namespace ruedo::bus {
namespace {

const LcmUrl kAnyPort{"tcpq", "127.0.0.1", 0, ""};

bool soon(const std::function<bool()>& holds, int seconds = 20) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

// A server that counts what it hears on "in".
struct Served {
  TcpqServer server{kAnyPort};
  std::atomic<int> heard{0};
  std::string url = "tcpq://127.0.0.1:" + std::to_string(server.port());
  Served() {
    server.listen({"in"}, [this](const std::string& channel, const uint8_t*, size_t) {
      heard += channel == "in" ? 1 : 1000;
    });
  }
  void publish(const std::string& channel, const std::vector<uint8_t>& data) {
    server.publish(channel, data.data(), data.size());
  }
};

// LCM's client, with a thread.
struct Stock {
  lcm::LCM lcm;
  std::atomic<int> count{0};
  std::atomic<size_t> bytes{0}, largest{0};  // of all messages, and of one
  std::atomic<bool> end{false};
  std::thread thread;
  explicit Stock(const std::string& url, const std::string& pattern = "") : lcm(url) {
    if (!pattern.empty()) lcm.subscribe(pattern, &Stock::on, this)->setQueueCapacity(0);
    thread = std::thread([this] {
      while (!end) lcm.handleTimeout(20);
    });
  }
  ~Stock() {
    end = true;
    thread.join();
  }
  void on(const lcm::ReceiveBuffer* buffer, const std::string&) {
    bytes += buffer->data_size;
    largest = std::max<size_t>(largest, buffer->data_size);
    ++count;
  }
};

// The number of messages that the client has, once all published ones have arrived.
int settled(Served& served, const Stock& client, const std::string& channel) {
  const std::vector<uint8_t> marker(10);
  served.publish(channel, marker);
  EXPECT_TRUE(soon([&] { return client.largest >= marker.size(); }));
  return client.count;
}

struct Raw {
  FileHandle socket{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  bool connected = false;
  explicit Raw(uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected =
        ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  bool send(const std::vector<uint8_t>& bytes) const {
    return ::send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) >= 0;
  }
  // Reads until nothing arrives for that long (ms, above 0); true at the end of the connection.
  bool closed(int ms) const {
    timeval time{ms / 1000, ms % 1000 * 1000};
    ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVTIMEO, &time, sizeof time);
    char bytes[4096];
    for (;;) {
      const ssize_t size = ::recv(socket.get(), bytes, sizeof bytes, 0);
      if (size == 0 || (size < 0 && errno == ECONNRESET)) return true;
      if (size < 0) return false;
    }
  }
};

const std::vector<uint8_t>& hello() {
  static const std::vector<uint8_t> bytes{0x28, 0x76, 0x17, 0xfb, 0, 0, 1, 0};
  return bytes;
}

std::vector<uint8_t> subscription(uint8_t kind, const std::string& pattern) {
  std::string bytes{0, 0, 0, static_cast<char>(kind), 0, 0, 0, static_cast<char>(pattern.size())};
  bytes += pattern;
  return {bytes.begin(), bytes.end()};
}

TEST(TcpqServer, ServesStockClientsBothWays) {
  Served served;
  Stock listener(served.url, "out/.*"), speaker(served.url);
  ASSERT_TRUE(soon([&] { return served.publish("out/1", {1, 2, 3}), listener.count > 0; }));
  EXPECT_EQ(listener.bytes % 3, 0u);
  const int before = listener.count;
  served.publish("other", {1});
  speaker.lcm.publish("in", "x", 1);
  speaker.lcm.publish("out/2", "four", 4);  // from client to client
  ASSERT_TRUE(soon([&] { return served.heard == 1 && listener.count > before; }));
  EXPECT_EQ(served.server.failed(), 0u);
}

// Small messages must not wait for acknowledgements (Nagle's algorithm): checks the sockets that
// the server in this process has accepted.
TEST(TcpqServer, SendsAtOnce) {
  Served served;
  Stock client(served.url, "out");
  ASSERT_TRUE(soon([&] { return served.publish("out", {1}), client.count > 0; }));
  int accepted = 0;
  for (int fd = 0; fd < 1024; ++fd) {
    sockaddr_in own{}, peer{};
    socklen_t own_size = sizeof own, peer_size = sizeof peer;
    if (::getsockname(fd, reinterpret_cast<sockaddr*>(&own), &own_size) != 0 ||
        own.sin_family != AF_INET)
      continue;
    if (ntohs(own.sin_port) != served.server.port() ||
        ::getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &peer_size) != 0)
      continue;
    int at_once = 0;
    socklen_t size = sizeof at_once;
    EXPECT_EQ(::getsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &at_once, &size), 0);
    EXPECT_NE(at_once, 0);
    ++accepted;
  }
  EXPECT_EQ(accepted, 1);
}

TEST(TcpqServer, KnowsTheSubscribedChannels) {
  Served served;
  EXPECT_FALSE(served.server.is_heard("out/1"));
  uint64_t audience = served.server.audience();
  const auto changes = [&] {
    const bool changed = soon([&] { return served.server.audience() != audience; });
    audience = served.server.audience();
    return changed;
  };
  {
    const Raw client(served.server.port());
    client.send(hello());
    client.send(subscription(2, "out/.*"));
    ASSERT_TRUE(changes());
    EXPECT_TRUE(served.server.is_heard("out/1"));
    EXPECT_FALSE(served.server.is_heard("other"));
    client.send(subscription(3, "out/.*"));
    ASSERT_TRUE(changes());
    EXPECT_FALSE(served.server.is_heard("out/1"));
    client.send(subscription(2, "other"));
    ASSERT_TRUE(changes());
    EXPECT_TRUE(served.server.is_heard("other"));
  }
  ASSERT_TRUE(changes());  // it is gone
  EXPECT_FALSE(served.server.is_heard("other"));
}

TEST(TcpqServer, PassesRawPictures) {
  Served served;
  Stock listener(served.url, "camera");
  const std::vector<uint8_t> picture(921'600, 7);
  ASSERT_TRUE(soon([&] { return served.publish("camera", {1}), listener.count > 0; }));
  const int before = settled(served, listener, "camera");
  for (int i = 1; i <= 150; ++i) {  // at a camera's pace: each arrives before the next
    served.publish("camera", picture);
    ASSERT_TRUE(soon([&] { return listener.count == before + i; })) << i;
  }
}

TEST(TcpqServer, ChangesItsInputChannels) {
  Served served;
  Stock speaker(served.url);
  speaker.lcm.publish("in", "x", 1);
  ASSERT_TRUE(soon([&] { return served.heard == 1; }));
  served.server.listen_to({"spawned"});
  speaker.lcm.publish("in", "x", 1);
  speaker.lcm.publish("spawned", "x", 1);
  ASSERT_TRUE(soon([&] { return served.heard == 1001; }));
}

TEST(TcpqServer, ASlowClientLosesMessagesAndDelaysNoOther) {
  Served served;
  Raw slow(served.server.port());
  ASSERT_TRUE(slow.send(hello()) && slow.send(subscription(2, ".*")));
  Stock quick(served.url, "out");
  ASSERT_TRUE(soon([&] { return served.publish("out", {1}), quick.count > 0; }));
  const std::vector<uint8_t> block(60'000);
  for (int i = 0; i < 2000; ++i) {  // 120 MB: more than the kernel and the ring hold
    served.publish("bulk", block);  // waiting for the slow client here would last for ever
    if (i % 100 != 0) continue;
    const int before = quick.count;
    ASSERT_TRUE(soon([&] { return served.publish("out", {1}), quick.count > before; })) << i;
  }
  ASSERT_TRUE(
      soon([&] { return slow.closed(100) || served.server.skipped() > 0; }));  // it reads again
  EXPECT_FALSE(slow.closed(1));
}

TEST(TcpqServer, OfConflatedChannelsASlowClientGetsTheNewest) {
  Served served;
  served.server.conflate({"state"});
  lcm::LCM slow(served.url);
  struct Came {
    int states = 0, events = 0, newest = -1;
    void on(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
      if (channel == "state") newest = *static_cast<const uint8_t*>(buffer->data), ++states;
      if (channel == "event") ++events;
    }
  } came;
  slow.subscribe(".*", &Came::on, &came)->setQueueCapacity(0);
  ASSERT_TRUE(soon([&] { return served.server.is_heard("state"); }));
  std::vector<uint8_t> block(20'000);
  constexpr int kStates = 600;  // 12 MB: less than the ring holds
  for (int i = 0; i < kStates; ++i) {
    block[0] = static_cast<uint8_t>(i % 100);
    served.publish("state", block);
    if (i % 20 == 0) served.publish("event", {1});
  }
  block[0] = 200;
  served.publish("state", block);
  ASSERT_TRUE(soon([&] { return slow.handleTimeout(100), came.newest == 200; }));
  EXPECT_EQ(came.events, kStates / 20);
  EXPECT_LT(came.states, kStates);
  EXPECT_GT(served.server.replaced(), 0u);
  EXPECT_EQ(served.server.failed(), 0u);
}

TEST(TcpqServer, WithoutFileDescriptorsNewcomersWaitAndCostNothing) {
  Served served;
  const FileHandle newcomer(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(served.server.port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  newcomer_costs_nothing(newcomer.get(), address);
  EXPECT_TRUE(soon([&] { return served.server.connections() == 1; }));
}

TEST(TcpqServer, StopDeliversTheLastMessages) {
  for (int round = 0; round < 5; ++round) {
    Served served;
    Stock listener(served.url, "out");
    ASSERT_TRUE(soon([&] { return served.publish("out", {1}), listener.count > 0; }));
    const int before = settled(served, listener, "out");
    for (int i = 0; i < 1000; ++i) served.publish("out", {1, 2});
    served.server.stop();
    EXPECT_TRUE(soon([&] { return listener.count >= before + 1000; })) << listener.count - before;
  }
}

TEST(TcpqServer, BindsToItsHostAlone) {
  TcpqServer server(kAnyPort);
  LcmUrl other{"tcpq", "127.0.0.2", server.port(), ""};
  EXPECT_NO_THROW(TcpqServer{other});  // free: the first is not on all interfaces
  other.host = "127.0.0.1";
  try {
    TcpqServer second(other);
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_NE(std::string(error.what()).find("--lcm auto"), std::string::npos);
  }
}

// Malicious peers. After each of them a stock client still gets what it asks for.
class TcpqHostile : public ::testing::Test {
 protected:
  void TearDown() override {
    Stock client(served.url, "out");
    EXPECT_TRUE(soon([&] { return served.publish("out", {1}), client.count > 0; }));
    const int before = served.heard;
    client.lcm.publish("in", "x", 1);
    EXPECT_TRUE(soon([&] { return served.heard == before + 1; }));
  }
  Served served;
  std::shared_ptr<void> crowd;
};

TEST_F(TcpqHostile, Garbage) {
  uint32_t state = 1;
  for (int i = 0; i < 2000; ++i) {
    Raw raw(served.server.port());
    if (i % 2 == 0) raw.send(hello());
    std::vector<uint8_t> noise(1 + i % 500);
    for (uint8_t& byte : noise)
      byte = static_cast<uint8_t>((state = state * 1664525 + 1013904223) >> 24);
    raw.send(noise);
  }
  EXPECT_TRUE(soon([&] { return served.server.connections() == 2000; }));
}

TEST_F(TcpqHostile, HugeLengthsAreRefused) {
  Raw raw(served.server.port());
  raw.send(hello());
  raw.send({0, 0, 0, 1, 0, 0, 0, 1, 'x', 0x7f, 0xff, 0xff, 0xff});
  EXPECT_TRUE(raw.closed(5000));
  EXPECT_EQ(served.server.dropped_clients(), 1u);
}

TEST_F(TcpqHostile, HalfMessages) {
  std::vector<Raw> many;
  for (int i = 0; i < 100; ++i) {
    many.emplace_back(served.server.port());
    many.back().send(hello());
    many.back().send(
        {0, 0, 0, 1, 0, 0, 0, 1, 'x', 0, 0x10, 0, 0, 1, 2, 3});  // of a megabyte, three bytes
  }
}

TEST_F(TcpqHostile, UnfinishedMessagesHaveABound) {
  std::vector<Raw> many;
  const std::vector<uint8_t> most(3 << 20);
  for (int i = 0; i < 30; ++i) {  // 90 MB in all
    many.emplace_back(served.server.port());
    many.back().send(hello());
    many.back().send({0, 0, 0, 1, 0, 0, 0, 1, 'x', 0, 0x3f, 0, 0});
    many.back().send(most);
  }
  EXPECT_TRUE(soon([&] { return served.server.dropped_clients() >= 5; }));
}

TEST_F(TcpqHostile, AThousandSilentConnections) {
  std::vector<Raw> many;
  for (int i = 0; i < 1000; ++i) {
    many.emplace_back(served.server.port());
    if (i % 2 == 0 && many.back().connected) many.back().send(hello());
    if (many.size() > 600) many.erase(many.begin());  // this process has a thousand files at most
  }
  EXPECT_TRUE(soon([&] { return served.server.connections() == 1000; }));
}

// A process that takes all places with subscribers that never read; it ends with its object.
struct Crowd {
  FileHandle end;
  pid_t process = -1;
  explicit Crowd(uint16_t port) {
    int ready[2], over[2];
    if (::pipe(ready) != 0 || ::pipe(over) != 0) return;
    process = ::fork();
    if (process == 0) {
      ::close(over[1]);
      std::vector<Raw> all;
      for (size_t i = 0; i < TcpqServer::kMostClients; ++i) {
        all.emplace_back(port);
        all.back().send(hello());
        all.back().send(subscription(2, "nothing"));
      }
      char byte = 0;
      [[maybe_unused]] ssize_t count = ::write(ready[1], &byte, 1);
      count = ::read(over[0], &byte, 1);
      ::_exit(0);
    }
    ::close(ready[1]);
    ::close(over[0]);
    end = FileHandle(over[1]);
    const FileHandle is_ready(ready[0]);
    char byte = 0;
    EXPECT_EQ(::read(is_ready.get(), &byte, 1), 1);
  }
  ~Crowd() {
    end = FileHandle();
    ::waitpid(process, nullptr, 0);
  }
};

TEST_F(TcpqHostile, OneProcessHasNotAllPlaces) {
  crowd = std::make_shared<Crowd>(served.server.port());
  ASSERT_TRUE(soon([&] { return served.server.connections() == TcpqServer::kMostClients; }));
}

TEST_F(TcpqHostile, DisconnectsAClientWithoutAHello) {
  Raw raw(served.server.port());
  EXPECT_TRUE(raw.closed(10'000));
}

TEST_F(TcpqHostile, AFloodOfCommandsAndOfSubscriptions) {
  Raw raw(served.server.port());
  raw.send(hello());
  std::vector<uint8_t> commands, patterns;
  for (int i = 0; i < 1000; ++i) {
    commands.insert(commands.end(), {0, 0, 0, 1, 0, 0, 0, 2, 'i', 'n', 0, 0, 0, 1, 'x'});
    const std::vector<uint8_t> one = subscription(2, std::to_string(i) + "(a+)+.*");
    patterns.insert(patterns.end(), one.begin(), one.end());
  }
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(raw.send(commands) && raw.send(patterns));
  EXPECT_TRUE(soon([&] { return served.heard == 100'000; }));
}

}  // namespace
}  // namespace ruedo::bus
