// The web console: serves the page, and lets browsers see and steer what its source shows. In a
// thread of its own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "console/guard.h"
#include "console/source.h"

namespace ruedo::console {

class Console {
 public:
  static constexpr size_t kMostViewers = 128;

  // Starts to serve. mode: "live" or "log"; title: what is shown. Throws EnvironmentError when the
  // address cannot be had.
  Console(const Address& address, std::unique_ptr<Source> source, const std::string& mode,
          const std::string& title);
  // Tells the viewers that it is over, and ends.
  ~Console();

  // Where a browser finds it: "http://127.0.0.1:8080/", with the token where one is needed.
  const std::vector<std::string>& urls() const { return urls_; }

  // What the viewers are told at the end.
  void end(const std::string& words);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::vector<std::string> urls_;
};

}  // namespace ruedo::console
