#include "system/sandbox.h"

#include <cerrno>
#include <cstring>
#include <memory>

#include <fcntl.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "ruedo/errors.h"
#include "system/installation.h"

namespace ruedo {
namespace {

// linux/landlock.h of Debian 12 knows the first two versions of the interface; kernels say which
// one they have.
constexpr uint64_t kExecute = 1u << 0, kWriteFile = 1u << 1, kReadFile = 1u << 2,
                   kReadDir = 1u << 3, kFirstVersion = (1u << 13) - 1;
constexpr uint64_t kRefer = 1u << 13, kTruncate = 1u << 14,
                   kIoctlDevice = 1u << 15;  // versions 2, 3, 5
constexpr uint64_t kOfFiles = kExecute | kWriteFile | kReadFile | kTruncate | kIoctlDevice;
constexpr uint64_t kTcp = 3;     // bind and connect, version 4
constexpr uint64_t kScopes = 3;  // abstract sockets and signals, version 6

struct RulesetAttributes {  // landlock_ruleset_attr of version 6
  uint64_t files, network, scopes;
};

int landlock_version() {
  const long version =
      syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  return version < 0 ? 0 : static_cast<int>(version);
}

uint64_t rights_over_files(int version) {
  return kFirstVersion | (version >= 2 ? kRefer : 0) | (version >= 3 ? kTruncate : 0) |
         (version >= 5 ? kIoctlDevice : 0);
}

[[noreturn]] void fail(const char* what) {
  throw EnvironmentError(std::string("the sandbox cannot be entered: ") + what + ": " +
                         std::strerror(errno));
}

void allow(const FileHandle& ruleset, const std::string& path, uint64_t rights) {
  const FileHandle file(::open(path.c_str(), O_PATH | O_CLOEXEC));
  struct stat status{};
  if (!file || ::fstat(file.get(), &status) != 0) return;  // not there
  landlock_path_beneath_attr beneath{};
  beneath.allowed_access = S_ISDIR(status.st_mode) ? rights : rights & kOfFiles;
  beneath.parent_fd = file.get();
  const bool added =
      syscall(SYS_landlock_add_rule, ruleset.get(), LANDLOCK_RULE_PATH_BENEATH, &beneath, 0) == 0;
  if (!added && errno != EBADFD) fail(path.c_str());  // a pipe: no file
}

// The needs of every program: libraries, the processors, time zones, devices without a content.
// Not /etc as a whole, not /proc of others.
constexpr const char* kSystem[] = {"/usr",
                                   "/lib",
                                   "/lib32",
                                   "/lib64",
                                   "/bin",
                                   "/sbin",
                                   "/opt",
                                   "/etc/ld.so.cache",
                                   "/etc/ld.so.preload",
                                   "/etc/localtime",
                                   "/etc/hosts",
                                   "/etc/resolv.conf",
                                   "/etc/nsswitch.conf",
                                   "/etc/host.conf",
                                   "/etc/gai.conf",
                                   "/etc/protocols",
                                   "/etc/services",
                                   "/etc/ssl/openssl.cnf",
                                   "/etc/alternatives",
                                   "/etc/glvnd",
                                   "/etc/drirc",
                                   "/proc/self",
                                   "/proc/cpuinfo",
                                   "/proc/meminfo",
                                   "/proc/filesystems",
                                   "/proc/mounts",
                                   "/proc/net",
                                   "/proc/sys",
                                   "/sys/devices",
                                   "/sys/fs/cgroup",
                                   "/sys/class",
                                   "/sys/dev"};
constexpr const char* kDevices[] = {"/dev/null",    "/dev/zero", "/dev/random",
                                    "/dev/urandom", "/dev/tty",  "/dev/dri"};

FileHandle ruleset_of(const Sandbox& sandbox, int version) {
  const uint64_t all = rights_over_files(version), reading = kReadFile | kReadDir | kExecute;
  RulesetAttributes attributes{all, sandbox.alone && version >= 4 ? kTcp : 0,
                               sandbox.alone && version >= 6 ? kScopes : 0};
  const size_t size = version >= 6   ? sizeof attributes
                      : version >= 4 ? 2 * sizeof(uint64_t)
                                     : sizeof(uint64_t);
  FileHandle ruleset(static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, size, 0)));
  if (!ruleset) fail("Landlock");
  if (sandbox.system) {
    for (const char* path : kSystem) allow(ruleset, path, reading);
    for (const char* path : kDevices) allow(ruleset, path, all);
    for (const char* part : {"bin", "lib", "math", "share", "python", "ruedo.libs"}) {
      if (const std::string installed = find_installed(part); !installed.empty())
        allow(ruleset, installed, reading);
    }
  }
  for (const std::string& path : sandbox.readable) allow(ruleset, path, kReadFile | kReadDir);
  for (const std::string& path : sandbox.runnable) allow(ruleset, path, reading);
  for (const std::string& path : sandbox.writable) allow(ruleset, path, all & ~kExecute);
  return ruleset;
}

