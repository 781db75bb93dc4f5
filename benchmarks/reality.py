"""Writes docs/reality.md: how real Ruedo's models are, on logs of real robots that it was not
fitted to.

Run as PYTHONPATH=build/release/python .venv/bin/python benchmarks/reality.py DATA [TRUTH]: DATA has
CARMEN logs (*.log.gz) and OptiOdom's folders (optiodom/*), TRUTH is a file with what
fit_known_truth.py printed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from ruedo.fit import read
from ruedo.fit.drives import integrate
from ruedo.fit.mapping import key_scans, scan_poses
from ruedo.fit.odometry import end_error, fit_odometry, reckoned_from, run_of
from ruedo.fit.rangefinder import (
    OUTLIER_M,
    WINDOW_M,
    BeamModel,
    fit_beams,
    residuals_of,
    surfaces_of,
    valid,
)
from ruedo.fit.report import distribution, plot_to_svg
from ruedo.fit.statistics import INCIDENCES, RANGES
from scipy.stats import ks_2samp

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs/images"
MAKERS_M = 0.005  # statistical error of the SICK LMS 200, one sigma, in its manual
SIDE_M = 1.7  # of OptiOdom's squares with the differential robot
DRAWS = 400
NO_TABLE = (
    "`benchmarks/fit_known_truth.py 30` prints a table of thirty drawn sets; it has not been run for this page. "
    "The tests hold three sets, of three robots (`tests/fit/test_odometry.py`): all errors lie within 3.3 standard deviations of the truth."
)


def main(data, truth):
    table = truth.read_text().strip() if truth else NO_TABLE
    wheels, picture = wheel_rows(data / "optiodom")
    (IMAGES / "reality-wheels.svg").write_text(picture)
    lasers, picture = laser_rows(data)
    (IMAGES / "reality-lasers.svg").write_text(picture)
    page = (ROOT / "benchmarks/reality_page.md").read_text()
    parts = {"TRUTH": table, "WHEELS": wheels, "LASERS": lasers}
    for name, text in parts.items():
        page = page.replace(f"@{name}@", text)
    (ROOT / "docs/reality.md").write_text(page)


# ---- Wheels.


def wheel_rows(folder):
    every = {
        one.name: [read(f) for f in sorted(one.glob("*run*"))] for one in sorted(folder.iterdir())
    }
    rows, points = [], []
    for name, recordings in every.items():
        for k, held in enumerate(recordings):
            others = recordings[:k] + recordings[k + 1 :]
            mark = ""
            if not others:  # another path of the same robot
                others, mark = every[name.replace("free", "square")], " (fitted on squares)"
            points.append(judge_run(held, others, rng=np.random.default_rng(len(points))))
            one = points[-1]
            umbmark = f"{one['umbmark']:.3f}" if one["umbmark"] is not None else ""
            rows.append(
                f"| {name}, run {k + 1}{mark} | {one['length']:.1f} | {one['nominal']:.3f} | {one['plain']:.3f} "
                f"| {umbmark} | {one['fitted']:.3f} | {one['median']:.3f} | {one['band']:.3f} |"
            )
    inside = sum(one["fitted"] <= one["band"] for one in points)
    real = [one["fitted"] for one in points]
    simulated = [one["median"] for one in points]
    boot = np.random.default_rng(0).choice(real, (2000, len(real)))
    low, high = np.quantile(np.median(boot, axis=1), [0.025, 0.975])
    medians = {kind: np.median([one[kind] for one in points]) for kind in ("nominal", "plain")}
    head = (
        "| Run | Way, m | Nominal robot, m | Least squares, m | UMBmark, m | `ruedo fit`, m "
        "| Simulated median, m | Simulated 90 %, m |\n|---|---|---|---|---|---|---|---|\n"
    )
    summary = (
        f"\n\nThe median end-point error of the {len(points)} held-out runs is {medians['nominal']:.3f} m with the nominal "
        f"measures, {medians['plain']:.3f} m with plain least squares and {np.median(real):.3f} m with `ruedo fit` "
        f"(95 % interval {low:.3f} to {high:.3f} m, bootstrap); the simulated robots' is {np.median(simulated):.3f} m. "
        f"{inside} of {len(points)} runs ({inside / len(points):.0%}) end within the simulated 90 % band."
    )
    return head + "\n".join(rows) + summary, plot_to_svg(
        lambda axes: draw_wheels(axes, points), 7, 5
    )


def judge_run(held, others, rng):
    """End-point errors (m) of a run that no fit has seen, and the simulated robot's."""
    geometry = held.geometry
    fit = fit_odometry(others, geometry)
    plain = fit_odometry(others, geometry, plain=True)
    run = run_of(held, fit.drive)
    drive, nominal = fit.drive, fit.drive.nominal()
    draws = simulated_ends(fit, run, rng)
    calibrated = umbmark(others, drive, fit.place)
    return {
        "length": float(run.clock.sum()),
        "nominal": end_error(drive, nominal, fit.place, run),
        "plain": end_error(drive, plain.parameters, plain.place, run),
        "umbmark": None if calibrated is None else end_error(drive, calibrated, fit.place, run),
        "fitted": end_error(drive, fit.parameters, fit.place, run),
        "median": float(np.median(draws)),
        "band": float(np.quantile(draws, 0.9)),
    }


