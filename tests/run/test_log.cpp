// Logs: the format, the header, the applied commands, and a full disk.
#include <algorithm>

#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>

#include "base/sha256.h"
#include "full_disk.h"
#include "log/header.h"
#include "log/reader.h"
#include "log/writer.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/log_header_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "running.h"
#include "system/late_library.h"

namespace ruedo::run {
namespace {

TEST(Sha256, KnownAnswers) {
  const auto of = [](const std::string& text) {
    return sha256(reinterpret_cast<const uint8_t*>(text.data()), text.size());
  };
  // The examples of FIPS 180-4.
  EXPECT_EQ(of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(of(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Writer, LcmReadsItsEvents) {
  const TemporaryFile file("events.lcmlog");
  {
    log::Writer log(file.path());
    const uint8_t bytes[] = {1, 2, 3};
    log.write(0, "first", bytes, 3);
    log.write(1'234'567'890'123, "second", bytes, 0);
  }
  lcm::LogFile log(file.path(), "r");
  ASSERT_TRUE(log.good());
  const lcm::LogEvent* event = log.readNextEvent();
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->eventnum, 0);
  EXPECT_EQ(event->timestamp, 0);
  EXPECT_EQ(event->channel, "first");
  ASSERT_EQ(event->datalen, 3);
  EXPECT_EQ(static_cast<const uint8_t*>(event->data)[2], 3);
  event = log.readNextEvent();
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->eventnum, 1);
  EXPECT_EQ(event->timestamp, 1'234'567'890'123);
  EXPECT_EQ(event->channel, "second");
  EXPECT_EQ(log.readNextEvent(), nullptr);
}

TEST(Writer, TwoDoNotWriteIntoOneFile) {
  const TemporaryFile file("two.lcmlog");
  {
    log::Writer first(file.path());
    const uint8_t byte = 1;
    first.write(0, "first", &byte, 1);
    EXPECT_THROW(log::Writer{file.path()}, EnvironmentError);
  }
  log::Reader reader(file.path());
  log::Event event;
  ASSERT_TRUE(reader.next(event));
  EXPECT_EQ(event.channel, "first");
  EXPECT_NO_THROW(log::Writer{file.path()});  // whose writer has ended
}

TEST(Writer, ReportsAFullDisk) {
  log::Writer log("/dev/full");
  const uint8_t bytes[1000] = {};
  log.write(0, "channel", bytes, sizeof bytes);
  EXPECT_EQ(log.error(), "");
  log.flush();
  EXPECT_NE(log.error().find("No space left on device"), std::string::npos);
  EXPECT_THROW(log::Writer("/nowhere/at/all.lcmlog"), EnvironmentError);
}

// However many bytes there is room for, the log ends with a complete event.
TEST(Writer, ADiskThatFillsAtAnyByteLeavesAReadableLog) {
  const uint8_t bytes[100] = {};
  constexpr int64_t kEvent = 28 + 7 + 100;  // head, channel, data
  for (rlim_t room = 0; room <= 5 * kEvent; room += 5) {
    const TemporaryFile file("full.lcm");
    {
      const FullDisk disk(room);
      log::Writer log(file.path());
      for (int64_t time = 0; time < 5; ++time) {
        log.write(time, "channel", bytes, sizeof bytes);
        if (time % 2 == 1) log.flush();  // one or two events in a write
      }
      log.flush();
      EXPECT_EQ(log.error().empty(), room == 5 * kEvent) << room << log.error();
    }
    log::Reader reader(file.path());
    int64_t events = 0;
    for (log::Event event; reader.next(event);) EXPECT_EQ(event.timestamp_us, events++);
    EXPECT_EQ(reader.fault(), "") << room;
    EXPECT_EQ(events, static_cast<int64_t>(room) / kEvent);
  }
}

TEST(Recording, ListsLibrariesThatAreNotLoadedYet) {
  const std::vector<std::string> before = log::libraries_that_matter();
  load_late_libraries();
  EXPECT_EQ(before, log::libraries_that_matter());
  EXPECT_TRUE(std::any_of(before.begin(), before.end(), [](const std::string& name) {
    return name.starts_with("libopencv_imgcodecs.so");
  }));
}

TEST(Recording, AFullDiskEndsTheRun) {
  RunOptions options = fast(600.0);
  options.record = "/dev/full";
  MemoryBus bus;
  bus.keep = false;
  run::Run server(load_text(robot_sdf("r", 0, 0)), options, bus);
  try {
    server.run();
    FAIL() << "it ran on";
  } catch (const EnvironmentError& error) {
    EXPECT_NE(std::string(error.what()).find("No space left"), std::string::npos);
  }
}

TEST(Recording, HoldsTheInputsOfARepetition) {
  const TemporaryFile file("run.lcmlog");
  RunOptions options = fast(1.0, 42);
  options.record = file.path();
  options.result_options = {"--no-noise"};
  MemoryBus bus;
  velocity_command_t command{};
  command.vx = 0.3;
  {
    run::Run server(load_text(robot_sdf("r", 0, 0)), options, bus);
    server.on_message("r/velocity", engine::encoded(command));
    server.run();
  }
  lcm::LogFile log(file.path(), "r");
  int64_t last = 0, number = 0, applied_count = 0;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    const auto* data = static_cast<const uint8_t*>(event->data);
    const auto size = static_cast<size_t>(event->datalen);
    EXPECT_GE(event->timestamp, last);
    last = event->timestamp;
    EXPECT_NE(event->channel, "ruedo/tick");
    EXPECT_NE(event->channel, "ruedo/info");
    if (number++ == 0) {
      EXPECT_EQ(event->channel, "ruedo/header");
      log_header_t header;
      ASSERT_EQ(decode_checked(data, size, header), DecodeFault::none);
      EXPECT_EQ(header.seed, 42);
      EXPECT_EQ(header.step_us, 5000);
      ASSERT_EQ(header.noptions, 1);
      EXPECT_EQ(header.options[0], "--no-noise");
      EXPECT_GT(header.nlibraries, 3);
    }
    if (event->channel != "ruedo/applied") continue;
    ++applied_count;
    applied_t applied;
    ASSERT_EQ(decode_checked(data, size, applied), DecodeFault::none);
    EXPECT_EQ(applied.step, 0);  // it acted on the initial state
    EXPECT_EQ(applied.channel, "r/velocity");
    EXPECT_EQ(std::vector<uint8_t>(applied.data.begin(), applied.data.end()),
              engine::encoded(command));
  }
  EXPECT_EQ(applied_count, 1);
  EXPECT_EQ(last, 1'000'000);
}

}  // namespace
}  // namespace ruedo::run
