// A run that advances by itself, paced by real time alone, or by messages that it waits for
// (--wait-for).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "run/mode.h"
#include "run/wait_for.h"

namespace ruedo::run {

class Live : public Mode {
 public:
  Live(const std::vector<WaitForOption>& wait_for, int64_t step_us);

  void begin(const Stage& stage, int64_t step) override;
  void models_changed(const Stage& stage, int64_t step) override;
  std::string waits_for(int64_t step) const override;
  bool on_message(const std::string& channel, const uint8_t* data, size_t size) override;

 private:
  std::unique_ptr<WaitFor> wait_for_;  // null: for no client
};

}  // namespace ruedo::run
