"""`ros2` beside a run, and what the workspace has."""

from __future__ import annotations

import os
import re
import signal
import subprocess

import pytest
from ament_index_python.packages import get_packages_with_prefixes
from server import PATIENCE, RUEDO, wait_for

PACKAGES = set(get_packages_with_prefixes())
MIDDLEWARES = [m for m in ("rmw_fastrtps_cpp", "rmw_cyclonedds_cpp") if m in PACKAGES]


def needs(*packages):
    missing = sorted(set(packages) - PACKAGES)
    return pytest.mark.skipif(bool(missing), reason=f"the workspace lacks {' '.join(missing)}")


class Ros:
    """`ros2`, beside a run."""

    def __init__(self, run, middleware):
        self.run = run
        self.environment = {
            **os.environ,
            "RMW_IMPLEMENTATION": middleware,
            "ROS_DOMAIN_ID": str(run.domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "PYTHONUNBUFFERED": "1",
            "RUEDO": RUEDO,
        }

    def _done(self, words):
        return subprocess.run(
            ["ros2", *map(str, words)],
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )

    def __call__(self, *words):
        """What it prints."""
        done = self._done(words)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def finds(self, text, *words):
        """Waits until its output has that text: it looks for nodes for some seconds only."""
        words = [*words, "--no-daemon", "--spin-time", "3"]
        wait_for(lambda: text in self._done(words).stdout, text)

    def until(self, pattern, *words):
        """The first match in the output of a command that goes on, which is then ended."""
        with subprocess.Popen(
            ["ros2", *words],
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as process:
            lines = []
            for line in process.stdout:
                lines.append(line)
                if found := re.search(pattern, line):
                    process.send_signal(signal.SIGINT)
                    process.stdout.read()
                    return found
        pytest.fail("".join(lines))
