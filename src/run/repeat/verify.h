// Repeats a log's run from its recorded inputs and checks that the bytes are the log's.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "run/run.h"

namespace ruedo::run {

// The first place where a repetition is not what the log holds.
struct FirstDifference {
  std::string channel;
  int32_t epoch = 0;
  int64_t step = 0;
  SimTime time_us = 0;  // sim time of that step
  std::string
      field;  // "ranges[3]"; "" when the messages themselves differ: one is missing, or another's
  std::string logged, repeated;
};

struct Verification {
  int64_t messages = 0;  // compared, and equal
  int64_t bytes = 0;
  SimTime time_us = 0;  // of the run, all epochs together
  std::string fault;    // why the log breaks off; "" when it is whole
  std::optional<FirstDifference> difference;
};

class Verifier {
 public:
  // world and options as the log's header has them. Throws InputError and EnvironmentError.
  Verifier(const std::string& log, std::shared_ptr<const world::WorldModel> world,
           RunOptions options);
  ~Verifier();

  // In what this machine and program differ from the log's, a line each: then a difference says
  // nothing about determinism.
  const std::vector<std::string>& machine_differences() const;
  // Throws InputError when the files that were read now are not the log's.
  void check_same_run() const;

  Verification run();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
  std::string log_;
};

}  // namespace ruedo::run
