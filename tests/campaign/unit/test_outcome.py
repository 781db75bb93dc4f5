"""What comes of a case by its verdict; without a run."""

import pytest
from ruedo.campaign.outcome import Outcome, in_a_line, of_controller, too_large, too_slow


def verdict(*failures, evidence=(), metrics=None, track=()):
    return {
        "failures": list(failures),
        "evidence": [{"what": "run", "text": text} for text in evidence],
        "metrics": metrics or {},
        "track": track,
    }


def failure(what, text="why", *, judged=True, time_s=None):
    return {"what": what, "text": text, "judged": judged, "time_s": time_s}


def taken(*failures, output="", **options):
    outcome = Outcome(output=output)
    outcome.take(verdict(*failures, **options), 100)
    return outcome.status, outcome.what, outcome.reason


def test_it_has_passed_on_evidence():
    told = taken(evidence=["12 steps", "the client ended with 0 at 3 s"])
    assert told == ("passed", "", "12 steps; the controller ended with 0 at 3 s")


@pytest.mark.parametrize(
    ("one", "expected"),
    [
        (failure("goal 0", "late", time_s=12.3456), ("failed", "goal", "12.346 s: late")),
        (failure("clearance", "too near\nand more"), ("failed", "clearance", "too near")),
        (failure("golden", "the run differs:\n  a"), ("failed", "golden", "the run differs:")),
        (failure("requests"), ("failed", "requests", "why")),
        (failure("script"), ("failed", "script", "why")),
        (failure("yaw"), ("failed", "yaw", "why")),
        (failure("world", "no mesh"), ("invalid", "world", "no mesh")),
        (
            failure("client", "the client ended with exit code 1"),
            ("crashed", "controller", "the controller ended with exit code 1"),
        ),
        (failure("run", "it stands\nstill"), ("crashed", "controller", "it stands still")),
        (failure("client", "never heard", judged=False), ("not judged", "client", "never heard")),
        (failure("run", "no step", judged=False), ("not judged", "run", "no step")),
        (
            failure("odometry", "no sample", judged=False, time_s=0.0),
            ("not judged", "odometry", "0.000 s: no sample"),
        ),
    ],
)
def test_a_failure_is_a_status(one, expected):
    assert taken(one, evidence=["12 steps"]) == expected


def test_a_memory_error_in_the_output_hides_no_failed_expectation():
    assert taken(failure("clearance"), output="MemoryError") == ("failed", "clearance", "why")


@pytest.mark.parametrize(
    "word", ["MemoryError", "bad_alloc", "OutOfMemoryError", "Cannot allocate memory"]
)
def test_a_client_out_of_memory_does_not_count_as_crashed(word):
    told = "the controller wanted more than 100 MB of memory"
    assert taken(failure("client"), output=f"x {word} y") == ("memory", "controller", told)
    assert taken(failure("run"), output=word)[0] == "crashed"
    assert taken(failure("client", judged=False), output=word)[0] == "not judged"
    assert taken(failure("contact"), output=word)[0] == "failed"


def test_the_first_failure_stays():
    outcome = Outcome()
    outcome.fail("timeout", "controller", "slow")
    outcome.take(verdict(failure("contact"), evidence=["12 steps"]), 100)
    assert (outcome.status, outcome.what, outcome.reason) == ("timeout", "controller", "slow")
    assert taken(failure("contact", "a"), failure("clearance", "b"))[1:] == ("contact", "a")


def test_metrics_that_are_there_and_the_track_are_kept():
    outcome = Outcome(metrics={"own": 1.0})
    track = [[0.0, 1.00004, -2.00006]]
    outcome.take(verdict(metrics={"x_m": 0.0, "goal_distance_m": None}, track=track), 100)
    assert outcome.metrics == {"own": 1.0, "x_m": 0.0}
    assert outcome.track == [[0.0, 1.0, -2.0001]]


def test_it_begins_as_passed_and_empty():
    assert Outcome().as_dict() == {
        "status": "passed",
        "what": "",
        "reason": "",
        "time_s": 0.0,
        "metrics": {},
        "track": [],
        "state_hash": "",
        "output": "",
        "log": b"",
    }


def test_texts_of_outcomes():
    assert in_a_line(" a\n b\t c ") == "a b c"
    assert in_a_line("x" * 501) == "x" * 500
    assert of_controller("the client of the client") == "the controller of the controller"
    assert too_slow(2.5) == "the run took more than 2.5 s of real time"
    assert too_large(7) == "the controller wanted more than 7 MB of memory"
