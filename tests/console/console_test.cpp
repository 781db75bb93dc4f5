// The parts of the console that need no socket: access control, the ring beside the publisher, and
// what is kept of each channel.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "console/board.h"
#include "console/events.h"
#include "console/live_source.h"
#include "console/offer_ring.h"
#include "console/tap.h"
#include "console/viewer.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/collisions_t.hpp"
#include "ruedo/contact_t.hpp"
#include "ruedo/errors.h"
#include "ruedo/fault_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "ruedo/name_request_t.hpp"
#include "ruedo/reply_t.hpp"
#include "ruedo/spawn_request_t.hpp"
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

TEST(OfferRing, KeepsOrderAcrossItsEndAndDropsWhenFull) {
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

// As long as there is room nothing is missed, even with writers in other threads.
TEST(OfferRing, HoldsAllThatManyThreadsWriteInTheOrderOfEach) {
  constexpr uint32_t kWriters = 3, kEach = 20000;
  OfferRing ring(size_t{1} << 23);
  std::vector<std::thread> writers;
  for (uint32_t writer = 0; writer < kWriters; ++writer) {
    writers.emplace_back([&ring, writer] {
      for (uint32_t i = 0; i < kEach; ++i) {
        const std::vector<uint8_t> message(i % 60, static_cast<uint8_t>(writer + i));
        ring.offer(writer << 24 | i, message.data(), message.size());
      }
    });
  }
  std::array<uint32_t, kWriters> next{};
  const auto read = [&] {
    ring.drain([&](uint32_t channel, const std::vector<uint8_t>& bytes) {
      const uint32_t writer = channel >> 24, i = channel & 0xffffff;
      EXPECT_EQ(i, next.at(writer)++);
      EXPECT_EQ(bytes.size(), i % 60);
      EXPECT_THAT(bytes, testing::Each(static_cast<uint8_t>(writer + i)));
    });
  };
  for (int i = 0; i < 1000; ++i) read();
  for (std::thread& writer : writers) writer.join();
  read();
  EXPECT_THAT(next, testing::Each(kEach));
  EXPECT_EQ(ring.dropped(), 0u);
}

// A reader that keeps up, with a ring that fills again and again.
TEST(OfferRing, DroppingLeavesTheRestIntact) {
  OfferRing ring(1024);
  std::atomic<int> writing{2};
  const auto write = [&](uint32_t writer) {
    for (uint32_t i = 0; i < 20000; ++i) {
      const std::vector<uint8_t> message(i % 60, static_cast<uint8_t>(writer + i));
      ring.offer(writer << 24 | i, message.data(), message.size());
    }
    --writing;
  };
  std::thread first(write, 0u), second(write, 1u);
  std::array<int64_t, 2> last{-1, -1};
  uint64_t read_count = 0;
  const auto read = [&] {
    ring.drain([&](uint32_t channel, const std::vector<uint8_t>& bytes) {
      const uint32_t writer = channel >> 24, i = channel & 0xffffff;
      EXPECT_GT(int64_t{i}, last.at(writer));
      last.at(writer) = i;
      EXPECT_EQ(bytes.size(), i % 60);
      EXPECT_THAT(bytes, testing::Each(static_cast<uint8_t>(writer + i)));
      ++read_count;
    });
  };
  while (writing > 0) read();
  first.join();
  second.join();
  read();
  EXPECT_EQ(read_count + ring.dropped(), 40000u);
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

// The messages of a run, one after the other.
class EventsTest : public testing::Test {
 protected:
  template <class Message>
  void hear(double time_s, const std::string& channel, const Message& message) {
    events.hear(time_s, channel, encoded(message));
  }
  void touch(double time_s, const std::vector<std::string>& bodies,
             const std::string& channel = "r/bumper") {
    contact_t contact{};
    for (const std::string& body : bodies) contact.points.emplace_back().body = body;
    contact.n = static_cast<int32_t>(bodies.size());
    hear(time_s, channel, contact);
  }
  void status(double time_s, int64_t id, int kind, int state, int reason, double done = 0) {
    motion_status_t message{};
    message.utime = static_cast<int64_t>(time_s * 1e6);
    message.id = id;
    message.kind = static_cast<int8_t>(kind);
    message.state = static_cast<int8_t>(state);
    message.reason = static_cast<int8_t>(reason);
    message.done = done;
    hear(time_s, "r/motion", message);
  }
  void apply(double time_s, int kind, std::vector<uint8_t> data, const std::string& channel) {
    applied_t applied{};
    applied.kind = kind;
    applied.channel = channel;
    applied.size = static_cast<int32_t>(data.size());
    applied.data = std::move(data);
    hear(time_s, "ruedo/applied", applied);
  }
  std::vector<std::string> told() const {
    std::vector<std::string> lines;
    for (const Event& event : events.list())
      lines.push_back(
          fmt::format("{:g} {} {}: {}", event.time_s, event.kind, event.robot, event.text));
    return lines;
  }

  Events events{false};
};

TEST_F(EventsTest, ABouncingTouchIsOneCollision) {
  touch(0.0, {"floor/link"});  // from the beginning: nothing happened
  touch(0.1, {"floor/link", "box/link"});
  touch(0.2, {"floor/link"});
  touch(0.4, {"floor/link", "box/link"});
  touch(0.5, {"floor/link", "box/link", "wall/link"});
  touch(0.5, {"wall/link"}, "r/other");  // another channel's first
  touch(0.6, {"wall/link"}, "r/other");  // of the same robot
  touch(2.0, {"floor/link", "box/link"});
  EXPECT_EQ(told(), (std::vector<std::string>{
                        "0.1 collision r: touches box/link", "0.5 collision r: touches wall/link",
                        "2 collision r: touches box/link", "2 collision r: touches floor/link"}));
}

TEST_F(EventsTest, ReportsTheLinkThatBlocksARobot) {
  collisions_t collisions{};
  const auto tell = [&](double time_s, const std::string& by) {
    collisions.blocked_by = by;
    hear(time_s, "r/collisions", collisions);
  };
  tell(0, "");
  collisions.points.emplace_back().body = "wall/link";
  collisions.n = 1;
  tell(1, "");
  tell(1.5, "wall/link");
  tell(1.6, "wall/link");
  status(1.5, 0, motion_status_t::KIND_VELOCITY, motion_status_t::STATE_RUNNING, 0);
  status(1.6, 0, motion_status_t::KIND_VELOCITY, motion_status_t::STATE_RUNNING,
         motion_status_t::REASON_BLOCKED);
  tell(2, "");
  tell(3, "box/link");
  EXPECT_EQ(told(), (std::vector<std::string>{
                        "1 collision r: touches wall/link", "1.5 blocked r: blocked by wall/link",
                        "3 collision r: touches wall/link", "3 blocked r: blocked by box/link"}));
}

TEST_F(EventsTest, MotionsEndInOneWayOrAnother) {
  using M = motion_status_t;
  status(0, 0, M::KIND_NONE, M::STATE_IDLE, 0);
  status(1, 7, move_command_t::ADVANCE, M::STATE_RUNNING, 0);
  status(2, 7, move_command_t::ADVANCE, M::STATE_RUNNING, 0, 0.3);
  status(3, 7, move_command_t::ADVANCE, M::STATE_DONE, 0, 0.4);
  status(4, 7, move_command_t::ADVANCE, M::STATE_DONE, 0, 0.4);
  status(5, 8, move_command_t::ARC, M::STATE_REFUSED, M::REASON_BAD_VALUE);
  status(6, 0, M::KIND_VELOCITY, M::STATE_RUNNING, M::REASON_BLOCKED);
  status(7, 0, M::KIND_VELOCITY, M::STATE_ENDED, M::REASON_WATCHDOG);
  status(8, 9, move_command_t::ADVANCE, M::STATE_ENDED, M::REASON_REPLACED);
  EXPECT_EQ(told(),
            (std::vector<std::string>{
                "3 goal r: advance 0.4 m done", "5 refused r: arc of 0.0°: value out of range",
                "6 blocked r: velocity is blocked", "7 watchdog r: no command came: stopped"}));
}

TEST_F(EventsTest, ReportsCommandsAndRequests) {
  velocity_command_t velocity{};
  velocity.vx = 0.5;
  for (int i = 0; i < 30; ++i) apply(1 + 0.1 * i, 0, encoded(velocity), "r/velocity");
  apply(9, 0, encoded(velocity), "r/velocity");
  name_request_t box{};
  box.name = "box";
  apply(10, request_t::REMOVE, encoded(box), "ruedo/request");
  apply(11, request_t::RESET, {}, "ruedo/request");
  apply(12, request_t::REMOVE, {1, 2, 3}, "ruedo/request");
  fault_t fault{};
  fault.kind = "lag";
  fault.target = "lrf";
  fault.duration = 2;
  apply(13, 0, encoded(fault), "r/fault");
  events.lost(0);
  events.lost(3);
  events.lost(3);
  EXPECT_EQ(told(), (std::vector<std::string>{
                        "1 command r: drive at 0.50 m/s, 0.00 rad/s",
                        "9 command r: drive at 0.50 m/s, 0.00 rad/s", "10 request : remove box",
                        "11 reset : reset", "12 request : remove", "13 fault r: lag of lrf for 2 s",
                        "13 lost : 3 messages could not be sent"}));
}

TEST_F(EventsTest, ALiveRunReportsAnswersOnceAndClearsAtAReset) {
  events = Events(true);
  request_t request{};
  request.session = 4;
  request.kind = request_t::SPAWN;
  spawn_request_t spawn{};
  spawn.model = "p3at";
  request.body = encoded(spawn);
  request.size = static_cast<int32_t>(request.body.size());
  reply_t reply{};
  reply.session = 4;
  reply.kind = request_t::SPAWN;
  reply.utime = 2'000'000;
  const auto ask = [&](int64_t sequence, int code) {
    request.sequence = reply.sequence = sequence;
    reply.code = code;
    for (int i = 0; i < 2; ++i) hear(0, "ruedo/request", request);
    for (int i = 0; i < 2; ++i) hear(0, "ruedo/reply", reply);
  };
  ask(1, reply_t::OK);
  ask(2, reply_t::REFUSED);
  EXPECT_EQ(told(), std::vector<std::string>{"2 request : spawn p3at"});
  request.kind = reply.kind = request_t::RESET;
  request.body.clear();
  request.size = 0;
  reply.utime = 0;
  const uint64_t before = events.generation();
  ask(3, reply_t::OK);
  EXPECT_EQ(told(), std::vector<std::string>{"0 reset : reset"});
  EXPECT_NE(events.generation(), before);
}

// Of 1 MB for each request, and of any length in a world's file.
TEST_F(EventsTest, NamesOfAnyLengthAreShortened) {
  const std::string name(1 << 20, 'x');
  spawn_request_t spawn{};
  spawn.model = name;
  apply(1, request_t::SPAWN, encoded(spawn), "ruedo/request");
  touch(1, {});
  touch(2, {name});
  ASSERT_EQ(events.list().size(), 2u);
  for (const Event& event : events.list()) EXPECT_LE(event.text.size(), Events::kLongestText + 3);
}

TEST_F(EventsTest, FaultsOfTheRunItselfComeWhenTheirTimeDoes) {
  world::Fault late, early;
  early.robot = late.robot = "r";
  early.kind = "dropout";
  early.target = "lrf";
  early.at_s = 1.5;
  late.kind = "kidnapped";
  late.at_s = 4;
  events.plan({late, early});
  EXPECT_TRUE(told().empty());
  touch(2, {});
  EXPECT_EQ(told(), std::vector<std::string>{"1.5 fault r: dropout of lrf"});
  touch(4, {});
  EXPECT_EQ(told().back(), "4 fault r: kidnapped");
}

TEST_F(EventsTest, IgnoresMalformedMessagesAndLimitsTheList) {
  const std::vector<uint8_t> good = encoded(contact_t{});
  for (size_t size = 0; size < good.size(); ++size)
    events.hear(1, "x", std::span(good).first(size));
  EXPECT_TRUE(told().empty());
  move_command_t move{};
  for (size_t i = 0; i < Events::kMost + 5; ++i) apply(1, 0, encoded(move), "r/move");
  EXPECT_EQ(events.list().size(), Events::kMost);
}

class TapTest : public testing::Test {
 protected:
  void SetUp() override {
    auto announced = std::make_shared<run::Announcement>();
    announced->channels.add<contact_t>("a", "", "", {});
    announced->channels.add<contact_t>("b", "", "", {});
    announced->channels.add<velocity_command_t>("p3at/velocity", "p3at", "", {}, true);
    announcement = announced;
    tap.announce(announcement);
  }
  void publish(int place) {
    const engine::ChannelIndex index(place);
    tap.message({.kind = run::Kind::sample,
                 .time_us = 0,
                 .stamp_us = 0,
                 .channel = announcement->channels[index].bus_name,
                 .index = index,
                 .sequence = 0,
                 .data = &byte,
                 .size = 1});
  }
  std::vector<std::string> offered() {
    std::vector<std::string> names;
    tap.ring().drain([&](uint32_t channel, const std::vector<uint8_t>&) {
      names.push_back(tap.channel(channel).name);
    });
    return names;
  }

  std::shared_ptr<const run::Announcement> announcement;
  const uint8_t byte = 1;
  Tap tap;
};

TEST_F(TapTest, CountsAllAndOffersWantedChannels) {
  publish(0);
  EXPECT_THAT(offered(), testing::IsEmpty());  // nobody watches
  tap.watch(true);
  publish(0);
  tap.hear("p3at/velocity", &byte, 1);
  publish(1);
  EXPECT_THAT(offered(), testing::ElementsAre("a", "p3at/velocity", "b"));
  tap.channel(0).wanted = false;
  publish(0);
  publish(1);
  EXPECT_THAT(offered(), testing::ElementsAre("b"));
  EXPECT_EQ(tap.channel(0).messages, 3u);
}

TEST_F(TapTest, AcceptsCommandsOnTheRunsInputsOnly) {
  EXPECT_TRUE(tap.takes("p3at/velocity"));
  EXPECT_FALSE(tap.takes("a"));
  EXPECT_FALSE(tap.takes("c"));
}

// Later viewers get the state of the bodies when no further one will be published.
TEST_F(TapTest, KeepsTheNewestStateForLaterViewers) {
  auto announced = std::make_shared<run::Announcement>();
  announced->channels.add<world_state_t>("ruedo/world", "", "", {});
  announcement = announced;
  tap.announce(announcement);
  const auto tell = [&](int64_t utime, int16_t part, int16_t nparts) {
    world_state_t state{};
    state.utime = utime;
    state.part = part;
    state.nparts = nparts;
    const std::vector<uint8_t> bytes = encoded(state);
    tap.message({.kind = run::Kind::sample,
                 .time_us = utime,
                 .stamp_us = utime,
                 .channel = announcement->channels.list()[0].bus_name,
                 .index = engine::ChannelIndex(0),
                 .sequence = 0,
                 .data = bytes.data(),
                 .size = bytes.size()});
  };
  const auto taken = [&] {
    std::vector<std::pair<int64_t, int16_t>> times;
    for (const std::vector<uint8_t>& part : tap.take_state(tap.channel_count()).parts) {
      world_state_t state;
      EXPECT_GT(state.decode(part.data(), 0, static_cast<int>(part.size())), 0);
      times.emplace_back(state.utime, state.part);
    }
    return times;
  };
  using testing::ElementsAre, testing::IsEmpty, testing::Pair;
  EXPECT_THAT(taken(), IsEmpty());
  tell(1, 0, 1);
  tell(2, 0, 2);
  tell(2, 1, 2);
  EXPECT_THAT(tap.take_state(0).parts, IsEmpty());
  EXPECT_THAT(taken(), ElementsAre(Pair(2, 0), Pair(2, 1)));
  EXPECT_THAT(taken(), IsEmpty());  // once
  tap.watch(true);
  tell(3, 0, 1);
  EXPECT_THAT(taken(), IsEmpty());  // it is in the ring
  tap.watch(false);
  tell(4, 0, 1);
  tap.watch(true);
  EXPECT_THAT(taken(), ElementsAre(Pair(4, 0)));
}

// A reply goes out while the request's own thread still shows the request: both are seen.
TEST_F(TapTest, TwoThreadsOfferWithoutLoss) {
  constexpr int kEach = 20000;
  tap.watch(true);
  std::thread requests([&] {
    for (int i = 0; i < kEach; ++i) tap.hear("ruedo/request", &byte, 1);
  });
  for (int i = 0; i < kEach; ++i) publish(0);
  requests.join();
  EXPECT_THAT(offered(), testing::SizeIs(2 * kEach));
}

// A viewer that has just come, or just subscribed, gets the reply to its next request.
TEST_F(TapTest, AViewerMissesNothingAfterItsFirstMessage) {
  const auto world = std::make_shared<const world::WorldModel>();
  Stage stage;
  stage.source = std::make_unique<LiveSource>(tap,
                                              LiveHost{.world = [=] { return world; },
                                                       .model_text = {},
                                                       .on_message = {},
                                                       .lost = [] { return uint64_t{0}; },
                                                       .save_name = {}},
                                              "ruedo/info");
  const auto seen = [&](Viewer& viewer) {
    stage.source->pump(stage.board, true);
    size_t frames = 0;
    for (bool text = false; true;) {
      std::vector<uint8_t> message;
      if (!viewer.next(message, text)) return frames;
      frames += text ? 0 : 1;
    }
  };
  const std::vector<uint8_t> want_a{static_cast<uint8_t>(Operation::want), 'a'};

  stage.source->pump(stage.board, false);  // without a viewer
  Viewer viewer(stage);
  viewer.on_message(want_a);
  publish(0);  // the first on its channel
  EXPECT_EQ(seen(viewer), 1u);
  publish(0);  // the viewer has met the channel
  EXPECT_EQ(seen(viewer), 1u);

  Viewer late(stage);
  publish(1);
  EXPECT_EQ(seen(late), 0u);  // it has no subscription
  late.on_message(std::vector<uint8_t>{static_cast<uint8_t>(Operation::want), 'b'});
  publish(1);
  EXPECT_EQ(seen(late), 1u);
}

}  // namespace
}  // namespace ruedo::console
