// The web console: serves the page, and lets browsers watch and steer what its source shows. Runs
// in a thread of its own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "console/source.h"
#include "http/guard.h"

namespace ruedo::console {

class Console {
 public:
  static constexpr size_t kMostViewers = 128;

  // Starts serving. mode: "live" or "log"; title: what is shown. Throws EnvironmentError if the
  // address is not available.
  Console(const http::Address& address, std::unique_ptr<Source> source, const std::string& mode,
          const std::string& title);
  // Tells the viewers that the run has ended, and stops.
  ~Console();

  // The address for browsers: "http://127.0.0.1:8080/", with the token if one is needed.
  const std::vector<std::string>& urls() const { return urls_; }

  // The last message to viewers.
  void end(const std::string& words);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::vector<std::string> urls_;
};

}  // namespace ruedo::console
