// Addresses, channel patterns, and the bus on memq. Tests with the network are in tests/cli, in a
// namespace.
#include "bus/lcm_bus.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <ctime>
#include <mutex>
#include <regex>
#include <thread>

#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "bus/tcpq_wire.h"
#include "ruedo/errors.h"
#include "system/file_handle.h"

namespace ruedo::bus {
namespace {

TEST(LcmUrl, DefaultsAndOptions) {
  const LcmUrl url = parse_url("udpm://239.1.2.3:7777?recv_buf_size=100");
  EXPECT_EQ(url.host, "239.1.2.3");
  EXPECT_EQ(url.port, 7777);
  EXPECT_EQ(url.str(),
            "udpm://239.1.2.3:7777?recv_buf_size=100&ttl=0");  // nothing leaves unless asked to
  EXPECT_EQ(url.option("recv_buf_size", ""), "100");
  EXPECT_EQ(url.option("nothing", "x"), "x");
  EXPECT_EQ(parse_url("udpm://").str(), "udpm://239.255.76.67:7667?ttl=0");
  EXPECT_EQ(parse_url("udpm://239.255.76.67:7667?ttl=1").str(), "udpm://239.255.76.67:7667?ttl=1");
  EXPECT_EQ(parse_url("memq://").str(), "memq://");
  EXPECT_EQ(parse_url("tcpq://").str(), "tcpq://127.0.0.1:7700");
  EXPECT_EQ(parse_url("tcpq://localhost:80").str(), "tcpq://127.0.0.1:80");
}

TEST(LcmUrl, RefusesWithAnExample) {
  for (const char* text :
       {"foo", "http://x", "udpm://1.2.3.4:7667", "udpm://239.255.76.67:0",
        "udpm://239.255.76.67:99999", "udpm://239.255.76.67:7667x", "udpm://host:7667",
        "tcpq://no.such.host.invalid:1", "tcpq://127.0.0.1:x", "tcpq://127.0.0.1:7700?ttl=0",
        "udpm://239.255.76.67:7667?ttl=256", "udpm://239.255.76.67:7667?ttl=-1",
        "udpm://239.255.76.67:7667?ttl", "udpm://239.255.76.67:7667?ttl=0&ttl=1",
        "udpm://239.255.76.67:7667?recv_buf_size=0", "udpm://239.255.76.67:7667?name=1"}) {
    try {
      parse_url(text);
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("udpm://239.255.76.67:7667"), std::string::npos)
          << error.what();
    }
  }
}

TEST(ChannelPatterns, OneForNamesThatCountUp) {
  std::vector<std::string> names;
  for (int i = 0; i < 1000; ++i) names.push_back("r" + std::to_string(i) + "/velocity");
  names.push_back("odd.name/move");
  const std::vector<std::string> patterns = channel_patterns(names);
  ASSERT_EQ(patterns.size(), 2u);
  for (const std::string& name : names) {
    bool matched = false;
    for (const std::string& pattern : patterns)
      matched |= std::regex_match(name, std::regex(pattern));
    EXPECT_TRUE(matched) << name;
  }
  for (const std::string& pattern : patterns)
    EXPECT_FALSE(std::regex_match("oddxname/move", std::regex(pattern)));
}

// The peer accepts and closes each connection at once: the pause between attempts grows.
TEST(LcmBus, LooksForALostServerWithPauses) {
  const FileHandle listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(listener.get(), 16), 0);
  ::getsockname(listener.get(), reinterpret_cast<sockaddr*>(&address), &size);
  std::atomic<int> connections{0};
  std::thread serving([&] {
    const std::vector<uint8_t> hello = tcpq::server_hello();
    std::vector<FileHandle> ended;  // no reset, which would take back what was sent
    for (;;) {
      FileHandle socket(::accept(listener.get(), nullptr, nullptr));
      if (!socket) return;
      [[maybe_unused]] const ssize_t sent =
          ::send(socket.get(), hello.data(), hello.size(), MSG_NOSIGNAL);
      ::shutdown(socket.get(), SHUT_WR);
      ended.push_back(std::move(socket));
      ++connections;
    }
  });
  {
    LcmBus bus("tcpq://127.0.0.1:" + std::to_string(ntohs(address.sin_port)));
    bus.listen({"x"}, [](const std::string&, const uint8_t*, size_t) {});
    const auto begin = std::chrono::steady_clock::now();
    const int before = connections;
    while (connections < before + 6) std::this_thread::yield();
    EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(50 + 100 + 200));
  }
  ::shutdown(listener.get(), SHUT_RDWR);
  serving.join();
}

