"""Writes docs/physics.md: every test of rows.py in Ruedo, MuJoCo and PyBullet, in one run, at
several steps, with plots.

scripts/physics runs it.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import os
import sys
import tempfile
import time
from pathlib import Path

import costs
import rows
import simulators

HERE = Path(__file__).resolve().parent
STEPS_MS = (1, 5, 10, 20)
PLOTS = {  # row: what its y axis shows
    "tumbling": "energy, of 1",
    "double_pendulum": "change of energy, %",
    "bounce_0.5": "height, m",
    "stack_10": "furthest from its place, mm",
    "heavy_2": "furthest from its place, mm",
    "ball_aside": "aside, mm",
}


def measure(row: rows.Row, simulator, step_ms: float) -> tuple[float, rows.Series]:
    """NaN: the simulator lacks the feature, or has no finite result."""
    series: rows.Series = []
    try:
        return float(row.measure(simulator, step_ms * 1e-3, series)), series
    except NotImplementedError:
        return math.nan, []


def run(chosen: list[rows.Row], steps_ms, peers: bool) -> list[dict]:
    results = []
    makers = simulators.available(peers)
    for row in chosen:
        for step_ms in steps_ms:
            values, series = {}, {}
            for (
                simulator
            ) in makers:  # one after the other within a row: the same moment of the machine
                began = time.monotonic()
                values[simulator.name], series[simulator.name] = measure(row, simulator, step_ms)
                print(
                    f"{row.key}, {step_ms:g} ms, {simulator.name}: {values[simulator.name]:.6g} {row.unit}, {row.reference:.6g} expected "
                    f"({time.monotonic() - began:.1f} s)",
                    file=sys.stderr,
                    flush=True,
                )
            results.append({"row": row, "step_ms": step_ms, "values": values, "series": series})
    return results


def number(value: float, digits: int) -> str:
    """digits: after the point, for numbers of about 1."""
    if math.isnan(value):
        return "-"
    if abs(value) < 1e-9:  # rounding
        return "0"
    return (
        f"{value:.2g}"
        if abs(value) < 0.1 ** (digits - 1)
        else f"{value:.{digits}f}"
        if abs(value) < 100
        else f"{value:.0f}"
    )


def error(value: float, row: rows.Row) -> str:
    if math.isnan(value):
        return "-"
    off = abs(value - row.reference)
    if off < 1e-9:
        return "0"
    return f"{100 * off / abs(row.reference):.2g} %" if row.reference else f"{off:.2g}"


def table(results: list[dict]) -> str:
    names = list(results[0]["values"])
    head = (
        "| Test | Step | Should be | "
        + " | ".join(f"{n} | error" for n in names)
        + " |\n|---|---|---|"
        + "---|---|" * len(names)
        + "\n"
    )
    lines = []
    for r in results:
        row = r["row"]
        unit = f", {row.unit}" if row.unit else ""
        cells = [
            f"{row.title}{unit}",
            f"{r['step_ms']:g} ms",
            number(row.reference, max(row.digits, 4)),
        ]
        for value in r["values"].values():
            cells += [number(value, row.digits), error(value, row)]
        lines.append("| " + " | ".join(cells) + " |")
    return head + "\n".join(lines) + "\n"


def plot(folder: Path, results: list[dict], key: str, label: str) -> str | None:
    """At the step of 5 ms, else at the first one."""
    of_key = [r for r in results if r["row"].key == key]
    if not of_key or not importlib.util.find_spec("matplotlib"):
        return None
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "ruedo", "font.size": 9})
    from matplotlib import pyplot

    chosen = next((r for r in of_key if r["step_ms"] == 5), of_key[0])
    figure, axes = pyplot.subplots(figsize=(6.4, 3.0))
    for (name, series), style in zip(chosen["series"].items(), ("-", "--", ":")):
        if series:
            axes.plot(*zip(*series), style, label=name)
    axes.set(xlabel="s", ylabel=label)
    axes.set_title(
        f"{chosen['row'].title.split(':')[0]}, step of {chosen['step_ms']:g} ms", fontsize=9
    )
    if key.startswith(("stack", "heavy")):
        axes.set_yscale("symlog", linthresh=1.0)
    axes.legend()
    axes.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(folder / f"{key}.svg", metadata={"Date": None, "Creator": None})
    pyplot.close(figure)
    return f"![{chosen['row'].title}](physics/{key}.svg)"


COST = """## Cost

