"""Since when a failed run could not be saved any more, and which single change would have saved it.

The run is branched: up to a moment everything acts as in its log, from there on something else
does.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..campaign import Campaign, Case
from ..campaign.case import fault_text, goals
from ..campaign.errors import CampaignError, SpecError, UsageError
from ..campaign.local import Crew
from ..campaign.outputs import replacing
from ..campaign.store import Store
from ..campaign.worlds import MOST_WORLD_BYTES, changed
from ..decoding import decode
from ..engine import Engine
from ..files import read_bytes
from ..logs import APPLIED_CHANNEL, HEADER_CHANNEL, STATE_HASH_CHANNEL, Event, events
from .obstacles import models_of, without_model

# Commands that a controller could have sent from a moment on: m/s, rad/s.
MANOEUVRES = {
    "stop": (0.0, 0.0),
    "go back": (-0.3, 0.0),
    "turn left": (0.0, 0.8),
    "turn right": (0.0, -0.8),
}
_PERIOD_S = 0.25  # between moments that are tried
_AFTER_S = 3.0  # how long a branch continues after the failure
_MOST = 80  # moments
_NO_OBSTACLES = ("ground_plane", "sun")  # without the ground a robot falls, and touches nothing
_MOST_CHANGES = 12  # of the world's models, and of other cases' parameters
_PLOTS = (".svg", ".png", ".pdf")
_HASHES_US = 1_000_000  # sim time between the states whose hash is in a log
_Again = tuple[Crew, dict[str, Any]]  # what runs a campaign's case again, and its `what`


@dataclass
class Recorded:
    """The inputs of a run, from its log."""

    path: str
    world: str
    seed: int
    options: dict[str, Any]
    commands: list[tuple[int, str, bytes]]  # step, channel, message
    steps: int

    @staticmethod
    def read(path: str) -> Recorded:
        from ..lcmtypes import applied_t, log_header_t, request_t, state_hash_t

        of_lockstep = (request_t.JOIN, request_t.LEAVE)  # which change nothing in the world

        def decoded(message_type: Any, event: Event) -> Any:
            try:
                return decode(message_type, event.data)
            except Exception:
                raise SpecError(
                    f"{path}: a message of {event.channel}, at {event.timestamp * 1e-6:g} s, is broken"
                ) from None

        if not os.path.isfile(path):
            raise SpecError(f"{path}: no such file")
        header = None
        commands: list[tuple[int, str, bytes]] = []
        steps = utime = 0
        for event in events(path):
            if event.channel == HEADER_CHANNEL and header is None:
                header = decoded(log_header_t, event)
            elif event.channel == APPLIED_CHANNEL:
                applied = decoded(applied_t, event)
                if applied.channel.startswith("ruedo/") and applied.kind in of_lockstep:
                    continue
                if applied.channel.startswith("ruedo/"):
                    raise SpecError(
                        f"{path}: a request acted on the run (at {applied.utime * 1e-6:g} s); runs with commands alone can be branched"
                    )
                commands.append((applied.step, applied.channel, bytes(applied.data)))
            elif event.channel == STATE_HASH_CHANNEL:
                state = decoded(state_hash_t, event)
                step_us = header.step_us if header else 0
                latest = utime + max(_HASHES_US, step_us)
                if state.utime != state.step * step_us or not utime <= state.utime <= latest:
                    raise SpecError(
                        f"{path}: no run has a state of step {state.step} at {state.utime * 1e-6:g} s "
                        f"after that of step {steps} at {utime * 1e-6:g} s"
                    )
                steps, utime = state.step, state.utime
        if header is None:
            raise SpecError(f"{path}: is not a log of a run")
        seed = header.seed % 2**64  # a message has no unsigned numbers
        options = _options(header.options, path)
        return Recorded(path, header.world_file, seed, options, commands, steps)

    def engine(self, worlds: int = 1, **changed: Any) -> Engine:
        with self._blamed():
            given = {**self.options, **changed}  # the run was run, whatever its world lacks
            return Engine(self.world, worlds=worlds, seed=self.seed, allow_errors=True, **given)

    def replay(self, engine: Engine, until: int, from_step: int = 0) -> None:
        """The commands act again, on every copy, up to the state of that step."""
        for step, channel, message in self.commands:
            if step < from_step or step >= until:
                continue
            if step > engine.steps():
                engine.step(None, step - engine.steps())
            with self._blamed():
                for copy in range(engine.worlds):
                    engine.command(copy, channel, message)
        if until > engine.steps():
            engine.step(None, until - engine.steps())

    @contextmanager
    def _blamed(self) -> Iterator[None]:
        """Turns an error of the log's contents into a SpecError that names the log."""
        try:
            yield
        except ValueError as error:
            raise SpecError(f"{self.path}: {error}") from None


