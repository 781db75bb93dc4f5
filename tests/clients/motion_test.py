"""The Python client's Motion: what each status makes of it, and its text. No server."""

from ruedo.motion import Motion
from ruedo.samples import MotionStatus


def status(id, state, reason="", progress=0.0, remaining=0.0):
    return MotionStatus(0, id, "advance", state, reason, progress, remaining, 0.0, 0.0)


def motion():
    return Motion(None, "p3at", 7, "advance", 2.0)


def test_its_text_has_the_progress_and_the_reason():
    m = motion()
    assert repr(m) == "<Motion advance of p3at: sent, 0.000 done, 2.000 remain>"
    m._update(status(7, "running", "", 0.5, 1.5))
    assert repr(m) == "<Motion advance of p3at: running, 0.500 done, 1.500 remain>"
    m._update(status(7, "ended", "blocked", 0.75, 1.25))
    assert repr(m) == "<Motion advance of p3at: ended (blocked), 0.750 done, 1.250 remain>"


def test_a_refused_command_leaves_what_runs():
    m = motion()
    m._update(status(7, "running", "", 0.5, 1.5))
    m._update(status(8, "refused", "bad value"))
    m._update(status(0, "refused", "not finite"))
    assert m.state == "running" and not m.done
    m._update(status(8, "running"))  # its own end was lost
    assert (m.state, m.reason) == ("ended", "replaced")


def test_the_blocking_body_is_reported():
    m = motion()
    m._update(status(7, "running", "", 0.5, 1.5), "wall/link")
    assert m.blocked_by == ""
    m._update(status(7, "ended", "blocked", 0.75, 1.25), "wall/link")
    assert m.blocked_by == "wall/link"
    assert (
        repr(m)
        == "<Motion advance of p3at: ended (blocked by wall/link), 0.750 done, 1.250 remain>"
    )
