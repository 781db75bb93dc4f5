// A run that goes on by itself, paced by real time alone, or by messages that it waits for
// (--wait-for).
#pragma once

#include <memory>
#include <vector>

#include "run/mode.h"
#include "run/wait_for.h"

namespace ruedo::run {

class Live : public Mode {
 public:
  Live(const std::vector<WaitForOption>& wait_for, int64_t step_us);

  void begin(const Stage& stage, int64_t step) override;
  Attended attend(const std::vector<Session>& sessions, int64_t step, Time now) override;
  bool receive(const std::string& channel, const uint8_t* data, size_t size) override;

 private:
  const int64_t step_us_;
  std::unique_ptr<WaitFor> wait_for_;  // null: for nobody
  Gate* gate_ = nullptr;
  int64_t wait_step_ = -1;  // the run has been at this step
  Time wait_begin_{};       // since then
  bool told_ = false;
};

}  // namespace ruedo::run
