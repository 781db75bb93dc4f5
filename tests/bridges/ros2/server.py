"""`ruedo run WORLD --ros2` in a domain of its own, and how long tests wait for it."""

from __future__ import annotations

import itertools
import os
import subprocess
import time
from pathlib import Path

import pytest

PATIENCE = float(os.environ.get("RUEDO_PATIENCE", "300"))  # s, for what comes sooner or later
SOURCE = Path(os.environ.get("RUEDO_SOURCE_DIR", Path(__file__).resolve().parents[3]))
RUEDO = os.environ.get("RUEDO", str(SOURCE / "build/release/bin/ruedo"))
ARENA = str(SOURCE / "worlds/arena.sdf")

# Fast DDS of two network namespaces meets in shared memory: tests that run at once need domains of
# their own.
_domains = itertools.count(int(os.environ.get("RUEDO_FIRST_DOMAIN", "1")))


def new_domain() -> int:
    return next(_domains)


_OF_ROS = ("AMENT_PREFIX_PATH", "LD_LIBRARY_PATH")  # Ruedo needs no ROS


class Run:
    """`ruedo run WORLD --ros2` in a domain of its own; ends with the with-block."""

    def __init__(
        self,
        *arguments: str,
        world: str | Path = ARENA,
        environment: dict[str, str] | None = None,
        lcm: str = "auto",
        domain: int | None = None,
    ):
        self.domain = new_domain() if domain is None else domain
        environment = {**os.environ, "ROS_DOMAIN_ID": str(self.domain), **(environment or {})}
        self.process = subprocess.Popen(
            [RUEDO, "run", world, "--ros2", "--lcm", lcm, *arguments],
            env={name: value for name, value in environment.items() if name not in _OF_ROS},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def __enter__(self) -> Run:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> str:
        """Its output."""
        if self.process.poll() is None:
            self.process.terminate()
        try:
            return self.process.communicate(timeout=PATIENCE)[0]
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.communicate()[0]
        except ValueError:  # read already
            return ""


def wait_for(condition, what: str = "the condition"):
    """What `condition` returns, once that is true."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        if result := condition():
            return result
        time.sleep(0.01)
    pytest.fail(f"{what} did not come")
