"""Lockstep over the wire: steps a second, one step per round trip, from Python.

bench_lockstep.py WORLD [STEPS] [ROUNDS]

Starts a server of its own; prints each round and the median.
"""

import statistics
import sys
import time

import ruedo


def main() -> None:
    steps = int(sys.argv[2]) if len(sys.argv) > 2 else 5000
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    with ruedo.launch(sys.argv[1], args=["--lockstep", "1", "--disable", "p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        sim.step(200)
        rates = []
        for _ in range(rounds):
            messages, begin = 0, time.perf_counter()
            for _ in range(steps):
                messages += len(sim.step(1, [robot.velocity_command(0.2, 0.3)]).messages)
            rates.append(steps / (time.perf_counter() - begin))
            print(f"{steps} steps, {messages} messages: {rates[-1]:.0f} steps/s", flush=True)
        print(f"median {statistics.median(rates):.0f} steps/s")


if __name__ == "__main__":
    main()
