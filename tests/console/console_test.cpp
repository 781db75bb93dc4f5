// The console's parts that need no socket: who may come in, the ring past the publisher, what is
// kept of each channel.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "console/board.h"
#include "console/guard.h"
#include "console/offer_ring.h"
#include "console/tee_bus.h"
#include "ruedo/errors.h"
#include "ruedo/reply_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/world_state_t.hpp"

namespace ruedo::console {
namespace {

template <class Message>
std::vector<uint8_t> encoded(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

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
  for (const char* bad : {"", "evil.example:8080", "127.evil.example:8080",
                          "localhost.evil.example", "10.0.0.1:8080"}) {
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

TEST(OfferRing, KeepsOrderAcrossItsEndAndDropsWhatHasNoRoom) {
  OfferRing ring(64);
  std::vector<uint8_t> message(20);
  for (uint32_t i = 0; i < 50; ++i) {
    message.assign(20, static_cast<uint8_t>(i));
    ASSERT_TRUE(ring.offer(i, message.data(), message.size()));
    ASSERT_TRUE(ring.offer(i + 1000, message.data(), 3));
    ASSERT_FALSE(ring.offer(7, message.data(), 40));
    std::vector<uint32_t> seen;
    ring.drain([&](uint32_t channel, const std::vector<uint8_t>& bytes) {
      seen.push_back(channel);
      EXPECT_THAT(bytes, testing::Each(static_cast<uint8_t>(i)));
    });
    EXPECT_THAT(seen, testing::ElementsAre(i, i + 1000));
  }
  EXPECT_EQ(ring.dropped(), 50u);
}

TEST(OfferRing, TwoThreads) {
  OfferRing ring(1024);
  std::thread writer([&] {
    for (uint32_t i = 0; i < 20000; ++i) {
      const std::vector<uint8_t> message(i % 60, static_cast<uint8_t>(i));
      ring.offer(i, message.data(), message.size());
    }
  });
  int64_t last = -1;
  const auto read = [&] {
    ring.drain([&](uint32_t channel, const std::vector<uint8_t>& bytes) {
      EXPECT_GT(int64_t{channel}, last);
      last = channel;
      EXPECT_EQ(bytes.size(), channel % 60);
      EXPECT_THAT(bytes, testing::Each(static_cast<uint8_t>(channel)));
    });
  };
  for (int i = 0; i < 1000; ++i) read();
  writer.join();
  read();
}

TEST(Board, KeepsTheNewestAllPartsAndTheLastReplies) {
  Board board;
  board.name(0, "a");
  board.name(1, "ruedo/world");
  board.name(2, "ruedo/reply");
  velocity_command_t command{};
  for (int i = 0; i < 3; ++i) board.put(0, encoded(command));
  EXPECT_EQ(board.channels()[0].newest.size(), 1u);
  world_state_t state{};
  state.nparts = 3;
  for (int round = 0; round < 2; ++round) {
    for (state.part = 0; state.part < 3; ++state.part) board.put(1, encoded(state));
  }
  EXPECT_EQ(board.channels()[1].newest.size(), 3u);
  reply_t reply{};
  for (int i = 0; i < 100; ++i) board.put(2, encoded(reply));
  EXPECT_EQ(board.channels()[2].newest.size(), Board::kKeptReplies);
  board.put(0, {1, 2, 3});  // not a message at all
  EXPECT_EQ(board.channels()[0].newest.size(), 1u);
}

class FakeBus : public Bus {
 public:
  void publish(const std::string& channel, const uint8_t*, size_t) override {
    published.push_back(channel);
  }
  void listen(const std::vector<std::string>&, Handler handler,
              const std::vector<std::string>&) override {
    received = std::move(handler);
  }
  std::vector<std::string> published;
  Handler received;
};

TEST(TeeBus, ForwardsAllAndOffersWhatIsWanted) {
  FakeBus inner;
  TeeBus tee(inner);
  tee.listen({"p3at/velocity"}, [](const std::string&, const uint8_t*, size_t) {});
  const uint8_t byte = 1;
  const auto offered = [&] {
    int count = 0;
    tee.ring().drain([&](uint32_t, const std::vector<uint8_t>&) { ++count; });
    return count;
  };
  tee.publish("a", &byte, 1);
  EXPECT_EQ(offered(), 0);  // nobody watches
  tee.watch(true);
  tee.publish("a", &byte, 1);
  tee.publish("b", &byte, 1);
  EXPECT_EQ(offered(), 2);
  tee.channel(0).wanted = false;
  tee.publish("a", &byte, 1);
  inner.received("p3at/velocity", &byte, 1);
  EXPECT_EQ(offered(), 1);
  EXPECT_EQ(tee.channel(0).messages, 3u);
  EXPECT_THAT(inner.published, testing::ElementsAre("a", "a", "b", "a"));
}

// On a bus that does not hear itself, as over the network, and on one that does, a command arrives
// once.
TEST(TeeBus, ACommandGoesToTheListenerAndNotOverTheBus) {
  FakeBus inner;
  TeeBus tee(inner);
  std::vector<std::string> heard;
  const uint8_t byte = 1;
  EXPECT_FALSE(tee.command("p3at/velocity", &byte, 1));  // nobody listens yet
  tee.listen({"p3at/velocity"}, [&](const std::string& channel, const uint8_t* data, size_t size) {
    heard.push_back(channel + std::to_string(data[0]) + std::to_string(size));
  });
  tee.watch(true);
  EXPECT_TRUE(tee.command("p3at/velocity", &byte, 1));
  EXPECT_FALSE(tee.command("ruedo/world", &byte, 1));  // nobody listens there
  EXPECT_THAT(heard, testing::ElementsAre("p3at/velocity11"));
  EXPECT_THAT(inner.published, testing::IsEmpty());
  EXPECT_EQ(tee.channel(0).messages, 1u);  // and it is shown, as what others send
  tee.stop();
  tee.command("p3at/velocity", &byte, 1);
  EXPECT_EQ(heard.size(), 1u);
}

}  // namespace
}  // namespace ruedo::console
