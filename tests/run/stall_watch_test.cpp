// A run that does not progress says why: the client, sensor, request or sink that it waits for.
#include <atomic>
#include <condition_variable>
#include <future>
#include <mutex>
#include <semaphore>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "control_client.h"
#include "run/stall_watch.h"
#include "system/file_handle.h"
#include "temporary_folder.h"

namespace ruedo::run {
namespace {

using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;

const StallWatch::Clock::time_point kStart = StallWatch::Clock::now();

TEST(StallWatch, ReportsOnceWhatTheRunWaitsFor) {
  std::vector<std::string> told;
  {
    StallWatch watch({.tell = [&](const std::string& reason) { told.push_back(reason); },
                      .takes_none = [] { return std::string(); }});
    const auto idle = [&](int second, const std::string& why) {
      watch.idle(kStart + seconds(second), [&] { return why; });
    };
    watch.moved(kStart);
    idle(1, "too early");
    idle(2, "it waits for 'a'");
    idle(3, "it was told");
    watch.moved(kStart + seconds(4));  // it takes some seconds each time, and is reported once
    idle(8, "it waits for 'a'");
    watch.moved(kStart + seconds(9));
    idle(12, "it waits for 'b'");
    watch.moved(kStart + seconds(20));
    idle(40, "");  // it rests, as it should
  }
  std::erase_if(told, [](const std::string& why) { return why.starts_with("this process was"); });
  EXPECT_THAT(told, ElementsAre("it waits for 'a'", "it waits for 'b'"));
}

// Records what is reported, and waits for a report.
class Told {
 public:
  // slow: the report that a slow machine may give first.
  explicit Told(std::string slow = "this process did not run") : slow_(std::move(slow)) {}
  // Whether it is about the run: before that, a loaded machine may have held this process up.
  bool tell(const std::string& reason) {
    if (reason.starts_with("this process did not run") || reason.starts_with(slow_)) return false;
    const std::lock_guard lock(mutex_);
    reason_ = reason;
    changed_.notify_all();
    return true;
  }
  std::string wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !reason_.empty(); });
    return reason_;
  }
  void close() { open_ = false; }
  bool is_open() const { return open_; }

 private:
  std::atomic<bool> open_{true};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string reason_;
  std::string slow_;
};

TEST(StallWatch, ReportsTheRequestThatDelaysThePublisher) {
  Told told;
  StallWatch watch({.tell = [&](const std::string& reason) { told.tell(reason); },
                    .takes_none = [] { return std::string("the bus"); }});
  watch.beat("RESTORE of 'planner'");
  EXPECT_EQ(told.wait(), "a request is being executed: RESTORE of 'planner'");
}

// Standard error may be a pipe without a reader.
TEST(StallWatch, ARunContinuesIfNobodyReadsItsWarnings) {
  std::counting_semaphore begun(0), taken(0);
  StallWatch watch({.tell =
                        [&](const std::string&) {
                          begun.release();
                          taken.acquire();
                          taken.release();  // from now on at once
                        },
                    .takes_none = [] { return std::string("the bus"); }});
  watch.beat("RESTORE of 'planner'");
  begun.acquire();
  auto publisher = std::async(std::launch::async, [&] {
    watch.beat("SPAWN of 'planner'");
    watch.moved(kStart);
    watch.idle(kStart + seconds(2), [] { return std::string("it waits for 'a'"); });
  });
  EXPECT_EQ(publisher.wait_for(seconds(20)), std::future_status::ready);
  taken.release();
}

// A run that is blocked until it has said why.
std::string reason_of(RunOptions options, const std::string& inside, MemoryBus& bus, Told& told) {
  Run run(load_text(robot_sdf("r", 0, 0, inside)), std::move(options), bus);
  run.on_stall([&](const std::string& reason) {
    if (told.tell(reason)) run.stop();
  });
  run.run();
  return told.wait();
}

