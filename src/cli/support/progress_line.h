// One line on a terminal with the progress of a command that takes longer than a second: its task,
// the finished part, and the remaining time. Standard error only; nothing if that is not a
// terminal.
#pragma once

#include <string>

namespace ruedo::cli {

// From now on, in a thread, until end() or the end of the program.
void begin_progress_line();
// For a command that draws a line of its own from now on. Returns whether there was one.
bool end_progress_line();

// For such a line: how far that is which runs now; "": nothing.
std::string progress_text();

}  // namespace ruedo::cli