The least CPU time of nine runs of 1.5 s each, in one process, on one core, with a step of 5 ms. Ruedo's time includes its poses and channels. A moving mechanism takes substeps
of 1 ms, unless motors drive all its joints, as here; in substeps of 1 ms the moving arm would cost about five times as much. MuJoCo's moving arm is not stable with its
servo at 5 ms, which does not change its cost. A stack is solved until no velocity changes by more than 1e-5 m/s, which keeps the 15 boxes and the mass ratio of 100 in place: by sweeps, and
if these do not converge soon, by Newton's method on all contacts at once. `solver/iters` and `<ruedo:tolerance>` trade accuracy for time. What has come to
rest sleeps after two seconds, and costs nothing.

"""


def write(out: Path, results: list[dict], cost: str) -> None:
    folder = out / "physics"
    pieces = [(HERE / "intro.md").read_text(encoding="utf-8")]
    for group in dict.fromkeys(r["row"].group for r in results):
        of_group = [r for r in results if r["row"].group == group]
        pieces.append(f"## {group}\n\n{table(of_group)}")
        pieces += [
            p + "\n" for key, label in PLOTS.items() if (p := plot(folder, of_group, key, label))
        ]
    if cost:
        pieces.append(COST + cost)
    pieces.append((HERE / "limits.md").read_text(encoding="utf-8"))
    (out / "physics.md").write_text("\n".join(pieces), encoding="utf-8")
    kept = [
        {
            "test": r["row"].key,
            "step_ms": r["step_ms"],
            "unit": r["row"].unit,
            "reference": r["row"].reference,
            "values": {k: None if math.isnan(v) else v for k, v in r["values"].items()},
        }
        for r in results
    ]
    (folder / "numbers.json").write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--out", type=Path, default=Path("docs"), help="where physics.md and physics/ go"
    )
    parser.add_argument(
        "--only", nargs="+", metavar="TEST", help="these tests alone; --list names them"
    )
    parser.add_argument("--steps", nargs="+", type=float, default=STEPS_MS, metavar="MS")
    parser.add_argument(
        "--quick", action="store_true", help="without the tests that take more than some seconds"
    )
    parser.add_argument("--no-peers", action="store_true", help="Ruedo alone")
    parser.add_argument("--list", action="store_true")
    arguments = parser.parse_args()
    if arguments.list:
        print("\n".join(f"{row.key:16} {row.title}" for row in rows.ROWS))
        return 0
    unknown = set(arguments.only or ()) - {row.key for row in rows.ROWS}
    if unknown:
        parser.error(
            f"there is no test {', '.join(sorted(unknown))}; --list names those that there are"
        )
    chosen = [
        row
        for row in rows.ROWS
        if (not arguments.only or row.key in arguments.only) and not (arguments.quick and row.long)
    ]
    try:
        (arguments.out / "physics").mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(
            prefix="ruedo-physics-"
        ) as elsewhere:  # MuJoCo writes its log into the working directory
            arguments.out = arguments.out.resolve()
            os.chdir(elsewhere)
            results = run(chosen, arguments.steps, not arguments.no_peers)
            write(
                arguments.out,
                results,
                ""
                if arguments.only
                else costs.table(simulators.available(not arguments.no_peers)[1:]),
            )
            os.chdir(HERE)
    except OSError as problem:
        print(f"--out {arguments.out}: {problem}", file=sys.stderr)
        return 4
    return 0


if __name__ == "__main__":
    sys.exit(main())
