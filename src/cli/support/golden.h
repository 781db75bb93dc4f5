// A golden log: a run is compared with it, or renews it.
#pragma once

#include <string>
#include <vector>

#include "log/diff.h"

namespace ruedo::cli {

struct Golden {
  std::string log;
  std::vector<std::string> keep;     // shell patterns of the channels that it holds
  std::vector<log::DiffRule> rules;  // what may differ
  std::string html;                  // a page that shows what does; "": none
};

// The compared messages are stored beside the log of the run, under its name and this.
inline constexpr const char* kKept = ".kept";

// Compares a run's log with it, or renews it. Returns the difference, or "". Throws InputError if a
// pattern of `keep` matches no channel, and EnvironmentError.
std::string hold_to_golden(const Golden& golden, const std::string& record, bool renew);

// By RUEDO_RENEW. Throws InputError for what is neither yes nor no.
bool is_told_to_renew();

}  // namespace ruedo::cli
