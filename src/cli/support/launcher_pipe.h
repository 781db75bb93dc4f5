// Standard input as a pipe from the program that launched this one.
//
// The program writes there how far it has come (run/backpressure.h). When the pipe ends, so does
// the run, as after SIGTERM: the kernel closes it however that program ends.
#pragma once

#include <memory>
#include <optional>

#include "run/run.h"

namespace ruedo::cli {

class LauncherPipe {
 public:
  // Its thread waits in read() for as long as the process lives. waits: the run waits for the
  // program from its beginning on, else from the program's first line on.
  explicit LauncherPipe(bool waits);

  // While one lives, the run is not left ahead of the program; with no pipe it does nothing.
  class Pacing {
   public:
    Pacing(std::optional<LauncherPipe>& pipe, run::Run& run);
    ~Pacing();
    Pacing(const Pacing&) = delete;
    Pacing& operator=(const Pacing&) = delete;

   private:
    std::optional<LauncherPipe>& pipe_;
  };

 private:
  struct Paced;
  void pace(run::Run* run);  // null: none

  const std::shared_ptr<Paced> paced_;
};

}  // namespace ruedo::cli