def _options(texts: list[str], path: str) -> dict[str, Any]:
    made: dict[str, Any] = {
        "spawn": [],
        "drive": [],
        "settings": {},
        "disable": [],
        "fault": [],
        "noise": True,
    }
    for text in texts:
        name, _, value = text.removeprefix("--").partition("=")
        if name == "no-noise":
            made["noise"] = False
        elif name == "set":
            key, _, setting = value.partition("=")
            made["settings"][key] = setting
        elif name in made:
            made[name].append(value)
        elif name != "remap":
            raise SpecError(
                f"{path}: its run had the option {text}, which `ruedo why` cannot repeat"
            )
    return made


@dataclass
class Branches:
    """How many of the other seeds that acted from a moment on avoided it."""

    from_s: float
    avoided: int
    tried: int

    def __str__(self) -> str:
        return f"{self.avoided} of {self.tried} other seeds from {self.from_s:g} s on avoid it"


@dataclass
class Answer:
    """failed_s: when. rescues: of each manoeuvre and moment, whether it saved the run. seeds: the
    latest moment first. changes: what was changed, and what came of it. not_tried: what else might
    be the cause.
    """

    failed_s: float
    reason: str
    rescues: dict[str, list[tuple[float, bool]]] = field(default_factory=dict)
    seeds: list[Branches] = field(default_factory=list)
    changes: list[tuple[str, bool, str]] = field(default_factory=list)
    not_tried: list[str] = field(default_factory=list)

    @property
    def too_late_s(self) -> float | None:
        """The last moment from which some manoeuvre saved it; None: none did."""
        saved = [at for tries in self.rescues.values() for at, good in tries if good]
        return max(saved) if saved else None

    def text(self) -> str:
        lines = [f"failed: {self.reason}"]
        if self.rescues:
            at = self.too_late_s
            first = min(at for tries in self.rescues.values() for at, _ in tries)
            best = [name for name, tries in self.rescues.items() if (at, True) in tries]
            lines.append(
                f"from {first:g} s on nothing that was tried avoids it: {', '.join(self.rescues)}"
                if at is None
                else f"it could be avoided up to {at:g} s ({' or '.join(best)}), {self.failed_s - at:.2f} s before it happened; "
                f"from {at + _PERIOD_S:g} s on no more"
            )
        lines += map(str, self.seeds)
        for what, good, reason in self.changes:
            lines.append(
                f"{'avoids it' if good else 'does not'}: {what}" + ("" if good else f" ({reason})")
            )
        return "\n".join([*lines, f"not tried: {', '.join(self.not_tried)}"])

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), "too_late_s": self.too_late_s}


