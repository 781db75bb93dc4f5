"""Runs a command in a network namespace of its own, in which multicast goes over the loopback
device alone.

    isolated.py COMMAND...

As root, or as an ordinary user where user namespaces are allowed. Where they are not, the command
runs in the ordinary network: tests take a free port each and ttl 0, which keeps the data on this
machine.
"""

import os
import subprocess
import sys

PREPARE = "ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec \"$@\""


def main() -> None:
    command = sys.argv[1:]
    for flags in ("-n", "-rn"):
        if (
            subprocess.run(
                ["unshare", flags, "sh", "-c", PREPARE, "sh", "true"], capture_output=True
            ).returncode
            == 0
        ):
            os.execvp("unshare", ["unshare", flags, "sh", "-c", PREPARE, "sh", *command])
    print(
        "isolated.py: no network namespace here; running in the ordinary network", file=sys.stderr
    )
    os.execvp(command[0], command)


if __name__ == "__main__":
    main()
