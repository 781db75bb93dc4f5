// --view: the web console beside a run or a log. Without the console in this build it says what is
// missing.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace ruedo::run {
class Run;
struct RunOptions;
}  // namespace ruedo::run

namespace ruedo::cli {

// The console of a run that is viewed. Made before the run, which it outlives.
class RunView {
 public:
  // Throws InputError for a bad address, EnvironmentError when this build has no console.
  RunView(bool viewed, const std::string& address);
  ~RunView();

  // The required options of the run.
  void follow(run::RunOptions& options);

  // Serves the console for as long as the returned object lives, and prints where. Null when it is
  // not viewed. Before run.run(). Throws EnvironmentError when the address cannot be had. The run
  // must outlive what is returned. save: the file that SAVE writes; "" for none.
  std::shared_ptr<void> open(run::Run& run, const std::string& title, const std::string& save);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;  // null: not viewed
};

// Serves the console with a recorded run for as long as the returned object lives, and prints
// where, after a call of ready(). speed: log time per real time. other: a log to compare it with;
// "" for none. Throws InputError if the file is not a log, and EnvironmentError as RunView does.
std::shared_ptr<void> view_log(const std::string& log, const std::string& address, double speed,
                               const std::string& other, const std::function<void()>& ready);

// Writes a recorded run as one HTML file that needs no server, of that size at most, and prints
// its contents. Throws InputError if the file is not a log or does not fit, and EnvironmentError if
// the file cannot be written or this build has no console.
void write_page(const std::string& log, const std::string& path, double most_megabytes);

}  // namespace ruedo::cli
