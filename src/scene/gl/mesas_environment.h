// The environment that Mesa sees, in which pictures are the same on every host.
//
// Mesa has hundreds of variables, set by hosts for their desktops: a driver that does not draw into
// memory, a version of OpenGL, a debugging aid. Some end the process, some change pixels. Ruedo's
// own contexts see none but those that say where files lie and how many threads draw; the process
// and its children keep theirs.
#pragma once

#include <mutex>
#include <string>
#include <vector>

namespace ruedo::scene {

// For as long as it lives, this is the process's environment: make contexts meanwhile. One thread
// at a time; others may read the environment, and see it without Mesa's variables.
// It makes Mesa treat every x86-64 CPU as one with SSE 4.1: Mesa draws with its widest vectors,
// and the width affects the last bits. That takes about a sixth more time. No effect on other
// processors and on CPUs without SSE 4.1.
// And it has Mesa keep its cache of compiled shaders as a database: by default the cache's index is
// mapped into memory, and a full disk ends the process (SIGBUS).
class MesasEnvironment {
 public:
  MesasEnvironment();
  ~MesasEnvironment();
  MesasEnvironment(const MesasEnvironment&) = delete;
  MesasEnvironment& operator=(const MesasEnvironment&) = delete;

 private:
  std::lock_guard<std::mutex> alone_;
  char **before_, **ours_;
};

// Mesa's variables that the process has and that are set aside, as NAME=VALUE, sorted.
std::vector<std::string> mesas_variables();

// For all contexts that are made from now on; call these while there is only one thread.
void draw_as_fast_as_it_goes();  // with all that the CPU has
void heed_mesas_variables();
bool heeds_mesas_variables();

}  // namespace ruedo::scene
