"""A process of a program that nobody has read: it computes, and uses the pipes that it was given.

Landlock keeps it from files, seccomp from everything else that reaches beyond it.
"""

from __future__ import annotations

import ctypes
import os
import resource
import struct
import sys

MEMORY = 2 << 30  # bytes of address space
PRINTED = 64 << 20  # bytes, to a file that was open before
CPU = 600  # s

FORBIDDEN = """
execve execveat fork vfork setsid setpgid prlimit64 setrlimit ptrace process_vm_readv
process_vm_writev process_madvise process_mrelease kcmp pidfd_open pidfd_getfd pidfd_send_signal
kill tkill tgkill rt_sigqueueinfo rt_tgsigqueueinfo setpriority ioprio_set sched_setaffinity
sched_setattr sched_setparam sched_setscheduler migrate_pages move_pages socket socketpair connect
bind listen accept accept4 sendto sendmsg sendmmsg io_uring_setup io_uring_enter io_uring_register
memfd_create memfd_secret userfaultfd shmget shmat shmctl msgget msgsnd msgrcv msgctl semget semop
semtimedop semctl mq_open mq_unlink chmod fchmod fchmodat chown fchown lchown fchownat utime utimes
futimesat utimensat setxattr lsetxattr fsetxattr removexattr lremovexattr fremovexattr flock mknod
mknodat fallocate mount umount2 pivot_root chroot setns unshare move_mount open_tree fsopen
fsconfig fsmount fspick open_by_handle_at name_to_handle_at fanotify_init swapon swapoff reboot
acct quotactl syslog bpf perf_event_open keyctl add_key request_key init_module finit_module
delete_module kexec_load kexec_file_load settimeofday clock_settime clock_adjtime adjtimex iopl
ioperm sethostname setdomainname
"""
NEWER = [452, 463, 466, 469]  # fchmodat2, setxattrat, removexattrat, file_setattr

_libc = ctypes.CDLL(None, use_errno=True)
_NO_NEW_PRIVILEGES, _CLONE_THREAD = 38, 0x10000
_READ_FILE, _READ_DIR, _ALL = 4, 8, (1 << 13) - 1
_NEWER_RIGHTS = {2: 1 << 13, 3: 1 << 14, 5: 1 << 15}  # by the version of Landlock
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446  # on all processors
_ALLOW, _REFUSE = 0x7FFF0000, 0x00050000  # of libseccomp
_EPERM, _ENOSYS = 1, 38
_MASKED_EQUAL = 7


class _Argument(ctypes.Structure):  # scmp_arg_cmp
    _fields_ = [
        ("index", ctypes.c_uint),
        ("how", ctypes.c_int),
        ("mask", ctypes.c_uint64),
        ("value", ctypes.c_uint64),
    ]


def enter(readable: list[str]) -> None:
    """For good: of files it reads these, and Python's and the system's libraries; it writes none,
    has no network, starts no process and sends no signal. Raises OSError where the kernel lacks
    what that takes.
    """
    for limit, value in (
        (resource.RLIMIT_AS, MEMORY),
        (resource.RLIMIT_FSIZE, PRINTED),
        (resource.RLIMIT_CPU, CPU),
        (resource.RLIMIT_CORE, 0),
    ):
        resource.setrlimit(limit, (value, value))
    _check(_libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0), "prctl")
    _forbid_files({*readable, *sys.path, sys.prefix, sys.base_prefix, "/usr", "/lib", "/lib64"})
    _forbid_calls()


def _forbid_files(readable: set[str]) -> None:
    version = _check(_libc.syscall(_CREATE_RULESET, None, 0, 1), "Landlock (Linux 5.13)")
    rights = _ALL | sum(right for since, right in _NEWER_RIGHTS.items() if version >= since)
    ruleset = _check(_libc.syscall(_CREATE_RULESET, struct.pack("Q", rights), 8, 0), "Landlock")
    for path in sorted(readable):
        if os.path.exists(path):
            allowed = _READ_FILE | (_READ_DIR if os.path.isdir(path) else 0)
            file = os.open(path, os.O_PATH | os.O_CLOEXEC)
            rule = struct.pack("=Qi", allowed, file)
            _check(_libc.syscall(_ADD_RULE, ruleset, 1, rule, 0), path)
            os.close(file)
    _check(_libc.syscall(_RESTRICT_SELF, ruleset, 0), "Landlock")
    os.close(ruleset)


def _forbid_calls() -> None:
    seccomp = ctypes.CDLL("libseccomp.so.2")
    seccomp.seccomp_init.restype = ctypes.c_void_p
    calls = ctypes.c_void_p(seccomp.seccomp_init(_ALLOW))
    numbers = [seccomp.seccomp_syscall_resolve_name(name.encode()) for name in FORBIDDEN.split()]

    def refuse(number: int, error: int = _EPERM, *where: _Argument) -> None:
        array = (_Argument * len(where))(*where)
        added = seccomp.seccomp_rule_add_array(calls, _REFUSE | error, number, len(where), array)
        _check(added, "seccomp")

    for number in numbers + NEWER:
        if number != -1:  # libseccomp does not know it
            refuse(number)
    thread = seccomp.seccomp_syscall_resolve_name(b"clone")
    refuse(thread, _EPERM, _Argument(0, _MASKED_EQUAL, _CLONE_THREAD, 0))
    # Its flags cannot be seen; clone() is used instead.
    refuse(seccomp.seccomp_syscall_resolve_name(b"clone3"), _ENOSYS)
    _check(seccomp.seccomp_load(calls), "seccomp")


def _check(result: int, what: str) -> int:
    if result < 0:
        raise OSError(ctypes.get_errno(), f"no sandbox: {what}: {os.strerror(ctypes.get_errno())}")
    return result