TEST(StallWatch, ReportsTheClientsThatLockstepWaitsFor) {
  MemoryBus bus;
  Told told;
  RunOptions options = fast(1);
  options.lockstep.clients = 2;
  EXPECT_THAT(reason_of(options, "", bus, told), HasSubstr("it waits for 2 more of 2 clients"));
}

TEST(StallWatch, ReportsTheMissingChannel) {
  MemoryBus bus;
  Told told;
  RunOptions options = fast(1);
  options.wait_for = {{"r/velocity", {10, 1}}};
  EXPECT_THAT(reason_of(options, "", bus, told),
              HasSubstr("the input of --wait-for, message 0 on r/velocity"));
}

TEST(StallWatch, ReportsTheBusyModule) {
  MemoryBus bus;
  Told told;
  RunOptions options = fast(1);
  options.simulation.before_batch = [&](const std::string& module) {
    if (module == "lrf") told.wait();
  };
  const std::string lrf =
      "<sensor name='front' type='gpu_ray'><update_rate>10</update_rate><ray><scan><horizontal>"
      "<samples>5</samples><min_angle>-1</min_angle><max_angle>1</max_angle></horizontal></scan>"
      "<range><min>0.1</min><max>8</max></range></ray></sensor>";
  EXPECT_THAT(reason_of(options, lrf, bus, told), HasSubstr("the module lrf is computing"));
}

TEST(StallWatch, NamesTheBus) {
  MemoryBus bus;
  Told told;
  bus.on_publish = [&](const std::string& channel) {
    if (channel == "r/odometry") told.wait();
  };
  EXPECT_EQ(reason_of(fast(1), "", bus, told), "the bus takes no messages");
}

// A disk that takes no more than a pipe does, until the run has said why it stands.
std::string reason_with_a_full_pipe(int samples, double seconds) {
  const TemporaryFolder folder;
  const std::string pipe = folder / "run.lcm";
  EXPECT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const FileHandle end(::open(pipe.c_str(), O_RDWR | O_CLOEXEC));
  MemoryBus bus;
  Told told("the module lrf is computing");
  RunOptions options = fast(seconds);
  options.record = pipe;
  const std::string lrf =
      "<sensor name='front' type='gpu_ray'><update_rate>100</update_rate><ray><scan><horizontal>"
      "<samples>" +
      std::to_string(samples) +
      "</samples><min_angle>-1</min_angle>"
      "<max_angle>1</max_angle></horizontal></scan><range><min>0.1</min><max>8</max></range></ray>"
      "</sensor>";
  std::thread reader([&] {
    told.wait();
    ::fcntl(end.get(), F_SETFL, O_NONBLOCK);
    for (std::vector<char> bytes(1 << 20); told.is_open();) {
      if (::read(end.get(), bytes.data(), bytes.size()) < 0) std::this_thread::yield();
    }
  });
  const std::string reason = reason_of(options, lrf, bus, told);
  told.close();
  reader.join();
  return reason;
}

TEST(StallWatch, NamesTheDisk) {
  const auto names_it = HasSubstr("the disk of --record does not take the log");
  EXPECT_THAT(reason_with_a_full_pipe(10'000, 60), names_it) << "the queue is full";
  EXPECT_THAT(reason_with_a_full_pipe(1000, 1), names_it) << "the run has ended";
}

TEST(StallWatch, APausedOrSlowRunIsNotStalled) {
  Pacer pacer(5000, 0.001, 1000);  // a step takes 5 s
  EXPECT_FALSE(pacer.rests());     // step 0 is due
  int64_t step = -1;
  EXPECT_EQ(pacer.wait(step, 8), 1);
  EXPECT_TRUE(pacer.rests());
  pacer.set_rate(std::numeric_limits<double>::infinity());
  EXPECT_FALSE(pacer.rests());
  pacer.pause();
  EXPECT_TRUE(pacer.rests());
  pacer.allow(2);
  EXPECT_FALSE(pacer.rests());
}

}  // namespace
}  // namespace ruedo::run