TEST(LcmBus, TakesUpOtherChannels) {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> heard;
  LcmBus bus("memq://");  // ends first: its thread uses the above
  bus.listen({"r1/velocity"}, [&](const std::string& channel, const uint8_t*, size_t) {
    {
      std::lock_guard lock(mutex);
      heard.push_back(channel);
    }
    changed.notify_all();
  });
  const auto heard_when_said = [&] {
    for (const char* channel : {"guest/velocity", "r1/velocity", "end"})
      bus.publish(channel, nullptr, 0);
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return !heard.empty() && heard.back() == "end"; });
    return std::exchange(heard, {});
  };
  bus.listen_to({"r1/velocity", "guest/velocity", "end"});
  EXPECT_EQ(heard_when_said(), (std::vector<std::string>{"guest/velocity", "r1/velocity", "end"}));
  bus.listen_to({"r1/velocity", "end"});
  EXPECT_EQ(heard_when_said(), (std::vector<std::string>{"r1/velocity", "end"}));
}

TEST(LcmBus, HearsItsChannelsOnly) {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::pair<std::string, std::vector<uint8_t>>> heard;
  LcmBus bus("memq://");  // ends first: its thread uses the above
  bus.listen({"r1/velocity", "r2/move"},
             [&](const std::string& channel, const uint8_t* data, size_t size) {
               {
                 std::lock_guard lock(mutex);
                 heard.push_back({channel, {data, data + size}});
               }
               changed.notify_all();
             });
  const uint8_t bytes[] = {7, 8, 9};
  bus.publish("r3/velocity", bytes, 3);  // matches the pattern, is not in the list
  bus.publish("other", bytes, 3);
  bus.publish("r1/velocity", bytes, 3);
  bus.publish("r2/move", bytes, 0);
  std::unique_lock lock(mutex);
  changed.wait(lock, [&] { return heard.size() == 2; });
  EXPECT_EQ(heard[0].first, "r1/velocity");
  EXPECT_EQ(heard[0].second, (std::vector<uint8_t>{7, 8, 9}));
  EXPECT_EQ(heard[1].first, "r2/move");
  EXPECT_EQ(bus.failed(), 0u);
}

TEST(LcmBus, HasNoListenersOnMemq) { EXPECT_FALSE(LcmBus("memq://").is_heard("p3at/camera")); }

// poll() refuses two files where a process may have one.
class FewFiles {
 public:
  FewFiles() {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const rlimit one{1, before_.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &one);
  }
  ~FewFiles() { ::setrlimit(RLIMIT_NOFILE, &before_); }

 private:
  rlimit before_{};
};

// std::clock() counts the processor time of all threads.
TEST(LcmBus, RestsAndStopsWherePollFails) {
  LcmBus bus("memq://");
  const FewFiles few;
  bus.listen({"a"}, [](const std::string&, const uint8_t*, size_t) {});
  const std::clock_t begin = std::clock();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_LT(std::clock() - begin, CLOCKS_PER_SEC / 20);
  bus.stop();
}

TEST(LcmBus, StopsAtOnce) {
  int count = 0;
  LcmBus bus("memq://");
  bus.listen({"a"}, [&](const std::string&, const uint8_t*, size_t) { ++count; });
  bus.stop();
  const uint8_t byte = 0;
  bus.publish("a", &byte, 1);
  EXPECT_EQ(count, 0);
}

}  // namespace
}  // namespace ruedo::bus
