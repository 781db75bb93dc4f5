// Pictures without a reader are not drawn, and those with a reader are the same as ever.
#include <atomic>
#include <mutex>
#include <set>

#include <gtest/gtest.h>

#include "control_client.h"
#include "ruedo/image_t.hpp"

namespace ruedo::run {
namespace {

// Knows its listeners, as a bus with connections does.
class HeardBus : public MemoryBus {
 public:
  void hear(const std::string& channel) {
    const std::lock_guard lock(mutex_);
    heard_.insert(channel);
    ++audience_;
  }
  bool is_heard(const std::string& channel) const override {
    const std::lock_guard lock(mutex_);
    return heard_.contains(channel);
  }
  uint64_t audience() const override { return audience_; }

 private:
  mutable std::mutex mutex_;
  std::set<std::string> heard_;
  std::atomic<uint64_t> audience_{0};
};

// 20 pictures of noise a second: one every ten steps.
const std::string kEye =
    "<sensor name='eye' type='camera'><update_rate>20</update_rate><camera>"
    "<horizontal_fov>1.2</horizontal_fov><image><width>16</width><height>12</height></image>"
    "<clip><near>0.05</near><far>50</far></clip>"
    "<noise><type>gaussian</type><mean>0</mean><stddev>0.05</stddev></noise></camera>"
    "<ruedo:encoding>rgb</ruedo:encoding></sensor>";

std::vector<std::vector<uint8_t>> on(MemoryBus& bus, const std::string& channel) {
  std::vector<std::vector<uint8_t>> found;
  for (const Message& message : bus.messages()) {
    if (message.channel == channel) found.push_back(message.bytes);
  }
  return found;
}

std::vector<int64_t> times(MemoryBus& bus, const std::string& channel) {
  std::vector<int64_t> found;
  for (const auto& bytes : on(bus, channel)) found.push_back(decoded_as<image_t>(bytes).utime);
  return found;
}

TEST(UnreadPictures, ALateReaderGetsTheSamePictures) {
  MemoryBus everything;
  run::Run(load_text(robot_sdf("r", 0, 0, kEye)), fast(3.0), everything).run();
  HeardBus bus;
  bus.hear("r/pose");
  run::Run server(load_text(robot_sdf("r", 0, 0, kEye)), fast(3.0), bus);
  server.on_state([&](const Snapshot& state) {
    if (state.step == 100) bus.hear("r/eye");
  });
  server.run();
  const auto all = on(everything, "r/eye"), late = on(bus, "r/eye");
  ASSERT_EQ(all.size(), 61u);
  // Not those of the first 100 steps, but soon: at most 4 batches of 32 steps are in flight.
  ASSERT_LT(late.size(), 51u);
  ASSERT_GT(late.size(), 30u);
  for (size_t i = 0, first = all.size() - late.size(); i < late.size(); ++i)
    EXPECT_EQ(late[i], all[first + i]) << "picture " << first + i;
  for (const char* channel : {"r/pose", "r/odometry", "ruedo/world"}) {
    EXPECT_FALSE(on(bus, channel).empty());
    EXPECT_EQ(on(bus, channel), on(everything, channel)) << channel;
  }
}

TEST(UnreadPictures, ALogHasAll) {
  HeardBus bus;
  std::atomic<int> pictures = 0, intrinsics = 0;
  RunOptions options = fast(1.0);
  options.watcher = [&](SimTime, const std::string& channel, const uint8_t*, size_t) {
    pictures += channel == "r/eye";
    intrinsics += channel == "r/eye/info";
  };
  run::Run(load_text(robot_sdf("r", 0, 0, kEye)), options, bus).run();
  EXPECT_EQ(pictures, 21);
  EXPECT_EQ(intrinsics, 21);
}

// A client that subscribes before a STEP or a RESET gets its pictures.
TEST(UnreadPictures, AStepDrawsForItsSubscribers) {
  ControlledOn<HeardBus> server;
  RunOptions options = fast(1e9);
  options.paused = true;
  server.begin(options, robot_sdf("r", 0, 0, kEye));
  server.step(10);
  EXPECT_EQ(times(server.bus, "r/eye"), std::vector<int64_t>{});
  server.bus.hear("r/eye");
  server.step(15);
  EXPECT_EQ(times(server.bus, "r/eye"), std::vector<int64_t>{100'000});
  server.reset(reset_request_t::ALL);
  server.step(15);
  EXPECT_EQ(times(server.bus, "r/eye"), (std::vector<int64_t>{100'000, 0, 50'000}));
}

}  // namespace
}  // namespace ruedo::run
