// Rules for the arguments of every command.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace ruedo::cli {

// Refuses empty values of arguments: `--record "$LOG"` without a LOG must not mean that nothing is
// recorded. Refuses control characters, since values are printed, and names of files may come from
// an untrusted archive. Refuses values of flags. For all commands below app, before it
// parses.
void refuse_odd_values(CLI::App& app);

// Of `--seed`: what is wrong with it, or "".
std::string is_seed(const std::string& text);

// Whether two names are of one file, which need not be there yet. A device is another each time.
bool same_file(const std::string& a, const std::string& b);

// Refuses output files that the command also reads, or writes twice. Throws InputError. For a
// parsed command.
void check_outputs(const CLI::App& command);

}  // namespace ruedo::cli
