"""A fit, or a comparison of two drives, as one HTML page that needs nothing but a browser."""

from __future__ import annotations

import html
import io
import math
from pathlib import Path as File
from typing import Any

import numpy as np

from .drives import integrate
from .errors import FitError
from .fitting import Fit
from .odometry import OdometryFit
from .statistics import Row, Spectrum, Statistics

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1d2330; max-width: 1000px; margin: 2em auto; padding: 0 1em }
h1 { font-size: 1.5em } h2 { font-size: 1.15em; margin-top: 2em; border-bottom: 1px solid #d6dae3 }
table { border-collapse: collapse } th, td { text-align: left; padding: .2em 1em .2em 0 }
pre { overflow-x: auto; font-size: 12px } figure { display: inline-block; margin: 0 1em 1em 0; max-width: 480px }
td.n { text-align: right; font-variant-numeric: tabular-nums } svg { max-width: 100%; height: auto }
"""


def write_report(answer: Fit, file: File) -> None:
    """Needs Matplotlib for the plots. Raises FitError without it, OSError for a full disk."""
    names = ", ".join(one.file.name for one in answer.recordings)
    parts = [f"<h1>Fit to {html.escape(names)}</h1>"]
    if answer.remarks:
        items = "".join(f"<li>{html.escape(one)}</li>" for one in answer.remarks)
        parts.append(f"<ul>{items}</ul>")
    for part, estimates in answer.parts.items():
        rows = "".join(_row(one) for one in estimates)
        parts.append(
            f"<h2>{html.escape(part)}</h2><table><tr><th></th><th>Value</th><th>95 % interval</th><th></th></tr>{rows}</table>"
        )
    if answer.odometry is not None:
        parts += _drive_plots(answer, answer.odometry)
    _write_page(file, names, parts)


def write_comparison(found: Statistics, file: File) -> None:
    """Needs Matplotlib. Raises FitError without it, OSError for a full disk."""
    first, second = (html.escape(File(one).name) for one in found.files)
    parts = [f"<h1>{first} (A) and {second} (B)</h1>"]
    if found.remarks:
        parts.append(
            "<ul>" + "".join(f"<li>{html.escape(one)}</li>" for one in found.remarks) + "</ul>"
        )
    parts.append(f"<pre>{html.escape(found.text())}</pre>")
    groups: dict[str, list[Row]] = {}
    for row in found.rows:
        groups.setdefault(f"{row.part}: {row.group}", []).append(row)
    plots: list[tuple[str, Any]] = [
        (title, lambda axes, rows=rows: _draw_rows(axes, rows)) for title, rows in groups.items()
    ]
    plots += [(one.name, lambda axes, one=one: _draw_spectrum(axes, one)) for one in found.spectra]
    for title, draw in plots:
        parts.append(
            f"<figure>{plot_to_svg(draw, 5, 3)}<figcaption>{html.escape(title)}</figcaption></figure>"
        )
    _write_page(file, f"{first} and {second}", parts)


def _draw_rows(axes: Any, rows: list[Row]) -> None:
    for k, row in enumerate(rows):
        for label, values, style in zip("AB", row.values, ("-", "--")):
            axes.plot(*distribution(values), style, color=f"C{k}", label=f"{row.name}, {label}")
    every = np.concatenate([values for row in rows for values in row.values])
    low, high = np.quantile(every, [0.002, 0.998])
    axes.set(xlabel=rows[0].unit, ylabel="share below", xlim=(low, high + 1e-12))
    axes.legend(fontsize=7)


def _draw_spectrum(axes: Any, one: Spectrum) -> None:
    for label, hertz, power, style in zip("AB", one.hertz, one.power, ("-", "--")):
        axes.loglog(hertz[1:], np.sqrt(power[1:]), style, label=label)
    axes.set(xlabel="frequency / Hz", ylabel=f"{one.unit} per root Hz")
    axes.legend()


def _write_page(file: File, title: str, parts: list[str]) -> None:
    file.write_text(
        f"<!DOCTYPE html><html lang='en'><head><meta charset='utf-8'><title>{html.escape(title)}</title>"
        f"<style>{_STYLE}</style></head><body>{''.join(parts)}</body></html>\n",
        encoding="utf-8",
    )


def _row(one: Any) -> str:
    name = html.escape(one.name)
    if one.value is None:
        return f"<tr><td>{name}</td><td colspan=2>not determined</td><td>{html.escape(one.why)}</td></tr>"
    interval = f"{one.low:.5g} to {one.high:.5g}" if math.isfinite(one.low) else ""
    return (
        f"<tr><td>{name}</td><td class=n>{one.value:.6g} {html.escape(one.unit)}</td>"
        f"<td class=n>{interval}</td><td>{html.escape(one.why)}</td></tr>"
    )


def plot_to_svg(draw: Any, width: float = 7.0, height: float = 5.0) -> str:
    """The SVG of the plot that draw(axes) makes; the same bytes each time."""
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ImportError:
        raise FitError("plots need Matplotlib: pip install 'ruedo[fit]'") from None
    with matplotlib.rc_context({"svg.hashsalt": "ruedo", "svg.fonttype": "none"}):
        figure = Figure(figsize=(width, height), layout="constrained")
        draw(figure.subplots())
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def _drive_plots(answer: Fit, fitted: OdometryFit) -> list[str]:
    answers = ["<h2>Dead reckoning</h2>"]
    for run, recording in zip(fitted.runs, answer.recordings):

        def draw(axes: Any, run: Any = run) -> None:
            axes.plot(*run.pose[:, :2].T, color="#1d2330", label="path of the log")
            for label, values, colour in (
                ("nominal", fitted.drive.nominal(), "#d96b5b"),
                ("fitted", fitted.parameters, "#3f7fce"),
            ):
                moved = fitted.drive.moved(values, run.turned, run.steering)
                axes.plot(*integrate(moved, run.pose[0])[:, :2].T, color=colour, lw=1, label=label)
            axes.set(xlabel="x / m", ylabel="y / m", aspect="equal")
            axes.legend()

        answers.append(
            f"<figure>{plot_to_svg(draw)}<figcaption>{html.escape(recording.file.name)}</figcaption></figure>"
        )
    return answers


def distribution(values: np.ndarray, most: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """The points of an empirical distribution function, at most so many."""
    ordered = np.sort(values)
    at = np.unique(np.linspace(0, len(ordered) - 1, min(most, len(ordered))).astype(int))
    return ordered[at], (at + 0.5) / len(ordered)
