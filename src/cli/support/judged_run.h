// A run that is judged, with the client that it starts: what `ruedo regress` does before it looks
// at files.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cli/support/ros2.h"
#include "cli/support/signal_thread.h"
#include "engine/judge/judge.h"
#include "run/run.h"

namespace ruedo::cli {

struct JudgedRunOptions {
  run::RunOptions run;
  Ros2Arguments ros2;
  bool isolated = false;      // this process is in a network of its own
  std::string client;         // command line; "": none
  bool waits = true;          // for the client to be heard on the bus
  bool allow_errors = false;  // in the world, and in what comes into it
  double grace_s = 5.0;       // real time that the client has to end after the run
  double timeout_s = 600.0;   // real time without a step, after which the run is ended
};

// A world with missing parts is not the intended one.
judge::Check world_check(const Finding& error);

// Returns the checks of the client, of what ended the run, and of what came into the world.
std::vector<judge::Check> run_judged(const std::shared_ptr<const world::WorldModel>& world,
                                     JudgedRunOptions options, judge::Judge& judge,
                                     SignalThread& signals);

}  // namespace ruedo::cli
