"""Draws the learning curve that train.py wrote: python plot.py CURVE.csv PICTURE.svg"""

import csv
import sys

from matplotlib import pyplot


def main() -> None:
    with open(sys.argv[1], newline="") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    steps = [row["steps"] / 1000 for row in rows]
    pyplot.rcParams["svg.hashsalt"] = "ruedo"  # the same picture each time
    _, axes = pyplot.subplots(figsize=(6.5, 3.2), layout="constrained")
    axes.plot(steps, [row["success"] for row in rows], label="reached the goal")
    axes.plot(steps, [row["collision"] for row in rows], label="touched something")
    axes.set(xlabel="thousand environment steps", ylabel="part of the episodes", ylim=(0, 1))
    wall = axes.twiny()
    wall.set_xlim(axes.get_xlim())
    ticks = [rows[len(rows) * i // 5] for i in range(1, 5)] + [rows[-1]]
    wall.set_xticks([row["steps"] / 1000 for row in ticks])
    wall.set_xticklabels([f"{row['seconds'] / 60:.0f}" for row in ticks])
    wall.set_xlabel("minutes")
    axes.legend(loc="center right")
    axes.grid(alpha=0.3)
    pyplot.savefig(sys.argv[2], metadata={"Date": None})


if __name__ == "__main__":
    main()
