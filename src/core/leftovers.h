// Files that a process must not leave behind, however it is ended: a socket's name, the folder of a
// child process.
#pragma once

#include <string>

namespace ruedo {

// Marks a file or folder for as long as it lives. Removes nothing itself.
class Leftover {
 public:
  explicit Leftover(std::string path);
  ~Leftover();
  Leftover(const Leftover&) = delete;
  Leftover& operator=(const Leftover&) = delete;

 private:
  const std::string path_;
};

// Removes what is marked, before the process ends at once. Not in a signal handler.
void remove_leftovers();

}  // namespace ruedo