def simulated_ends(fit, run, rng):
    """How far apart (m) two drives of the same commands end: slip as <ruedo:slip_noise> draws it,
    and measures as uncertain as the fit leaves them.
    """
    size = len(fit.parameters)
    scale = fit.drive.geometry.radius_m
    root = np.linalg.cholesky(fit.covariance + 1e-15 * np.eye(len(fit.covariance)))
    true = integrate(fit.drive.moved(fit.parameters, run.turned, run.steering))[-1]
    ends = []
    for _ in range(DRAWS):
        drawn = fit.parameters + (root @ rng.normal(size=len(root)))[:size]
        slip = fit.slip * np.sqrt(np.abs(run.turned) * scale) * rng.normal(size=run.turned.shape)
        end = integrate(fit.drive.moved(drawn, run.turned + slip / scale, run.steering))[-1]
        ends.append(np.hypot(*(end - true)[:2]))
    return np.array(ends)


def umbmark(recordings, drive, place):
    """Radii and track after Borenstein and Feng, from squares in both directions; else None."""
    if drive.geometry.kind != "differential":
        return None
    x = {1: [], -1: []}
    for one in recordings:
        run = run_of(one, drive)
        turned = run.pose[-1, 2] - run.pose[0, 2]
        if abs(abs(turned) - 2 * np.pi) > 0.5:
            return None
        start = reckoned_from(run, place)
        believed = integrate(drive.moved(drive.nominal(), run.turned, run.steering), start)[-1]
        step = run.pose[-1, :2] - believed[:2]
        ahead = np.array([np.cos(run.pose[0, 2]), np.sin(run.pose[0, 2])])
        x[int(np.sign(turned))].append(float(step @ ahead))
    if not x[1] or not x[-1]:
        return None
    clockwise, counter = np.mean(x[-1]), np.mean(x[1])
    alpha = (clockwise + counter) / (-4 * SIDE_M)
    beta = (clockwise - counter) / (-4 * SIDE_M)
    radius, _, track = drive.nominal()
    unequal = 1.0
    if abs(beta) > 1e-9:
        curve = SIDE_M / 2 / np.sin(beta / 2)
        unequal = (curve + track / 2) / (curve - track / 2)
    wider = (np.pi / 2) / (np.pi / 2 - alpha)
    return np.array(
        [2 * radius / (unequal + 1), 2 * radius * unequal / (unequal + 1), track * wider]
    )


def draw_wheels(axes, points):
    at = np.arange(len(points))
    axes.vlines(
        at, 0, [one["band"] for one in points], color="#c9dcf3", lw=6, label="simulated 90 %"
    )
    for kind, mark, colour in (
        ("nominal", "x", "#d96b5b"), ("plain", "+", "#8a6d3b"), ("fitted", "o", "#173f73"),
    ):  # fmt: skip
        axes.plot(
            at, [one[kind] for one in points], mark, color=colour, label=kind, fillstyle="none"
        )
    axes.set(xlabel="held-out run", ylabel="end-point error / m", yscale="log", ylim=(1e-3, 3))
    axes.legend(ncols=4)


# ---- Lasers.


