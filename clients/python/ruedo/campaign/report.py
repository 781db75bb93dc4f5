"""A campaign as one HTML page that needs nothing but a browser: tables, plots as SVG, paths of the
worst runs.
"""

from __future__ import annotations

import html
import io
import math
import os
import re
import shlex
import subprocess
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from ..errors import NotSupported
from ..launching import find_ruedo
from ..maps import OCCUPIED, load_map
from .compare import compare_with
from .errors import missing
from .outputs import write_text
from .pages import make_pages
from .plan import Case, is_expected
from .stats import wilson
from .store import Results

_BINS = 8  # of a parameter with more values than that
_WORST = 12  # runs that are drawn
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_FARTHEST_M = 1e9  # from the origin, of what is drawn
_MOST_ROWS = 1000  # of the table of all cases
_MAP_MARGIN_M = 5.0  # of a world's walls around what was driven
_COLOURS = {
    "passed": "#8fb7e8",
    "failed": "#d96b5b",
    "not judged": "#9a9fab",
    "crashed": "#7d3c98",
    "timeout": "#c98a1b",
    "memory": "#8a6d3b",
    "invalid": "#4a5266",
}
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1d2330; background: #fff; max-width: 1080px; margin: 2em auto; padding: 0 1em }
h1 { font-size: 1.5em } h2 { font-size: 1.15em; margin-top: 2.2em; border-bottom: 1px solid #d6dae3; padding-bottom: .2em }
table { border-collapse: collapse; margin: .8em 0 } th, td { text-align: left; padding: .25em .8em .25em 0; vertical-align: top }
th { font-weight: 600; border-bottom: 1px solid #9aa3b5 } td.n { text-align: right; font-variant-numeric: tabular-nums }
.bar { background: #e6e9f0; width: 160px; height: .8em; position: relative; display: inline-block }
.bar b { position: absolute; top: 0; bottom: 0; background: #8fb7e8 } .bar i { position: absolute; top: -2px; bottom: -2px; width: 2px; background: #173f73 }
.plots { display: flex; flex-wrap: wrap; gap: 12px } .plots figure { margin: 0 } figcaption { font-size: .85em; color: #4a5266; max-width: 330px }
code { background: #f2f4f8; padding: .1em .3em; user-select: all } svg { max-width: 100%; height: auto }
"""


def write_report(campaign: Any, file: Path, baseline: str | None = None, pages: int = 0) -> None:
    """The page of the results so far. baseline: as of compare_with(). pages: of so many failed
    runs, the worst, a page of the console is put into the folder beside `file` that is called as it
    is, with .pages at its end.
    """
    results: Results = campaign.results()
    worst = _worst_of(results)
    shown = make_pages(campaign, worst[:pages], file.absolute().with_suffix(".pages"))
    parts = [
        _head(campaign, results),
        *_by_parameter(results),
        *_by_world_and_controller(results),
        *_reasons(results),
        *_distributions(results),
        *_heat_map(results),
        *_worst(campaign, results, worst, shown),
    ]
    if baseline:
        parts += _comparison(campaign, baseline)
    parts += _all_cases(results)
    title = html.escape(campaign.name)
    page = (
        f"<!DOCTYPE html><html lang='en'><head><meta charset='utf-8'><title>{title}</title><style>{_STYLE}</style></head><body>"
        f"{''.join(parts)}</body></html>\n"
    )
    write_text(file, page)


def _head(campaign: Any, results: Results) -> str:
    done, failed = len(results.done), len(results.failed)
    low, high = wilson(done - failed, done)
    rate = (
        f"{(done - failed) / done:.1%} passed (95 % interval {low:.1%} to {high:.1%})"
        if done
        else "nothing was run yet"
    )
    counts = Counter(row["status"] for _, row in results.done)
    kinds = ", ".join(
        f"<span style='color:{colour}'>&#9632;</span> {counts[status]} {status}"
        for status, colour in _COLOURS.items()
        if counts[status]
    )
    asked = any(is_expected(case.what) for case in results.cases)
    return (
        f"<h1>{html.escape(campaign.name)}</h1><p>{done} of {len(results.cases)} cases, {failed} failed: {rate}. "
        f"{f'{kinds}. ' if kinds else ''}Ruedo {html.escape(campaign.version)}.</p>"
        + ("" if asked else "<p>Nothing was expected but that controllers run to their end.</p>")
    )


# ---- Success by parameter.


def _by_parameter(results: Results) -> Iterable[str]:
    yield "<h2>Success</h2><p>With Wilson's 95 % interval.</p>"
    keys: dict[str, Callable[[Case], Any]] = {
        "world": lambda case: case.world,
        "robot": lambda case: case.robot,
        "controller": lambda case: case.controller,
    }
    names = list(dict.fromkeys(name for case in results.cases for name in case.parameters))
    for name in names:
        keys[name] = _binned(name, [case.parameters.get(name) for case in results.cases])
    for name, key in keys.items():
        groups: dict[Any, list[bool]] = {}
        for case, row in results.done:
            groups.setdefault(key(case), []).append(row["status"] == "passed")
        if len(groups) > 1:
            yield _success_table(name, sorted(groups.items(), key=lambda one: _order(one[0])))


def _binned(name: str, values: list[Any]) -> Any:
    numbers = [one for one in values if isinstance(one, (int, float)) and not isinstance(one, bool)]
    if len(set(numbers)) <= _BINS or len(numbers) < len(values) or not _differ(numbers):
        return lambda case: case.parameters.get(name)
    low, high = min(numbers), max(numbers)
    width = (high - low) / _BINS

    def key(case: Case) -> Any:
        i = min(int((case.parameters[name] - low) / width), _BINS - 1)
        return _Bin(low + i * width, low + (i + 1) * width)

    return key


class _Bin(tuple):  # type: ignore[type-arg]
    """An interval of a parameter's values: from, to."""

    def __new__(cls, low: float, high: float) -> _Bin:
        return super().__new__(cls, (low, high))

    def __str__(self) -> str:
        return f"{self[0]:.4g} to {self[1]:.4g}"


def _order(value: Any) -> tuple[int, Any]:
    if isinstance(value, (int, float)):
        return 0, (value,)
    return (0, tuple(value)) if isinstance(value, _Bin) else (1, (str(value),))


def _success_table(name: str, groups: list[tuple[Any, list[bool]]]) -> str:
    rows = []
    for value, good in groups:
        low, high = wilson(sum(good), len(good))
        share = sum(good) / len(good)
        bar = f"<span class='bar'><b style='left:{low:.1%};right:{1 - high:.1%}'></b><i style='left:{share:.1%}'></i></span>"
        rows.append(
            f"<tr><td>{html.escape(str(value))}</td><td class='n'>{sum(good)} of {len(good)}</td><td class='n'>{share:.1%}</td>"
            f"<td>{bar}</td><td class='n'>{low:.1%} to {high:.1%}</td></tr>"
        )
    return f"<table><tr><th>{html.escape(name)}</th><th>passed</th><th></th><th></th><th>interval</th></tr>{''.join(rows)}</table>"


def _by_world_and_controller(results: Results) -> Iterable[str]:
    """The tables of one member alone hide that all failures of one world are one controller's."""
    cells: dict[tuple[str, str], list[bool]] = {}
    for case, row in results.done:
        cells.setdefault((case.world, case.controller), []).append(row["status"] == "passed")
    worlds, controllers = (list(dict.fromkeys(one[i] for one in cells)) for i in (0, 1))
    if min(len(worlds), len(controllers)) < 2:
        return
    yield "<table><tr><th>passed</th>"
    yield "".join(f"<th>{html.escape(one)}</th>" for one in controllers)
    for world in worlds:
        yield f"</tr><tr><td>{html.escape(world)}</td>"
        for controller in controllers:
            good = cells.get((world, controller), [])
            yield f"<td class='n'>{f'{sum(good)} of {len(good)}' if good else ''}</td>"
    yield "</tr></table>"


def cause_of(row: dict[str, Any]) -> tuple[str, str, str]:
    """Failures that differ in their numbers alone have one cause."""
    return row["status"], row["what"], _NUMBER.sub("#", row["reason"])


def _reasons(results: Results) -> Iterable[str]:
    groups: dict[tuple[str, str, str], list[tuple[Case, dict[str, Any]]]] = {}
    for case, row in results.failed:
        groups.setdefault(cause_of(row), []).append((case, row))
    if not groups:
        return
    yield "<h2>Why they failed</h2><table><tr><th>status</th><th>what</th><th>cases</th><th>first</th></tr>"
    for (status, what, _), members in sorted(groups.items(), key=lambda one: -len(one[1])):
        case, row = members[0]
        yield (
            f"<tr><td>{status}</td><td>{html.escape(what)}</td><td class='n'>{len(members)}</td><td>{case.number}: "
            f"{html.escape(row['reason'])}</td></tr>"
        )
    yield "</table>"


def _all_cases(results: Results) -> Iterable[str]:
    """A table of all cases with status and reason."""
    yield "<h2>All cases</h2><details><summary>the result of each</summary><table>"
    yield "<tr><th></th><th>world</th><th>controller</th><th>seed</th><th></th><th></th></tr>"
    for case, row in results.done[:_MOST_ROWS]:
        yield (
            f"<tr><td class='n'>{case.number}</td><td>{html.escape(case.world)}</td>"
            f"<td>{html.escape(case.controller)}</td><td class='n'>{case.seed}</td>"
            f"<td>{row['status']}</td><td>{html.escape(row['reason'])}</td></tr>"
        )
    yield "</table>"
    if len(results.done) > _MOST_ROWS:
        yield f"<p>... and {len(results.done) - _MOST_ROWS} more: <code>ruedo campaign export</code></p>"
    yield "</details>"


# ---- Plots.


def new_figure(width: float = 3.4, height: float = 2.5) -> Any:
    try:
        import matplotlib
    except ImportError:
        raise missing("matplotlib", "campaign") from None
    matplotlib.use("svg")
    matplotlib.rcParams.update(
        {
            "svg.hashsalt": "ruedo",
            "font.size": 8,
            "axes.spines.top": False,
            "axes.spines.right": False,
        }
    )
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _svg(figure: Any) -> str:
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    whole = text.getvalue()
    return whole[whole.index("<svg") :]


def _distributions(results: Results) -> Iterable[str]:
    names = sorted({name for _, row in results.done for name in row["metrics"]})
    plots = []
    for name in names:
        values: dict[str, list[float]] = {}
        for value, row in _finite(name, results):
            values.setdefault(row["status"], []).append(value)
        if not _differ([value for some in values.values() for value in some]):
            continue
        shown = [status for status in _COLOURS if status in values]
        figure = new_figure()
        axes = figure.add_subplot()
        axes.hist(
            [values[status] for status in shown],
            bins=20,
            stacked=True,
            color=[_COLOURS[status] for status in shown],
            label=shown,
        )
        axes.set_xlabel(name)
        axes.locator_params(axis="x", nbins=6)
        axes.legend(frameon=False)
        plots.append(f"<figure>{_svg(figure)}</figure>")
    if plots:
        yield f"<h2>Distributions</h2><div class='plots'>{''.join(plots)}</div>"


def _differ(values: list[float]) -> bool:
    """Whether a scale can show the difference: above rounding, and finite."""
    low, high = min(values, default=0.0), max(values, default=0.0)
    return math.isfinite(high - low) and high - low > 1e-9 * max(abs(low), abs(high))


def _finite(name: str, results: Results) -> Iterator[tuple[float, dict[str, Any]]]:
    """A metric of the user's may be nan."""
    for _, row in results.done:
        if math.isfinite(row["metrics"].get(name, math.nan)):
            yield row["metrics"][name], row


def _heat_map(results: Results) -> Iterable[str]:
    from matplotlib.ticker import MaxNLocator

    plots = []
    for world in dict.fromkeys(case.world for case in results.cases):
        failed = [(case, row) for case, row in results.failed if case.world == world]
        places = [place_of_failure(row) for _, row in failed]
        known = [one for one in places if one and max(map(abs, one)) < _FARTHEST_M]
        if not known:
            continue
        figure = new_figure(5.2, 3.6)
        axes = figure.add_subplot()
        extent = _extent(results, world)
        walls = _draw_walls(axes, failed[0][0], extent)
        drawn = axes.hexbin(
            *zip(*known),
            extent=extent,
            gridsize=24,
            mincnt=1,
            vmin=0,
            cmap="OrRd",
            linewidths=0.2,
        )
        bar = figure.colorbar(drawn, label="failures")
        bar.locator = MaxNLocator(integer=True)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel("x (m)")
        axes.set_ylabel("y (m)")
        plots.append(
            f"<figure>{_svg(figure)}<figcaption>{html.escape(world)}: {len(known)} failures, where the robot was then{walls}</figcaption></figure>"
        )
    if plots:
        yield f"<h2>Where they failed</h2><div class='plots'>{''.join(plots)}</div>"


def _draw_walls(axes: Any, case: Case, extent: tuple[float, float, float, float]) -> str:
    """Whose walls they are, for the caption, since a parameter may change them; "" where there is
    no map of the world.
    """
    world = case.what.get("world")
    if not world:
        return ""
    with tempfile.TemporaryDirectory(prefix="ruedo-map-") as folder:
        file = os.path.join(folder, "walls.yaml")
        command = [find_ruedo(), "map", world["file"], "-o", file, "--quiet"]
        done = subprocess.run(command, capture_output=True, check=False)
        try:
            walls = load_map(file) if done.returncode == 0 else None
        except (ValueError, OSError, NotSupported):
            walls = None
    if walls is None:
        return ""
    rows, columns = (walls.cells == OCCUPIED).nonzero()
    x = walls.origin[0] + walls.resolution * (columns + 0.5)
    y = walls.origin[1] + walls.resolution * (rows + 0.5)
    near = (x > extent[0] - _MAP_MARGIN_M) & (x < extent[1] + _MAP_MARGIN_M)
    near &= (y > extent[2] - _MAP_MARGIN_M) & (y < extent[3] + _MAP_MARGIN_M)
    axes.plot(x[near], y[near], "s", color="#1d2330", markersize=0.8, markeredgewidth=0)
    return f"; walls as in case {case.number}"


def _extent(results: Results, world: str) -> tuple[float, float, float, float]:
    """Least and most x and y (m) of all runs in a world, with a margin."""
    margin_m = 0.5
    places = [
        place[1:]
        for case, row in results.done
        if case.world == world
        for place in row["track"] or ()
        if max(map(abs, place)) < _FARTHEST_M
    ]
    x, y = zip(*places)
    return min(x) - margin_m, max(x) + margin_m, min(y) - margin_m, max(y) + margin_m


def place_of_failure(row: dict[str, Any]) -> tuple[float, float] | None:
    """The robot's place when the first expectation failed; at the end, if that has no
    time.
    """
    if not row["track"]:
        return None
    try:
        time_s = float(row["reason"].split(" s:")[0])
    except ValueError:
        time_s = row["track"][-1][0]
    place = min(row["track"], key=lambda one: abs(one[0] - time_s))
    return place[1], place[2]


def badness(row: dict[str, Any]) -> tuple[float, ...]:
    """The worst first: crashes, then contacts, then what missed its goal by most."""
    metrics = row["metrics"]
    order = {"crashed": 0, "memory": 0, "timeout": 0, "invalid": 1, "not judged": 1}
    return (
        order.get(row["status"], 2),
        0 if "contact_time_s" in metrics else 1,
        -metrics.get("goal_distance_m", 0.0),
        metrics.get("clearance_m", 0.0),
    )


def _worst_of(results: Results) -> list[tuple[Case, dict[str, Any]]]:
    """The worst of each cause first, then the second of each, ..."""
    turns: Counter[tuple[str, str, str]] = Counter()
    ordered: list[tuple[int, int, Case, dict[str, Any]]] = []
    for case, row in sorted(results.failed, key=lambda one: (badness(one[1]), one[0].number)):
        ordered.append((turns[cause_of(row)], len(ordered), case, row))
        turns[cause_of(row)] += 1
    return [(case, row) for _, _, case, row in sorted(ordered, key=lambda one: one[:2])]


def _worst(
    campaign: Any,
    results: Results,
    worst: list[tuple[Case, dict[str, Any]]],
    pages: dict[str, Path],
) -> Iterable[str]:
    if not worst:
        return
    yield "<h2>The worst runs</h2><div class='plots'>"
    for case, row in worst[: max(_WORST, len(pages))]:
        caption = _caption(campaign, results, case, row)
        if case.id in pages:
            page = pages[case.id]
            caption += f"<br><a href='{quote(page.parent.name)}/{quote(page.name)}'>look at it</a>"
        yield f"<figure>{_path(case, row)}<figcaption>{caption}</figcaption></figure>"
    yield "</div>"


def _path(case: Case, row: dict[str, Any]) -> str:
    figure = new_figure()
    axes = figure.add_subplot()
    if row["track"]:
        _, x, y = np.clip(row["track"], -_FARTHEST_M, _FARTHEST_M).T
        axes.plot(x, y, color="#2c5f9e", linewidth=1.2)
        axes.plot(x[0], y[0], "o", color="#2c5f9e", markersize=4)
        place = place_of_failure(row)
        if place and max(map(abs, place)) < _FARTHEST_M:
            axes.plot(*place, "x", color="#c23b22", markersize=7)
    for goal in case.what.get("expect", {}).get("goal", []):
        from matplotlib.patches import Circle

        axes.add_patch(Circle((goal["x"], goal["y"]), goal["radius"], fill=False, color="#3b8f4a"))
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.1)
    return _svg(figure)


def _caption(campaign: Any, results: Results, case: Case, row: dict[str, Any]) -> str:
    settings = ", ".join(f"{name}={value}" for name, value in case.parameters.items())
    text = f"<b>{case.number}</b> {html.escape(case.controller)}, seed {case.seed}{', ' + html.escape(settings) if settings else ''}: {html.escape(row['reason'])}"
    log = results.log(case)
    if log:
        text += f"<br><a href='file://{html.escape(str(log.resolve()))}'>log</a> of what acted"
    if campaign.file:  # the console shows messages, which a kept log is without
        again, run = shlex.quote(str(campaign.file)), f"case{case.number}.lcm"
        shown = f"ruedo campaign repeat {again} {case.number} -o {run} &amp;&amp; ruedo play {run} --view"
        text += f"<br>in the console: <code>{shown}</code>"
    return text


def _comparison(campaign: Any, baseline: str) -> Iterable[str]:
    found = compare_with(campaign, baseline)
    change, low, high = found.change
    yield (
        f"<h2>Compared with {html.escape(found.before)}</h2><p>{found.count} cases in both: {len(found.worse)} became worse, "
        f"{len(found.better)} better. The success rate changed by {change:+.1%} (95 % interval {low:+.1%} to {high:+.1%}); "
        f"exact p = {found.p:.3g} (McNemar).</p><table><tr><th></th><th>case</th><th>before</th><th>now</th></tr>"
    )
    for kind, pairs in (("worse", found.worse), ("better", found.better)):
        for case, before, now in pairs[:50]:
            then, today = (
                html.escape(f"{one['status']}: {one['reason']}") for one in (before, now)
            )
            yield f"<tr><td>{kind}</td><td>{case.number}</td><td>{then}</td><td>{today}</td></tr>"
    yield "</table>"
