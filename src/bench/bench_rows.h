// The measurements of ruedo bench: a row is a JSON object on one line, measured in a process of its
// own, so that its memory and its start are its own too.
#pragma once

#include <string>
#include <vector>

namespace ruedo::bench {

struct BenchTask {
  // robots: messages to a sink that counts; lcm: onto LCM; camera: with the robots' cameras on;
  // latency: of commands at
  // --rate 1, and the pacing of the loop; rays: of the caster alone, in the rooms of so many
  // robots.
  enum class Table { robots, lcm, camera, latency, rays };
  Table table = Table::robots;
  int robots = 1;           // of latency: always one
  double duration_s = 0.0;  // sim time; 0: by the task
  int threads = 0;          // most inside a module; 0: one a core
  std::string lcm;          // address of lcm and latency
};

const char* name_of(BenchTask::Table table);

// Measures in this process. Throws EnvironmentError.
std::vector<std::string> measure(const BenchTask& task);
std::vector<std::string> measure_latency(
    const BenchTask& task);  // before any thread has started: it forks
std::vector<std::string> measure_rays(const BenchTask& task);

// The same in a child process. Throws EnvironmentError.
std::vector<std::string> measure_apart(const BenchTask& task);

// A number out of one of these rows; 0 when it is not there.
double value_of(const std::string& row, const std::string& key);

}  // namespace ruedo::bench
