"""render_mode "human": a server in lockstep repeats the episode, bit for bit, and its console shows
it in the browser.
"""

from __future__ import annotations

import socket
import sys
import webbrowser
from typing import Any

from numpy.typing import NDArray

from ..launching import launch
from ..simulation import Simulation


class Console:
    """At one address through all episodes: the page joins the next run by itself."""

    def __init__(self) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self._port = probe.getsockname()[1]
        self._simulation: Simulation | None = None

    def begin(
        self,
        file: str | None,
        text: str,
        seed: int,
        options: dict[str, Any],
        robots: tuple[str, ...],
    ) -> None:
        """file: the world's file, instead of the text, or None."""
        first = self._simulation is None
        self.close()
        if options["randomize"]:
            raise ValueError(
                "render_mode 'human' cannot show what randomize draws; 'rgb_array' can"
            )
        self._simulation = launch(
            file,
            text=text if file is None else None,
            seed=seed,
            lockstep=1,
            settings=options["settings"],
            disable=options["disable"],
            noise=options["noise"],
            args=["--view", str(self._port), *([] if file else ["--allow-absolute"])],
        )
        self._robots = [self._simulation.robot(name) for name in robots]
        if first:
            address = f"http://127.0.0.1:{self._port}/"
            print(f"the console is at {address}", file=sys.stderr)
            webbrowser.open(address)

    def step(self, commands: NDArray[Any], n: int) -> None:
        assert self._simulation
        self._simulation.step(
            n,
            [
                robot.velocity_command(v, omega, *side)
                for robot, (v, *side, omega) in zip(self._robots, commands.tolist())
            ],
        )

    def close(self) -> None:
        if self._simulation:
            self._simulation.close()
            self._simulation = None
