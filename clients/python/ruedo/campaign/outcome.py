"""The outcome of a case: verdict and other faults, in one status."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

_STARVED = ("MemoryError", "bad_alloc", "OutOfMemoryError", "Cannot allocate memory")
_MOST_REASON = 500  # characters


@dataclass
class Outcome:
    """The outcome of a case.

    status: passed, failed (an expectation), not judged (an expectation could not be judged),
    crashed, timeout or memory (the controller), or invalid (the case cannot be run). what: which
    expectation, or what went wrong. reason: in a line; of what has passed, the evidence. log: its
    content.
    """

    status: str = "passed"
    what: str = ""
    reason: str = ""
    time_s: float = 0.0
    metrics: dict[str, float] = field(default_factory=dict)
    track: list[list[float]] = field(default_factory=list)
    state_hash: str = ""
    output: str = ""
    log: bytes = b""

    def fail(self, status: str, what: str, reason: str) -> None:
        """The first thing that went wrong is what stays."""
        if self.status == "passed":
            self.status, self.what, self.reason = status, what, in_a_line(reason)

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)

    def take(self, verdict: dict[str, Any], memory_mb: int) -> None:
        """A verdict, as of `ruedo regress --json`. output is there before. memory_mb: the limit."""
        for failure in verdict["failures"]:
            self._take_failure(failure, memory_mb)
        if self.status == "passed":
            texts = [of_controller(one["text"]) for one in verdict["evidence"]]
            self.reason = in_a_line("; ".join(texts))
        self.metrics.update(
            {name: value for name, value in verdict["metrics"].items() if value is not None}
        )
        self.track = [[round(value, 4) for value in place] for place in verdict["track"]]

    def _take_failure(self, failure: dict[str, Any], memory_mb: int) -> None:
        what, at = failure["what"].split(" ")[0], failure["time_s"]
        reason = failure["text"] if at is None else f"{at:.3f} s: {failure['text']}"
        if not failure["judged"]:
            self.fail("not judged", what, reason)
        elif what == "client" and any(word in self.output for word in _STARVED):
            self.fail("memory", "controller", too_large(memory_mb))
        elif what in ("client", "run"):
            self.fail("crashed", "controller", of_controller(reason))
        elif what == "world":
            self.fail("invalid", what, reason)
        else:
            self.fail("failed", what, reason.splitlines()[0])


def in_a_line(text: str) -> str:
    return " ".join(text.split())[:_MOST_REASON]


def of_controller(text: str) -> str:
    """The text with a campaign's word for the client of `ruedo regress`."""
    return text.replace("the client", "the controller")


def too_slow(wall: float) -> str:
    return f"the run took more than {wall:g} s of real time"


def too_large(memory_mb: int) -> str:
    return f"the controller wanted more than {memory_mb} MB of memory"
