// Sinks beside the bus: their messages, and that a slow one delays no other.
#include <atomic>
#include <condition_variable>
#include <mutex>

#include <gtest/gtest.h>

#include "base/channel_names.h"
#include "control_client.h"
#include "ruedo/pose_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "run/queued_sink.h"

namespace ruedo::run {
namespace {

// Records its calls; may be blocked.
class Notes : public Sink {
 public:
  explicit Notes(Hears hears = {}) : hears_(hears) {}
  Hears hears() const override { return hears_; }
  void announce(const std::shared_ptr<const Announcement>& announcement) override {
    note("channels " + std::to_string(announcement->channels.list().size()));
  }
  void begin_step(const Step& step) override { note("begin " + std::to_string(step.step)); }
  void message(const Published& message) override {
    note(message.channel + " " + std::to_string(message.sequence) + " of " +
         std::to_string(message.size));
  }
  void end_step(const Step& step) override { note("end " + std::to_string(step.step)); }

  void hold() {
    const std::lock_guard lock(mutex_);
    held_ = true;
  }
  void release() {
    const std::lock_guard lock(mutex_);
    held_ = false;
    changed_.notify_all();
  }
  void wait_until_waiting() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waiting_; });
  }
  std::vector<std::string> lines() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }

 private:
  void note(std::string line) {
    std::unique_lock lock(mutex_);
    waiting_ = held_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !held_; });
    waiting_ = false;
    lines_.push_back(std::move(line));
  }

  const Hears hears_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool held_ = false, waiting_ = false;
  std::vector<std::string> lines_;
};

void send_step(Sink& sink, int64_t step, const std::vector<uint8_t>& bytes) {
  const std::string channel = "r/camera";
  sink.begin_step({step, step * 5000, 0});
  sink.message({Kind::sample, step * 5000, step * 5000, channel, engine::ChannelIndex(3), step,
                bytes.data(), bytes.size()});
  sink.end_step({step, step * 5000, 0});
  sink.flush();
}

TEST(QueuedSink, WaitsIfItMayLoseNothing) {
  Notes notes;
  std::vector<std::string> expected;
  {
    QueuedSink queue(notes,
                     {.thread = "notes", .when_full = QueuedSink::WhenFull::wait, .most_bytes = 1});
    for (int64_t step = 0; step < 100; ++step) {
      send_step(queue, step, std::vector<uint8_t>(1000));
      const std::string number = std::to_string(step);
      expected.insert(expected.end(),
                      {"begin " + number, "r/camera " + number + " of 1000", "end " + number});
    }
    queue.drain();
    EXPECT_EQ(notes.lines(), expected);
    send_step(queue, 100, {});
    EXPECT_EQ(queue.missed(), 0u);
  }
  EXPECT_EQ(notes.lines().size(), 303u);  // what is in the queue at its end is handed on
}

TEST(QueuedSink, DropsWholeStepsInsteadOfWaiting) {
  Notes notes;
  notes.hold();
  QueuedSink queue(notes, {.thread = "notes", .most_bytes = 10'000});
  send_step(queue, 0, std::vector<uint8_t>(1000));
  notes.wait_until_waiting();  // in the first call, and nothing comes out from here on
  constexpr int64_t kSteps = 1000;
  for (int64_t step = 1; step < kSteps; ++step) send_step(queue, step, std::vector<uint8_t>(1000));
  queue.announce(std::make_shared<const Announcement>());
  EXPECT_GT(queue.missed(), kSteps - 20u);
  notes.release();
  queue.drain();
  send_step(queue, kSteps, {});
  queue.drain();
  const std::vector<std::string> lines = notes.lines();
  const auto begun = std::count_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.starts_with("begin");
  });
  EXPECT_EQ(static_cast<uint64_t>(begun) + queue.missed(), kSteps + 1u);
  ASSERT_GE(lines.size(), 7u);
  for (size_t i = 0; i + 4 < lines.size(); i += 3)
    EXPECT_TRUE(lines[i].starts_with("begin") && lines[i + 2].starts_with("end")) << i;
  EXPECT_EQ(lines[lines.size() - 4], "channels 0");  // which are known in any case
  EXPECT_EQ(lines.back(), "end 1000");
}

TEST(Run, HandsTheSameMessagesToEverySink) {
  MemoryBus bus;
  run::Run server(load_text(robot_sdf("r", 0, 0)), fast(0.1), bus);
  Notes samples, all({.samples = true, .records = true, .services = true});
  server.add(samples);
  server.add(all);
  server.run();
  std::map<std::string, int> by_bus, by_samples, by_all;
  for (const Message& message : bus.messages()) ++by_bus[message.channel];
  by_bus.erase(kReplyChannel);  // the run's last word, for clients alone
  const auto count = [](Notes& notes, std::map<std::string, int>& counts) {
    for (const std::string& line : notes.lines()) ++counts[line.substr(0, line.find(' '))];
  };
  count(samples, by_samples);
  count(all, by_all);
  EXPECT_EQ(by_samples["r/pose"], 6);  // at 0, 20, ..., 100 ms
  EXPECT_EQ(by_samples["begin"], 21);
  EXPECT_EQ(by_samples["channels"], 1);
  EXPECT_EQ(by_samples.count("ruedo/tick") + by_samples.count("ruedo/state_hash"), 0u);
  EXPECT_EQ(by_all["ruedo/state_hash"], 2);  // at 0 s, and at the end
  for (const auto& [channel, messages] : by_bus) EXPECT_EQ(by_all[channel], messages) << channel;
  EXPECT_GT(by_bus["ruedo/tick"], 0);
}

// Another middleware: it receives in a thread, and sends commands from there.
TEST(Run, TakesCommandsFromASink) {
  class Driver : public Sink {
   public:
    explicit Driver(std::function<void()> command) : command_(std::move(command)) {}
    void message(const Published& message) override {
      if (message.channel == "r/pose" && !std::exchange(sent_, true)) command_();
    }

   private:
    const std::function<void()> command_;
    bool sent_ = false;
  };
  MemoryBus bus;
  run::Run server(load_text(robot_sdf("r", 0, 0)), fast(1e6), bus);
  Driver driver([&] {
    velocity_command_t command{};
    command.vx = 0.5;
    server.on_message("r/velocity", engine::encoded(command));
  });
  QueuedSink queue(driver, {.thread = "driver"});
  server.add(queue);
  server.on_state([&](const Snapshot& state) {
    if (state.bodies[0].translation.x() > 0.1) server.stop();
  });
  server.run();  // ends because the robot drives
}

// The robot is there again, and its commands are received again.
TEST(Run, ListensToARobotThatAResetBringsBack) {
  class ListeningBus : public MemoryBus {
   public:
    void listen_to(const std::vector<std::string>& channels,
                   const std::vector<std::string>&) override {
      const std::lock_guard lock(mutex_);
      heard_ = channels;
    }
    bool hears(const std::string& channel) {
      const std::lock_guard lock(mutex_);
      return std::find(heard_.begin(), heard_.end(), channel) != heard_.end();
    }

   private:
    std::mutex mutex_;
    std::vector<std::string> heard_;
  };
  ControlledOn<ListeningBus> run;
  run.begin(paused_server(), robot_sdf("r", 0, 0));
  run.step(1);
  ASSERT_EQ(run.remove("r").code, reply_t::OK);
  EXPECT_FALSE(run.bus.hears("r/velocity"));
  ASSERT_EQ(run.reset(reset_request_t::ALL).code, reply_t::OK);
  EXPECT_TRUE(run.bus.hears("r/velocity"));
}

}  // namespace
}  // namespace ruedo::run