// System calls that no program here has a reason for.
constexpr const char* kNever[] = {"ptrace",
                                  "process_vm_readv",
                                  "process_vm_writev",
                                  "mount",
                                  "umount2",
                                  "pivot_root",
                                  "chroot",
                                  "setns",
                                  "unshare",
                                  "bpf",
                                  "perf_event_open",
                                  "keyctl",
                                  "add_key",
                                  "request_key",
                                  "init_module",
                                  "finit_module",
                                  "delete_module",
                                  "kexec_load",
                                  "kexec_file_load",
                                  "reboot",
                                  "swapon",
                                  "swapoff",
                                  "open_by_handle_at",
                                  "name_to_handle_at",
                                  "userfaultfd",
                                  "io_uring_setup",
                                  "io_uring_enter",
                                  "io_uring_register",
                                  "acct",
                                  "quotactl",
                                  "settimeofday",
                                  "clock_settime",
                                  "adjtimex",
                                  "iopl",
                                  "ioperm",
                                  "syslog",
                                  "sethostname",
                                  "setdomainname",
                                  "mknod",
                                  "mknodat",
                                  "move_mount",
                                  "open_tree",
                                  "fsopen",
                                  "fsconfig",
                                  "fsmount",
                                  "fspick"};
constexpr const char* kNeverWithoutSystem[] = {"execve", "execveat"};
constexpr const char* kNeverAlone[] = {
    "fork", "vfork", "socket", "socketpair", "connect", "bind", "listen", "accept", "accept4",
    "sendto", "sendmsg", "sendmmsg",
    // signals, and what else changes other processes
    "kill", "tkill", "tgkill", "rt_sigqueueinfo", "rt_tgsigqueueinfo", "pidfd_open",
    "pidfd_send_signal", "pidfd_getfd", "process_madvise", "process_mrelease", "kcmp",
    "setpriority", "ioprio_set", "sched_setaffinity", "sched_setattr", "sched_setparam",
    "sched_setscheduler", "migrate_pages", "move_pages",
    // what processes share
    "shmget", "shmat", "shmctl", "msgget", "msgsnd", "msgrcv", "msgctl", "semget", "semop",
    "semtimedop", "semctl", "mq_open", "mq_unlink",
    // what Landlock does not look at
    "chmod", "fchmod", "fchmodat", "chown", "fchown", "lchown", "fchownat", "utime", "utimes",
    "futimesat", "utimensat", "setxattr", "lsetxattr", "fsetxattr", "removexattr", "lremovexattr",
    "fremovexattr", "flock"};
// fchmodat2, setxattrat, removexattrat and file_setattr, by their numbers: libseccomp of Debian 12
// does not know them. They are the same on all processors.
constexpr int kNeverAloneNewer[] = {452, 463, 466, 469};

std::vector<sock_filter> filter_of(const Sandbox& sandbox) {
  const std::unique_ptr<void, void (*)(scmp_filter_ctx)> filter(seccomp_init(SCMP_ACT_ALLOW),
                                                                seccomp_release);
  if (!filter) fail("seccomp");
  const auto refuse = [&](int number, std::vector<scmp_arg_cmp> where = {}, int error = EPERM) {
    if (number != __NR_SCMP_ERROR)
      seccomp_rule_add_array(filter.get(), SCMP_ACT_ERRNO(static_cast<unsigned>(error)), number,
                             static_cast<unsigned>(where.size()), where.data());
  };
  const auto refuse_all = [&](const auto& names) {
    for (const char* name : names) refuse(seccomp_syscall_resolve_name(name));
  };
  refuse_all(kNever);
  // They type into the terminal, for its shell to execute.
  for (const uint64_t type : {uint64_t{TIOCSTI}, uint64_t{TIOCLINUX}})
    refuse(SCMP_SYS(ioctl), {SCMP_A1_64(SCMP_CMP_MASKED_EQ, 0xffffffffu, type)});
  if (!sandbox.system) refuse_all(kNeverWithoutSystem);
  if (sandbox.alone) {
    refuse_all(kNeverAlone);
    for (const int number : kNeverAloneNewer) refuse(number);
    refuse(SCMP_SYS(clone), {SCMP_A0_64(SCMP_CMP_MASKED_EQ, CLONE_THREAD, 0)});
    refuse(SCMP_SYS(clone3), {}, ENOSYS);  // its flags cannot be seen; clone() is used instead
    refuse(SCMP_SYS(prlimit64), {SCMP_A0_64(SCMP_CMP_NE, 0)});
  }
  const FileHandle file(::memfd_create("filter", MFD_CLOEXEC));
  if (const int error = seccomp_export_bpf(filter.get(), file.get()); error != 0) {
    errno = -error;
    fail("seccomp");
  }
  const off_t size = ::lseek(file.get(), 0, SEEK_END);
  std::vector<sock_filter> program(static_cast<size_t>(size) / sizeof(sock_filter));
  if (::pread(file.get(), program.data(), static_cast<size_t>(size), 0) != size) fail("seccomp");
  return program;
}

bool has_seccomp() { return seccomp_api_get() >= 2 && prctl(PR_GET_SECCOMP, 0, 0, 0, 0) >= 0; }

}  // namespace

std::string missing_for_sandbox() {
  if (landlock_version() == 0)
    return "the kernel has no Landlock (Linux 5.13 and later have it, unless it is left out of "
           "lsm= at boot)";
  if (!has_seccomp()) return "the kernel has no seccomp filters";
  return "";
}

ReadySandbox::ReadySandbox(const Sandbox& sandbox) {
  if (const int version = landlock_version(); version > 0) ruleset_ = ruleset_of(sandbox, version);
  if (has_seccomp()) filter_ = filter_of(sandbox);
}

bool ReadySandbox::enter() const {
  const sock_fprog program{static_cast<unsigned short>(filter_.size()),
                           const_cast<sock_filter*>(filter_.data())};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         (!ruleset_ || syscall(SYS_landlock_restrict_self, ruleset_.get(), 0) == 0) &&
         (filter_.empty() || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0);
}

void enter(const Sandbox& sandbox) {
  if (!ReadySandbox(sandbox).enter()) fail("Landlock or seccomp");
}

}  // namespace ruedo