def why(path: str, seeds: int = 5) -> Answer:
    """Explains a failure in a log that a campaign kept, or in another log of a run in which the
    first robot touched something. seeds: the number of other seeds to try.
    """
    recorded = Recorded.read(path)
    case = _case_of(path)
    answer = _as_it_was(recorded, case)
    if "touched" in answer.reason:
        answer.rescues = _rescues(recorded, answer.failed_s)
    others = [seed for seed in range(1, seeds + 2) if seed != recorded.seed][:seeds]
    with Crew(str(case[0].folder) if case else ".") as crew:
        again = (crew, case[1].what) if case else None
        if others:
            answer.seeds = _branches(recorded, again, answer.failed_s, others)
        answer.changes = list(_changes(recorded, again, answer.failed_s, others))
        answer.not_tried = ["several changes at once"]
        if case:
            answer.changes += _other_parameters(*case)
            answer.changes += _without_models(crew, *case, answer)
        else:
            answer.not_tried += ["other parameters", "the world without one of its models"]
    return answer


def _other_parameters(campaign: Campaign, case: Case) -> list[tuple[str, bool, str]]:
    """The campaign's results of cases that differ in one parameter alone."""
    results = campaign.results()
    found = []
    for other, row in results.done:
        differs = [name for name, at in case.parameters.items() if other.parameters[name] != at]
        same = all(
            getattr(other, one) == getattr(case, one)
            for one in ("world", "robot", "controller", "seed")
        )
        if same and len(differs) == 1:
            (name,) = differs
            text = f"{name} = {other.parameters[name]} (case {other.number})"
            found.append((text, row["status"] == "passed", row["reason"]))
    return found[:_MOST_CHANGES]


def _without_models(
    crew: Crew, campaign: Campaign, case: Case, answer: Answer
) -> Iterator[tuple[str, bool, str]]:
    """Leaves out one model at a time, the touched ones first."""
    world = case.what["world"]
    files = campaign.worlds.read_with(world["file"], world["spawn"])
    text = read_bytes(
        world["file"] if os.path.isfile(world["file"]) else files[0], MOST_WORLD_BYTES
    )
    spawn = [world["spawn"]] if world["spawn"] else []
    with Engine(world["file"], spawn=spawn, allow_errors=True) as engine:
        robots = {*engine.robots, *(owner for owner, _, _ in engine.devices)}
    try:
        names = [
            name
            for name, begin, end in models_of(text)
            if name not in {*robots, *_NO_OBSTACLES} and b"<plane" not in text[begin:end]
        ]
    except ValueError:
        names = []
    names.sort(key=lambda name: f"touched {name}/" not in answer.reason)
    if names[_MOST_CHANGES:]:
        answer.not_tried.append(f"the world without {', '.join(names[_MOST_CHANGES:])}")
    with tempfile.TemporaryDirectory(prefix="ruedo-why-") as store:
        for name in names[:_MOST_CHANGES]:
            without = partial(without_model, name=name)
            file = changed(world, files, campaign.folder, Path(store), without)
            outcome = crew.run_one({**case.what, "world": {**world, "file": str(file)}})
            yield f"without the model {name}", outcome.status == "passed", outcome.reason


def files_read(path: str) -> list[Path]:
    """The log, and for a campaign's log the campaign's files."""
    case = _case_of(path)
    return [Path(path), *(case[0].files_read if case else [])]


def _case_of(path: str) -> tuple[Campaign, Case] | None:
    """The campaign and case of a log in a campaign's folder."""
    folder = Path(path).resolve().parent.parent
    if not (folder / "results.sqlite").is_file():
        return None
    with Store(folder, write=False) as store:
        text = store.about("campaign")
    if text is None:
        return None
    about = json.loads(text)
    campaign = Campaign(about["content"], folder=about["folder"], out=folder)
    found = [case for case in campaign.cases if case.id == Path(path).stem]
    if not found:
        raise CampaignError(
            f"{path}: its case is not a case of {campaign.name} any more: its files were changed since"
        )
    return campaign, found[0]


