// What holds for the arguments of every command.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace ruedo::cli {

// An argument that takes a value takes no empty one: `--record "$LOG"` without a LOG must not mean
// that nothing is recorded. Nor one with control characters, since values are printed, and names of
// files may come from a stranger's archive. A flag takes none. Of all commands below app, before it
// parses.
void refuse_odd_values(CLI::App& app);

// Of `--seed`: what is wrong with it, or "".
std::string is_seed(const std::string& text);

// Whether two names are of one file, which need not be there yet. A device is another each time.
bool same_file(const std::string& a, const std::string& b);

// What a command writes must be none of what it reads, nor another file that it writes. Throws
// InputError. Of a command that was parsed.
void check_outputs(const CLI::App& command);

}  // namespace ruedo::cli