def laser_rows(folder):
    rows, judged, totals, shares, seen = [], {}, [], [], []
    for file in sorted(folder.glob("*.log.gz")):
        recording = read(file)
        mount = np.zeros(3)
        keys = key_scans(scan_poses(recording, mount))
        first, second = keys[: len(keys) // 2], keys[len(keys) // 2 :]
        surfaces = surfaces_of(recording, mount, first)
        model, _ = fit_beams(residuals_of(recording, mount, first, surfaces))
        found = residuals_of(recording, mount, second, surfaces, seed=1)
        unchanged = np.abs(found.residual) < OUTLIER_M
        real, reach = found.residual[unchanged], found.reach[unchanged]
        incidence = found.incidence[unchanged]
        simulated = simulate(model, reach, incidence)
        naive = MAKERS_M * np.random.default_rng(3).normal(size=len(real))
        share = found.share * unchanged.mean()
        totals.append(ks_2samp(real, simulated).statistic)
        shares.append(share)
        seen.append(share_seen(recording, second, surfaces))
        name = file.name.removesuffix(".log.gz")
        judged[name] = (real, simulated)
        classes = [distance(real, simulated, (reach >= a) & (reach < b)) for a, b in RANGES]
        degrees = np.degrees(incidence)
        classes += [
            distance(real, simulated, (degrees >= a) & (degrees < b)) for a, b in INCIDENCES
        ]
        rows.append(
            f"| {name} | {seen[-1]:.0%} | {share:.0%} | {model.range_sigma * 1000:.1f} | {model.bearing_sigma * 1000:.2f} "
            f"| **{totals[-1]:.3f}** | {ks_2samp(real, naive).statistic:.3f} | "
            + " | ".join(classes) + " |"
        )  # fmt: skip
    head = (
        "| Building | Seen before | Judged | Range noise, mm | Bearing noise, mrad | KS, Ruedo | KS, maker's Gaussian | "
        + " | ".join(f"{a} to {b} m" for a, b in RANGES) + " | "
        + " | ".join(f"{a} to {b} deg" for a, b in INCIDENCES)
        + " |\n" + "|---" * (7 + len(RANGES) + len(INCIDENCES)) + "|\n"
    )  # fmt: skip
    summary = (
        f"\n\nThe distance is below 0.1 in {sum(one < 0.1 for one in totals)} of {len(totals)} buildings. "
        f"Between {min(shares):.0%} and {max(shares):.0%} of the readings are judged; "
        f"between {min(seen):.0%} and {max(seen):.0%} could be by any rule that asks for "
        f"one reading within 0.15 m, more than 70 % in {sum(one > 0.7 for one in seen)} buildings."
    )
    return head + "\n".join(rows) + summary, plot_to_svg(
        lambda axes: draw_lasers(axes, judged), 7, 5
    )


def share_seen(recording, scans, surfaces):
    """Share of these scans' readings that end within WINDOW_M of any reading of the surfaces."""
    poses = scan_poses(recording, np.zeros(3))[scans]
    row, ray = np.nonzero(valid(recording)[scans])
    chosen = np.random.default_rng(1).choice(len(row), min(len(row), 5000), replace=False)
    row, ray = row[chosen], ray[chosen]
    angle = poses[row, 2] + recording.scans.angles[ray]
    way = recording.scans.ranges[scans[row], ray][:, None] * np.stack(
        [np.cos(angle), np.sin(angle)], axis=1
    )
    apart, _ = surfaces.tree.query(poses[row, :2] + way)
    return float(np.mean(apart < WINDOW_M))


def simulate(model: BeamModel, reach, incidence):
    """Residuals as Ruedo's sensor makes them: noise of range and bearing, no other errors."""
    rng = np.random.default_rng(2)
    bearing = model.bearing_sigma * reach * np.tan(incidence) * rng.normal(size=len(reach))
    return model.range_sigma * rng.normal(size=len(reach)) + bearing


def distance(real, simulated, chosen):
    return (
        f"{ks_2samp(real[chosen], simulated[chosen]).statistic:.3f}" if chosen.sum() > 200 else ""
    )


def draw_lasers(axes, judged):
    for k, (name, (real, simulated)) in enumerate(judged.items()):
        colour = f"C{k}"
        axes.plot(*distribution(real * 1000), color=colour, label=name)
        axes.plot(*distribution(simulated * 1000), color=colour, ls=":")
    axes.set(xlabel="residual / mm (dotted: simulated)", ylabel="share below", xlim=(-100, 100))
    axes.legend(fontsize=8)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
