"""The searches that propose cases: Optuna, after the corners of the space; Hypothesis, by its own
draws; or chance, for comparison.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

from ..campaign.errors import missing
from .space import Choices, Space

Evaluate = Callable[[list[Choices]], list[tuple[dict[str, Any], float]]]
Hit = tuple[Choices, dict[str, Any]]
_BATCH = 8  # proposals at a time: fixed, so that more workers change nothing


def breaks(outcome: dict[str, Any]) -> bool:
    """Whether a case fails; one that cannot be run does not count."""
    return outcome["status"] not in ("passed", "invalid")


def corners(space: Space, seed: int) -> list[Choices]:
    """The neutral case; each dimension at each of its ends, alone; an obstacle with each fault;
    then all of them at ends that are drawn.
    """
    neutral = space.neutral()
    made = [neutral]
    for one in space.dimensions:
        if one.alone:
            made += [{**neutral, one.name: corner} for corner in one.corners()]
    if space.obstacles:  # something in the way: alone, and with each fault from the beginning on
        blocked = {**neutral, "obstacle0": True}
        made += [blocked, *({**blocked, "fault": str(i)} for i in range(len(space.faults)))]
    draw = random.Random(seed)
    first, rest = made[:1], made[1:]
    rest.sort(key=lambda _: draw.random())
    several = [
        {
            one.name: one.corners()[int(draw.random() * len(one.corners()))]
            if draw.random() < 0.5
            else one.at(draw.random())
            for one in space.dimensions
        }
        for _ in range(_BATCH)
    ]
    unique: list[Choices] = []
    for case in first + rest + several:
        if case not in unique:
            unique.append(case)
    return unique


def by_optuna(space: Space, evaluate: Evaluate, cases: int, seed: int) -> Hit | None:
    """TPE minimises the score."""
    try:
        import optuna
    except ImportError:
        raise missing("Optuna", "hunt") from None
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed, n_startup_trials=16))
    for case in corners(space, seed)[: max(1, cases // 2)]:
        study.enqueue_trial(case)
    left = cases
    while left > 0:
        trials = [study.ask() for _ in range(min(_BATCH, left))]
        proposals = [
            {one.name: _suggest(trial, one) for one in space.dimensions} for trial in trials
        ]
        results = evaluate(proposals)
        for trial, choices, (outcome, score) in zip(trials, proposals, results):
            if breaks(outcome):
                return choices, outcome
            study.tell(trial, score if outcome["status"] == "passed" else 1.0)
        left -= len(trials)
    return None


def _suggest(trial: Any, one: Any) -> Any:
    if one.options:
        return trial.suggest_categorical(one.name, list(one.options))
    if one.whole:
        return trial.suggest_int(one.name, int(one.low), int(one.high))
    return trial.suggest_float(one.name, one.low, one.high, log=one.log)


def by_hypothesis(space: Space, evaluate: Evaluate, cases: int, seed: int) -> Hit | None:
    """Hypothesis prefers ends and simple numbers, climbs by target(), and shrinks its finding."""
    try:
        import hypothesis
        from hypothesis import strategies as st
    except ImportError:
        raise missing("Hypothesis", "hunt") from None

    def strategy(one: Any) -> Any:
        if one.options:
            return st.sampled_from(one.options)
        return (
            st.integers(int(one.low), int(one.high))
            if one.whole
            else st.floats(one.low, one.high, allow_nan=False)
        )

    hits: dict[str, Hit] = {}
    left = cases

    def fails(choices: Choices) -> bool:
        nonlocal left
        if repr(choices) not in hits:  # a known failure needs no second run
            if left <= 0:
                return False
            left -= 1
            ((outcome, score),) = evaluate([choices])
            hypothesis.target(-score)
            if not breaks(outcome):
                return False
            hits[repr(choices)] = (choices, outcome)
        return True

    settings = hypothesis.settings(
        max_examples=cases,
        database=None,
        deadline=None,
        derandomize=False,
        phases=[hypothesis.Phase.generate, hypothesis.Phase.target],
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    try:
        smallest = hypothesis.find(
            st.fixed_dictionaries({one.name: strategy(one) for one in space.dimensions}),
            fails,
            settings=settings,
            random=random.Random(seed),
        )
    except hypothesis.errors.NoSuchExample:
        return None
    return hits[repr(smallest)]


def by_random(space: Space, evaluate: Evaluate, cases: int, seed: int) -> Hit | None:
    """Uniform draws, the baseline of the others."""
    draw = random.Random(seed)
    for begin in range(0, cases, _BATCH):
        proposals = [
            {one.name: one.at(draw.random()) for one in space.dimensions}
            for _ in range(min(_BATCH, cases - begin))
        ]
        for choices, (outcome, _) in zip(proposals, evaluate(proposals)):
            if breaks(outcome):
                return choices, outcome
    return None


SEARCHES: dict[str, Callable[[Space, Evaluate, int, int], Hit | None]] = {
    "optuna": by_optuna,
    "hypothesis": by_hypothesis,
    "random": by_random,
}
