"""The hunt: choices become cases, cases are run, and what fails is shrunk."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..campaign import Campaign
from ..campaign.case import fault_text
from ..campaign.errors import CampaignError, SpecError
from ..campaign.local import Crew, cores
from ..campaign.names import check_names
from ..campaign.outcome import Outcome as OutcomeOfCase
from ..campaign.plan import Case
from ..campaign.worlds import changed
from ..engine import Engine
from .obstacles import Box, with_boxes
from .regression import keep
from .search import SEARCHES, breaks
from .shrink import Way, shrink
from .space import Choices, Space

Outcome = dict[str, Any]
Progress = Callable[[int, Outcome, float], None]  # how many cases, the outcome, its score
_REACH_M = 3.0  # clearances below it steer
_AT_ONCE_S = 0.1  # in which no robot gets away from anything


@dataclass
class Found:
    """A case that breaks the controller, as small as it became.

    cases: how many it took, the one that was found included; shrinking took `shrink_cases` more.
    """

    choices: Choices
    outcome: Outcome
    case: Case
    cases: int
    shrink_cases: int
    content: dict[str, Any]
    folder: Path
    files: list[str]  # that its world refers to

    @property
    def status(self) -> str:
        return str(self.outcome["status"])

    @property
    def reason(self) -> str:
        return str(self.outcome["reason"])

    def keep(self, folder: str | Path) -> Path:
        """Writes it as a regression test: what `ctest` and `pytest` run from then on."""
        return keep(self, Path(folder))


class Hunt:
    """spec: a campaign's file, or dict, with one controller and one world; `hunt` in it says what
    else may be chosen.
    """

    def __init__(
        self, spec: Any, *, folder: str | Path = ".", out: str | Path | None = None
    ) -> None:
        self._campaign = Campaign(spec, folder=folder, out=out)
        self.name = self._campaign.name
        self.content: dict[str, Any] = self._campaign.content
        self.folder = self._campaign.folder
        self._check_members()
        self.space = Space(self.content, self._campaign.source)
        self._store = self._campaign.out / "worlds"

    def run(
        self,
        *,
        cases: int = 200,
        seed: int = 1,
        by: str = "optuna",
        workers: int | None = None,
        shrink_cases: int = 100,
        progress: Progress | None = None,
    ) -> Found | None:
        """The first case that fails, shrunk; None: none was found. The same seed finds the same,
        with any number of workers.

        by: "optuna" (TPE, after the corners), "hypothesis" (its own draws, steered by target()), or
        "random" (uniform draws).
        """
        check_names([self.case(self.space.neutral())], self._campaign.source, self.folder)
        self._check_faults()
        count = invalid = found_after = 0
        first_invalid = ""
        with Crew(str(self.folder), workers or cores()) as crew:

            def evaluate(several: list[Choices]) -> list[tuple[Outcome, float]]:
                nonlocal count, invalid, found_after, first_invalid
                outcomes = _run(crew, [self._case_or_why_not(one) for one in several])
                outcomes = [_without_impossible(one) for one in outcomes]
                for outcome in outcomes:
                    count += 1
                    if breaks(outcome):
                        found_after = found_after or count
                    if outcome["status"] == "invalid":
                        invalid += 1
                        first_invalid = first_invalid or outcome["reason"]
                    if progress:
                        progress(count, outcome, self.score(outcome))
                return [(outcome, self.score(outcome)) for outcome in outcomes]

            hit = SEARCHES[by](self.space, evaluate, cases, seed)
            if hit is None:
                if 2 * invalid > count:
                    raise CampaignError(
                        f"{self.name}: {invalid} of {count} cases could not be run: {first_invalid}"
                    )
                return None
            choices, outcome = hit
            searched = count
            way = Way(self.content)
            choices, outcome = shrink(self.space, choices, outcome, evaluate, shrink_cases, way)
            case = self.case(choices)
            world = case.what["world"]
            return Found(
                self.space.used(choices),
                outcome,
                case,
                found_after,
                count - searched,
                self.content_of(choices),
                self.folder,
                self._campaign.worlds.read_with(world["file"], world["spawn"]),
            )

    def _check_members(self) -> None:
        for name in ("worlds", "controllers", "robots"):
            count = len(self.content.get(name, [""]))
            if count != 1:
                raise self._campaign.source.error((name,), f"has {count} members; a hunt has one")

    def _check_faults(self) -> None:
        """Each that may be chosen is one of its robot; else the hunt would never find it."""
        for i in range(len(self.space.faults)):
            try:
                what = self.case({**self.space.neutral(), "fault": str(i)}).what
                world, spawn = what["world"]["file"], what["world"]["spawn"]
                faults = [fault_text(one) for one in what["faults"]]
                allowed = what["expect"].get("allow_errors", False)
                spawned = [spawn] if spawn else []
                Engine(world, spawn=spawned, fault=faults, allow_errors=allowed).close()
            except (SpecError, ValueError) as error:
                raise self._campaign.source.error(("hunt", "faults", i), str(error)) from None

    def score(self, outcome: Outcome) -> float:
        """How well it went: below 0 it failed; else the smaller of the clearance (of 3 m) and what
        was left of the time.
        """
        if outcome["status"] != "passed":
            return -1.0
        metrics = outcome["metrics"]
        parts = [metrics.get("clearance_m", _REACH_M) / _REACH_M]
        goals = self.content.get("expect", {}).get("goal")
        if goals and "goal_time_s" in metrics:
            by = self.content["limits"]["duration"]
            parts.append(1.0 - metrics["goal_time_s"] / by)
        return float(min(parts))

    def content_of(self, choices: Choices) -> dict[str, Any]:
        """A campaign's file of this one case."""
        space = self.space
        content = json.loads(
            json.dumps({key: value for key, value in self.content.items() if key != "hunt"})
        )
        content["parameters"] = {name: [choices[name]] for name in space.parameters}
        content["seeds"] = [choices["seed"]]
        content["faults"] = content.get("faults", []) + space.fault(choices)
        expect = content.setdefault("expect", {})
        expect.setdefault("clearance_reach", _REACH_M)
        if "duration" in choices:
            content["limits"]["duration"] = choices["duration"]
        return content

    def case(self, choices: Choices) -> Case:
        """The case to run."""
        content = self.content_of(choices)
        made = self._campaign_of(content)
        boxes = self.space.boxes(choices)
        if boxes:
            content["worlds"] = [
                {
                    "name": made.cases[0].world,
                    "file": str(self._with_boxes(made.cases[0], boxes)),
                }
            ]
            made = self._campaign_of(content)
        (case,) = made.cases
        return case

    def _case_or_why_not(self, choices: Choices) -> Case | Outcome:
        """The case, or why it cannot be made; the hunt continues without it."""
        try:
            return self.case(choices)
        except SpecError as error:
            outcome = OutcomeOfCase()
            outcome.fail("invalid", "case", str(error))
            return outcome.as_dict()

    def _campaign_of(self, content: dict[str, Any]) -> Campaign:
        made = Campaign(content, folder=self.folder, out=self._campaign.out)
        made.worlds = self._campaign.worlds  # what was read once is known
        made.folders = self._campaign.folders
        made.source = self._campaign.source
        return made

    def _with_boxes(self, case: Case, boxes: list[Box]) -> Path:
        """The world with the boxes, beside copies of the files that it refers to."""
        world = case.what["world"]
        files = self._campaign.worlds.read_with(world["file"], world["spawn"])
        return changed(world, files, self.folder, self._store, lambda text: with_boxes(text, boxes))


def _without_impossible(outcome: Outcome) -> Outcome:
    """A robot that is put into an obstacle breaks no controller: none could pass."""
    at, is_timed, _ = outcome["reason"].partition(" s: ")
    touches = outcome["status"] == "failed" and outcome["what"] in ("contact", "clearance")
    if not (touches and is_timed and float(at) <= _AT_ONCE_S):
        return outcome
    made = OutcomeOfCase()
    made.fail("invalid", "case", f"no controller could pass: {outcome['reason']}")
    return made.as_dict()


def _run(crew: Crew, cases: list[Case | Outcome]) -> list[Outcome]:
    """The outcomes in the order of the cases; finished ones are kept."""
    wanted = list({case.id: case for case in cases if isinstance(case, Case)}.values())
    found = {case.id: outcome for case, outcome, _ in crew.run(wanted)}
    return [found[case.id] if isinstance(case, Case) else case for case in cases]
