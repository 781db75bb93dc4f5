// namespaces(7); as root, or in a user namespace of this user's.
#include "system/isolation.h"

#include <cstdlib>
#include <cstring>
#include <string>

#include <arpa/inet.h>
#include <fcntl.h>
#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "system/file_handle.h"

namespace ruedo {
namespace {

constexpr const char* kMark = "RUEDO_ISOLATED";

bool write_to(const char* file, const std::string& text) {
  const FileHandle to(::open(file, O_WRONLY | O_CLOEXEC));
  return to && write_all(to.get(), text.data(), text.size()) == text.size();
}

// This user is root in the new user namespace, as by `unshare -r`.
bool enter_as_root() {
  const std::string user = std::to_string(::geteuid()), group = std::to_string(::getegid());
  return ::unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0 && write_to("/proc/self/setgroups", "deny") &&
         write_to("/proc/self/uid_map", "0 " + user + " 1") &&
         write_to("/proc/self/gid_map", "0 " + group + " 1");
}

sockaddr address(const char* text) {
  sockaddr_in made{};
  made.sin_family = AF_INET;
  ::inet_pton(AF_INET, text, &made.sin_addr);
  sockaddr general;
  std::memcpy(&general, &made, sizeof general);
  return general;
}

// `ip link set lo up` and `ip route add 224.0.0.0/4 dev lo`.
bool open_loopback() {
  const FileHandle socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  char name[] = "lo";
  ifreq link{};
  std::memcpy(link.ifr_name, name, sizeof name);
  link.ifr_flags = IFF_UP | IFF_RUNNING | IFF_LOOPBACK;
  rtentry route{};
  route.rt_dst = address("224.0.0.0");
  route.rt_genmask = address("240.0.0.0");
  route.rt_flags = RTF_UP;
  route.rt_dev = name;
  return ::ioctl(socket.get(), SIOCSIFFLAGS, &link) == 0 &&
         ::ioctl(socket.get(), SIOCADDRT, &route) == 0;
}

bool enter() { return (::unshare(CLONE_NEWNET) == 0 || enter_as_root()) && open_loopback(); }

// Tried in a child: half of it would leave this program without any network.
bool works() {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(enter() ? 0 : 1);
  int status = 1;
  return child > 0 && ::waitpid(child, &status, 0) == child && status == 0;
}

}  // namespace

bool isolate() {
  if (std::getenv(kMark)) return true;
  if (!works() || !enter()) return false;
  ::setenv(kMark, "1", 1);  // for a regression that a client runs
  return true;
}

}  // namespace ruedo
