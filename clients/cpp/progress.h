// How far a program has come in a run that it launched: the server waits for it there.
//
// A run at the highest rate takes a second of sim time in less than a millisecond. A program that
// looks at a sensor and then commands would act on a world that has changed since. So it reports to
// its server up to which sim time it has received, and the sim time of the samples in use.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace ruedo::client {

// Thread safe. Until begin() no server waits for this program.
class Progress {
 public:
  using Threads = std::vector<std::thread::id>;

  // The program works with what is known at that sim time until its first use(), wait() or
  // listen(), however long that takes. tell: writes a line to the server, which may be lost; the
  // next one says all that it did.
  void begin(std::function<void(const std::string& line)> tell, int32_t epoch, int64_t utime);
  bool is_told() const { return told_; }
  // Progress must be reported again soon: a thread is using a sample.
  bool in_use() const;
  // All that the server sent up to that sim time has come, and callbacks have seen it.
  void received(int32_t epoch, int64_t utime);
  // These threads use samples of that sim time.
  void use(int64_t utime, const Threads& threads = {std::this_thread::get_id()});
  // The caller's thread waits for messages of the server.
  void wait();
  // Callbacks get what the server sends.
  void listen();
  // While a thread works the run goes on as in real time.
  void say();

 private:
  struct Use {
    int64_t utime;
    std::chrono::steady_clock::time_point since;
  };
  void end_uses(const Threads& threads);
  void say_locked();

  std::atomic<bool> told_{false};
  mutable std::mutex mutex_;  // what follows
  std::function<void(const std::string& line)> tell_;
  int32_t epoch_ = 0;
  int64_t received_ = 0;  // us of sim time
  std::map<std::thread::id, Use> uses_;
  std::string last_;  // reported line
};

// The pipe that reports the progress of a launched client to `ruedo regress`
// (docs/protocol.md).
class ToRegression {
 public:
  // The regression at that address that launched this program; null if there is none.
  static std::unique_ptr<ToRegression> at(const std::string& url);

  explicit ToRegression(int descriptor);
  ~ToRegression();
  ToRegression(const ToRegression&) = delete;
  // Where the pipe is full, a later line says it all.
  void tell(const std::string& line) const;

 private:
  const int descriptor_;
  const std::string sender_;
};

}  // namespace ruedo::client
