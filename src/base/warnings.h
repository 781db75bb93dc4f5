// The warnings of this program, for viewers beside its terminal.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace ruedo {

struct Warning {
  std::string kind;  // "warning", "error", "unsupported" or "repaired"
  std::string text;
};

constexpr size_t kMostWarnings = 500;  // the last one says that the terminal has more

// From any thread.
void keep_warning(std::string kind, std::string text);
// Those from that index on.
std::vector<Warning> warnings_from(size_t first);

}  // namespace ruedo