def _as_it_was(recorded: Recorded, case: tuple[Campaign, Case] | None) -> Answer:
    expect: dict[str, Any] = case[1].what["expect"] if case else {"no_contact": True}
    with recorded.engine() as engine:
        engine.begin_run(
            recorded.seed,
            goals=goals(case[1].what) if case else (),
            no_contact=expect.get("no_contact", False),
            clearance=expect.get("clearance"),
            odometry_error=expect.get("odometry_error"),
            robot=expect.get("robot", ""),
        )
        recorded.replay(engine, recorded.steps)
        failures = engine.end_run()["failures"]
    if not failures:
        raise SpecError(
            f"{recorded.path}: this run did not fail: {'its controller did' if case else 'nothing was touched'}"
        )
    judged = [one for one in failures if one["time_s"] is not None]
    if not judged:
        raise SpecError(f"{recorded.path}: {failures[0]['text']}")
    return Answer(judged[0]["time_s"], f"{judged[0]['time_s']:.3f} s: {judged[0]['text']}")


def _moments(failed_s: float) -> list[float]:
    """Earlier and earlier."""
    last = round(failed_s / _PERIOD_S) - 1
    return [_PERIOD_S * i for i in range(last, max(0, last - _MOST), -1)]


def _rescues(recorded: Recorded, failed_s: float) -> dict[str, list[tuple[float, bool]]]:
    """Earlier and earlier, until all manoeuvres save it at two moments in a row, or the run is at
    its beginning.
    """
    found: dict[str, list[tuple[float, bool]]] = {name: [] for name in MANOEUVRES}
    commands = np.array([[pair] for pair in MANOEUVRES.values()])
    with recorded.engine(len(MANOEUVRES)) as engine:
        clean = 0
        for moment in _moments(failed_s):
            engine.reset(seed=[recorded.seed] * len(MANOEUVRES))
            recorded.replay(engine, round(moment / engine.step_size))
            touched = np.zeros(len(MANOEUVRES), bool)
            pace = max(1, round(0.1 / engine.step_size))
            while engine.time() < failed_s + _AFTER_S:
                engine.step(
                    np.broadcast_to(commands, (len(MANOEUVRES), len(engine.robots), 2)), pace
                )
                touched |= engine.touching()[:, 0] > 0
            for name, hit in zip(MANOEUVRES, touched):
                found[name].append((moment, not bool(hit)))
            clean = clean + 1 if not touched.all() else 0
            if clean >= 4:
                break
    return found


def _branches(
    recorded: Recorded, case: _Again | None, failed_s: float, seeds: list[int]
) -> list[Branches]:
    """From moments on that lie 1, 2, 4, ... periods further back, until all seeds avoid it or the
    run is at its beginning; then between the last moment that one of them avoids it from and the
    next.
    """
    avoids = _controlled(case) if case else _recorded_commands(recorded)
    found: dict[int, Branches] = {}

    def try_from(period: int) -> Branches:
        moment = period * _PERIOD_S
        good = sum(avoids({"kind": "reseeded", "at": moment, "value": seed}) for seed in seeds)
        return found.setdefault(period, Branches(moment, good, len(seeds)))

    period = max(0, round(failed_s / _PERIOD_S) - 1)
    back = 1
    while try_from(period).avoided < len(seeds) and period > 0:
        period, back = max(0, period - back), 2 * back
    saved = [period for period, one in found.items() if one.avoided]
    if saved:
        low = max(saved)
        high = min((period for period in found if period > low), default=low)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if try_from(middle).avoided else (low, middle)
    return [found[period] for period in sorted(found, reverse=True)]


def _controlled(case: _Again) -> Callable[[dict[str, Any]], bool]:
    """Whether the case, its controller answering, passes with another fault."""
    crew, what = case

    def avoids(fault: dict[str, Any]) -> bool:
        return crew.run_one({**what, "faults": [*what["faults"], fault]}).status == "passed"

    return avoids


def _recorded_commands(recorded: Recorded) -> Callable[[dict[str, Any]], bool]:
    def avoids(fault: dict[str, Any]) -> bool:
        faults = [*recorded.options["fault"], fault_text(fault)]
        return _open_loop(recorded, "", fault=faults)[1]

    return avoids


