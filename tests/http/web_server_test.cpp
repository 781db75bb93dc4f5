// Who is served, and that no one browser takes the server's memory, its port, or the process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include <netinet/in.h>
#include <sys/socket.h>

#include <fmt/format.h>

#include "http/guard.h"
#include "http/web_server.h"
#include "ruedo/errors.h"
#include "system/file_handle.h"

namespace ruedo::http {
namespace {

TEST(Guard, AddressesAreRead) {
  EXPECT_EQ(parse_address("").port, 8080);
  EXPECT_EQ(parse_address("9000").port, 9000);
  EXPECT_EQ(parse_address("localhost:1").host, "127.0.0.1");
  EXPECT_FALSE(parse_address("0.0.0.0:8080").loopback());
  for (const char* bad :
       {"worlds/arena.sdf", "127.0.0.1:", "127.0.0.1:65536", "1.2.3:80", ":x", "127.0.0.1:-1"}) {
    EXPECT_THROW(parse_address(bad), InputError) << bad;
  }
}

TEST(Guard, OnLoopbackOnlyLoopbackNames) {
  const Address here;
  for (const char* good :
       {"localhost:8080", "127.0.0.1:8080", "localhost", "[::1]:8080", "127.0.0.2:1"}) {
    EXPECT_EQ(refuse({.host = good}, here, ""), "") << good;
  }
  for (const char* bad :
       {"", "evil.example:8080", "127.evil.example:8080", "localhost.evil.example", "10.0.0.1:8080",
        "127.0.0.1:8080.evil.example", "localhost:evil.example"}) {
    EXPECT_NE(refuse({.host = bad}, here, ""), "") << bad;
  }
}

TEST(Guard, ElsewhereOnlyWithTheToken) {
  const Address anywhere{"0.0.0.0", 8080};
  const std::string token = make_token();
  EXPECT_EQ(token.size(), 32u);
  EXPECT_NE(token, make_token());
  EXPECT_NE(refuse({.host = "robot:8080"}, anywhere, token), "");
  EXPECT_NE(refuse({.host = "robot:8080", .token = token.substr(1)}, anywhere, token), "");
  EXPECT_EQ(refuse({.host = "robot:8080", .token = token}, anywhere, token), "");
  EXPECT_EQ(refuse({.host = "robot:8080", .cookie = "a=b; ruedo_token=" + token}, anywhere, token),
            "");
  EXPECT_NE(refuse({.host = "robot:8080", .cookie = "xruedo_token=" + token}, anywhere, token), "");
}

TEST(Guard, SocketsOnlyForItsOwnPages) {
  const Address here;
  EXPECT_EQ(refuse({.host = "localhost:8080", .origin = "http://localhost:8080", .socket = true},
                   here, ""),
            "");
  EXPECT_EQ(refuse({.host = "localhost:8080", .socket = true}, here, ""), "");  // no browser
  EXPECT_NE(
      refuse({.host = "localhost:8080", .origin = "http://evil.example", .socket = true}, here, ""),
      "");
  EXPECT_NE(refuse({.host = "localhost:8080", .origin = "http://localhost:9090", .socket = true},
                   here, ""),
            "");
  EXPECT_NE(refuse({.host = "localhost:8080", .origin = "null", .socket = true}, here, ""), "");
}

std::unique_ptr<WebServer> server_at(int port) {
  WebPlace place;
  place.address.port = port;
  return std::make_unique<WebServer>(place, WebHandler{});
}

// The errors when so many start in the same moment.
std::vector<std::string> started_at_once(int servers, int port) {
  std::vector<std::string> faults;
  std::mutex mutex;
  std::barrier begin(servers), end(servers);  // no server frees its port before all have tried
  std::vector<std::jthread> threads;
  for (int i = 0; i < servers; ++i) {
    threads.emplace_back([&] {
      begin.arrive_and_wait();
      std::unique_ptr<WebServer> server;
      try {
        server = server_at(port);
      } catch (const EnvironmentError& error) {
        const std::lock_guard lock(mutex);
        faults.emplace_back(error.what());
      }
      end.arrive_and_wait();
    });
  }
  threads.clear();
  return faults;
}

TEST(WebServer, ServersThatShareAPortReportIt) {
  const int port = server_at(0)->port();
  for (int round = 0; round < 200; ++round) {
    for (const std::string& fault : started_at_once(8, port))
      EXPECT_THAT(fault,
                  testing::HasSubstr("cannot be served: Address already in use. Another port"));
  }
}

TEST(WebServer, ServersOnPortZeroAllStart) {
  for (int round = 0; round < 20; ++round) EXPECT_THAT(started_at_once(4, 0), testing::IsEmpty());
}

// Clients that have got a message and are still connected.
struct Given {
  std::atomic<int> now{0}, most{0};
};

// Has always more to say.
class Talker : public Connection {
 public:
  static constexpr size_t kSize = size_t{8} << 20;

