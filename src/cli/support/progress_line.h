// One line on a terminal that says how far a command is, when it takes longer than a second: what
// it does, the part that is done, and the time that is left. Standard error only; nothing where
// that is no terminal.
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