def _changes(
    recorded: Recorded, case: _Again | None, failed_s: float, seeds: list[int]
) -> Iterator[tuple[str, bool, str]]:
    """Each alone; of a fault also the latest moment at which its end is soon enough. Of a
    campaign's case the controller answers to the change; of another log the commands stay as they
    were.
    """
    if case is None:
        for fault in recorded.options["fault"]:
            yield _open_loop(
                recorded,
                f"without the fault {fault}",
                fault=[one for one in recorded.options["fault"] if one != fault],
            )
        return
    crew, what = case

    def tried(text: str, **changed: Any) -> tuple[str, bool, str]:
        outcome = crew.run_one({**what, **changed})
        return text, outcome.status == "passed", outcome.reason

    faults = what["faults"]
    for i, fault in enumerate(faults):
        without = tried(f"without the fault {fault['kind']}", faults=faults[:i] + faults[i + 1 :])
        yield without
        begin = float(fault.get("at", 0.0))
        at_once = fault["kind"] in ("kidnapped", "reseeded")
        for moment in _moments(failed_s) if without[1] and not at_once else ():
            if moment <= begin:
                break
            ended = {**fault, "duration": moment - begin}
            found = tried(
                f"the fault {fault['kind']} ends at {moment:g} s, from there on the controller "
                "sees the truth",
                faults=[*faults[:i], ended, *faults[i + 1 :]],
            )
            if found[1]:
                yield found
                break
    for seed in seeds:
        yield tried(f"seed {seed}", seed=seed)
    if what["noise"]:
        yield tried("without noise", noise=False)


def _open_loop(recorded: Recorded, text: str, **changed: Any) -> tuple[str, bool, str]:
    with recorded.engine(**changed) as engine:
        engine.begin_run(recorded.seed, no_contact=True)
        recorded.replay(engine, recorded.steps)
        failures = engine.end_run()["failures"]
    return f"{text}, with the same commands", not failures, failures[0]["text"] if failures else ""


def check_plot(file: str) -> None:
    """Raises UsageError for a name by which it is not a picture that can be drawn."""
    if not file.endswith(_PLOTS):
        raise UsageError(f"-o {file}: its name ends with {', '.join(_PLOTS[:-1])} or {_PLOTS[-1]}")


def plot(answer: Answer, file: str) -> None:
    """The moments that were tried, and what saved the run: SVG, PNG or PDF by the file's name."""
    from ..campaign.inputs import FIGURE_TITLE
    from ..campaign.report import new_figure

    drawn = new_figure(6.4, 2.6)
    axes = drawn.add_subplot()
    rows = dict(answer.rescues)
    if answer.seeds:
        rows["other seeds"] = [(one.from_s, one.avoided > 0) for one in answer.seeds]
    for row, tries in enumerate(rows.values()):
        for good, mark, colour in ((True, "o", "#3b8f4a"), (False, "x", "#c23b22")):
            times = [at for at, saved in tries if saved == good]
            axes.plot(
                times,
                [row] * len(times),
                mark,
                color=colour,
                label=("avoids it" if good else "does not") if row == 0 else None,
            )
    for one in answer.seeds:
        at = (one.from_s, len(rows) - 1)
        text = f"{one.avoided}/{one.tried}"
        axes.annotate(text, at, (0, 5), textcoords="offset points", fontsize=7, ha="center")
    axes.axvline(answer.failed_s, color="#1d2330", linewidth=1)
    axes.text(answer.failed_s, len(rows) - 0.4, " failed", fontsize=8)
    axes.set_yticks(range(len(rows)), list(rows))
    axes.set_ylim(-0.6, len(rows) - 0.1)
    axes.set_xlabel("from this moment on (s)")
    axes.legend(frameon=False, loc="lower left", ncols=2)
    kind = Path(file).suffix[1:]
    with replacing(file) as part:
        metadata = {"Title": FIGURE_TITLE, **({"Date": None} if kind == "svg" else {})}
        drawn.savefig(part, format=kind, metadata=metadata)
