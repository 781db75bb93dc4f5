// ruedo render LOG --video FILE: a recorded run as a video.
#pragma once

#include <optional>
#include <string>

#include "run/repeat/log_worlds.h"

namespace ruedo::report {

struct VideoArguments {
  std::string log, video, view, size, follow;
  double fps = 30.0;
  double rate = 1.0;                   // log time per video time
  std::optional<double> from_s, to_s;  // log time, from its beginning
};

// load: the run of that log. Throws InputError for what is wrong with the arguments or the log, and
// EnvironmentError.
void render_video(const VideoArguments& arguments, const run::LoadRun& load);

}  // namespace ruedo::report
