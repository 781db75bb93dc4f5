"""Runs a program for which the kernel answers a call by EPERM: without_call.py CALL PROGRAM...

clone3: as under an older Docker; ftruncate: as on some file systems.
"""

import ctypes
import os
import struct
import sys

CALLS = {"clone3": 435, "ftruncate": 77 if os.uname().machine == "x86_64" else 46}
# if it is the call: EPERM, else: allow
FILTER = [
    (0x20, 0, 0, 0),
    (0x15, 0, 1, CALLS[sys.argv[1]]),
    (0x06, 0, 0, 0x00050001),
    (0x06, 0, 0, 0x7FFF0000),
]

libc = ctypes.CDLL(None, use_errno=True)
code = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *line) for line in FILTER))
program = ctypes.create_string_buffer(struct.pack("HxxxxxxP", len(FILTER), ctypes.addressof(code)))
PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP, SECCOMP_MODE_FILTER = 38, 22, 2
if libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) or libc.prctl(
    PR_SET_SECCOMP, SECCOMP_MODE_FILTER, program, 0, 0
):
    sys.exit("no seccomp here")
os.execvp(sys.argv[2], sys.argv[2:])
