// For the child, between fork and exec or in its own work.
#pragma once

#include <csignal>

#include <sys/prctl.h>
#include <sys/types.h>
#include <unistd.h>

namespace ruedo {

// The kernel kills this process when the thread that made it ends, however that happens. parent:
// getpid() before the fork; when it has ended already, this process ends here. System calls only.
inline void end_with_parent(pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);
}

}  // namespace ruedo