  explicit Talker(Given& given) : given_(given) {}
  ~Talker() override { given_.now -= has_; }
  bool on_message(std::span<const uint8_t>) override { return true; }
  bool next(std::vector<uint8_t>& message, bool&) override {
    message.resize(message.size() + kSize);
    given_.now += !std::exchange(has_, true);
    given_.most = std::max(given_.most.load(), given_.now.load());
    return true;
  }

 private:
  Given& given_;
  bool has_ = false;
};

FileHandle connected_to(int port) {
  FileHandle one(::socket(AF_INET, SOCK_STREAM, 0));
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_port = htons(static_cast<uint16_t>(port));
  place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::connect(one.get(), reinterpret_cast<sockaddr*>(&place), sizeof place), 0);
  return one;
}

void say(const FileHandle& to, const std::string& words) {
  EXPECT_EQ(write_all(to.get(), words.data(), words.size()), words.size());
}

FileHandle viewer_of(int port) {
  FileHandle one = connected_to(port);
  say(one, fmt::format(
               "GET /socket HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nUpgrade: websocket\r\nConnection: "
               "Upgrade\r\n"
               "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n",
               port));
  return one;
}

// The bytes received until they contain that, or until the end.
std::string heard_of(const FileHandle& from, const std::string& enough) {
  std::string heard;
  char bytes[4096];
  for (ssize_t more = 1; more > 0 && heard.find(enough) == std::string::npos;) {
    more = ::recv(from.get(), bytes, sizeof bytes, 0);
    heard.append(bytes, more > 0 ? static_cast<size_t>(more) : 0);
  }
  return heard;
}

// Throws where it can.
class Thrower : public Connection {
 public:
  bool on_message(std::span<const uint8_t>) override { throw std::bad_alloc(); }
  bool next(std::vector<uint8_t>&, bool&) override {
    if (std::exchange(greeted_, true)) throw std::bad_alloc();
    return false;
  }

 private:
  bool greeted_ = false;
};

TEST(WebServer, AnExceptionEndsItsConnectionOnly) {
  WebPlace place;
  place.address.port = 0;
  int opened = 0, ticks = 0;
  WebHandler handler;
  handler.get = [](std::string_view path) -> HttpResponse {
    if (path == "/bad") throw std::bad_alloc();
    return {.body = std::make_shared<std::vector<uint8_t>>(4, 'g')};
  };
  handler.open = [&]() -> std::unique_ptr<Connection> {
    if (++opened == 1) throw std::runtime_error("no room");
    return std::make_unique<Thrower>();
  };
  handler.end = [] {};
  handler.tick = [&]() -> bool {
    if (++ticks % 2 == 1) throw std::bad_alloc();
    return ticks > 2;  // they may have something to send
  };
  WebServer server(place, std::move(handler));
  std::jthread thread([&] { server.run(); });
  const auto asked = [&](const char* path) {
    const FileHandle one = connected_to(server.port());
    say(one, fmt::format("GET {} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", path, server.port()));
    return heard_of(one, "gggg");
  };
  EXPECT_THAT(asked("/good"), testing::EndsWith("gggg"));
  EXPECT_EQ(asked("/bad"), "");
  for (int i = 0; i < 3; ++i) heard_of(viewer_of(server.port()), "never");  // until it is closed
  const FileHandle talker = viewer_of(server.port());
  heard_of(talker, "\r\n\r\n");
  say(talker, std::string("\x81\x80\0\0\0\0", 6));  // a text without a letter
  heard_of(talker, "never");
  EXPECT_THAT(asked("/good"), testing::EndsWith("gggg"));
  server.stop();
}

// 40 of 8 MB each.
TEST(WebServer, DropsClientsThatReadNothing) {
  Given given;
  WebPlace place;
  place.address.port = 0;
  WebHandler handler;
  handler.open = [&] { return std::make_unique<Talker>(given); };
  handler.end = [] {};
  handler.tick = [] { return false; };
  WebServer server(place, std::move(handler));
  std::jthread thread([&] { server.run(); });
  std::vector<FileHandle> deaf;
  for (int i = 0; i < 40; ++i) deaf.push_back(viewer_of(server.port()));
  const FileHandle reader = viewer_of(server.port());
  std::vector<uint8_t> bytes(1 << 20);
  size_t read = 0;
  for (ssize_t more = 1; more > 0 && read < 3 * Talker::kSize; read += static_cast<size_t>(more))
    more = std::max<ssize_t>(0, ::recv(reader.get(), bytes.data(), bytes.size(), 0));
  EXPECT_GE(read, 3 * Talker::kSize);
  EXPECT_LE(given.most, 2 + static_cast<int>(WebServer::kMostHeld / Talker::kSize));
  server.stop();
}

}  // namespace
}  // namespace ruedo::http
