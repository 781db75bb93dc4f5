"""Two campaigns, case by case: the same world, robot, parameters and seed."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .errors import CampaignError, NothingCompared, ResultsError
from .plan import Case
from .stats import mcnemar, paired_difference
from .store import Results, Store

Pair = tuple[
    Case, dict[str, Any], dict[str, Any]
]  # the new case, its result before, its result now


@dataclass
class Comparison:
    """The differences between the cases that both campaigns have."""

    before: str
    now: str
    both: int = 0
    neither: int = 0
    worse: list[Pair] = field(default_factory=list)
    better: list[Pair] = field(default_factory=list)
    missing: int = 0  # that had a result before, and have none now

    @property
    def count(self) -> int:
        return self.both + self.neither + len(self.worse) + len(self.better)

    @property
    def p(self) -> float:
        """McNemar's exact test, two-sided."""
        return mcnemar(len(self.worse), len(self.better))

    @property
    def change(self) -> tuple[float, float, float]:
        """The change of the success rate, with its 95 % interval."""
        return paired_difference(self.both, len(self.worse), len(self.better), self.neither)

    def as_dict(self) -> dict[str, Any]:
        change, low, high = self.change
        return {
            "before": self.before,
            "now": self.now,
            "pairs": self.count,
            "both": self.both,
            "neither": self.neither,
            "worse": [case.number for case, _, _ in self.worse],
            "better": [case.number for case, _, _ in self.better],
            "missing": self.missing,
            "p": self.p,
            "change": change,
            "interval": [low, high],
        }

    def text(self) -> str:
        change, low, high = self.change
        lines = [
            f"{self.now} after {self.before}: {self.count} cases in both",
            f"success {change:+.1%} (95 % interval {low:+.1%} to {high:+.1%}), {len(self.worse)} worse, "
            f"{len(self.better)} better, exact p = {self.p:.3g} (McNemar)",
        ]
        if self.missing:
            lines.append(f"{self.missing} more of {self.before} have no result in {self.now}")
        lines += [
            f"  worse: {case.number} {case.id} {now['status']}: {now['reason']}"
            for case, _, now in self.worse[:20]
        ]
        lines += [
            f"  better: {case.number} {case.id}: it was {before['status']}: {before['reason']}"
            for case, before, _ in self.better[:20]
        ]
        return "\n".join(lines)


def compare(before: Results, now: Results, names: tuple[str, str]) -> Comparison:
    """Pairs by all but the controller; where a side has several controllers, by its name, too."""
    several = max(len({case.controller for case in one.cases}) for one in (before, now)) > 1

    def key(case: Case) -> str:
        return f"{case.place} {case.controller if several else ''}"

    old = {key(case): row for case, row in before.done}
    result = Comparison(*names)
    for case, row in now.done:
        was = old.get(key(case))
        if was is None:
            continue
        good, was_good = row["status"] == "passed", was["status"] == "passed"
        if good and was_good:
            result.both += 1
        elif was_good:
            result.worse.append((case, was, row))
        elif good:
            result.better.append((case, was, row))
        else:
            result.neither += 1
    result.missing = len(old) - result.count
    if result.count == 0:
        raise NothingCompared(
            f"{names[0]} and {names[1]} have no case in common: the same world, robot, parameters and seed"
        )
    return result


def compare_with(campaign: Any, baseline: str) -> Comparison:
    """baseline: a folder of results, or ":NAME", the campaign's own results with that
    controller.
    """
    now = campaign.results()
    if not baseline.startswith(":"):
        return compare(results_of(Path(baseline)), now, (baseline, str(campaign.out)))
    name = baseline[1:]
    controllers = sorted({case.controller for case in campaign.cases})
    if name not in controllers or len(controllers) != 2:
        raise CampaignError(
            f"{baseline}: the campaign's controllers are {', '.join(controllers)}; one of two is needed"
        )
    other = next(one for one in controllers if one != name)

    def only(controller: str) -> Results:
        cases = [case for case in now.cases if case.controller == controller]
        return Results(
            cases, {case.id: row for case in cases if (row := now.row(case))}, now.folder
        )

    return compare(only(name), only(other), (name, other))


def results_of(folder: Path) -> Results:
    """A folder's results, with the cases that they were made from as the folder remembers them."""
    with Store(folder, write=False) as store:
        text = store.about("cases")
        if text is None:
            raise ResultsError(f"{folder} holds no results of a campaign")
        try:
            cases = [_remembered(one) for one in json.loads(text)]
        except (TypeError, ValueError, KeyError, RecursionError):
            raise ResultsError(f"{folder}: the list of its cases is damaged") from None
        return Results(cases, store.rows(case.id for case in cases), folder)


def _remembered(one: dict[str, Any]) -> Case:
    """Raises what a wrong one leads to."""
    case = Case(what={}, **one)
    texts = (case.id, case.world, case.robot, case.controller)
    if not all(isinstance(text, str) for text in texts) or not isinstance(case.parameters, dict):
        raise TypeError
    if not isinstance(case.number, int) or not isinstance(case.seed, int):
        raise TypeError
    return case
