"""Lockstep over the wire, each client behind a network that loses, doubles and reorders; and its
errors.
"""

import contextlib
import subprocess
import sys
import time
import zlib
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from urllib.parse import urlsplit

import lcm
import pytest
from conftest import HERE, PATIENCE, PROBES, RUEDO, SOURCE, free_url, probe, ruedo_run
from docs_code import blocks
from ruedo.lcmtypes import applied_t, request_t

HALL = str(HERE / "hall.sdf")
STEPS = 300  # of 5 ms


@contextmanager
def bad_network(server_url, clients, loss, first_of=None):
    """URLs, one for each client, from which the server is reached with losses. first_of: each
    client's first request of this kind is lost.
    """
    urls = [free_url() for _ in range(clients)]
    ports = ",".join(str(urlsplit(url).port) for url in urls)
    relay = subprocess.Popen(
        [
            sys.executable,
            str(HERE / "peers/lossy_relay.py"),
            str(urlsplit(server_url).port),
            ports,
            str(loss),
            "0.1",
            "0.1",
            "4",
            *([str(first_of)] if first_of is not None else []),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert relay.stdout.readline() == "ready\n"
        yield urls
    finally:
        relay.kill()
        relay.wait()


def run(languages, loss):
    """What each client saw at its end: step, hash, messages, poses, digest. Both drive the same
    robot.
    """
    with ruedo_run(
        "--lockstep",
        str(len(languages)),
        "--lease",
        str(PATIENCE),
        "--disable",
        "p3at/camera",
        world=HALL,
    ) as server:
        with bad_network(server.url, len(languages), loss) as urls, ThreadPoolExecutor() as pool:
            said = list(
                pool.map(
                    lambda i: probe(
                        languages[i],
                        urls[i],
                        "lockstep",
                        f"client{i}",
                        "p3at",
                        str(STEPS),
                        str((1, 6, 15)[i]),
                        str(0.2 + 0.1 * i),
                    ),
                    range(len(languages)),
                )
            )
    for one in said:
        assert one.words("begin") == ["0", "0.000000"]
        assert one.words("odometry")[0] == "1500000"
    return [one.words("end") for one in said]


def test_the_same_whatever_is_lost():
    languages = sorted(PROBES)
    good = run(languages, 0.0)
    step, _state_hash, _messages, poses, _digest = good[0]
    assert (step, poses) == (str(STEPS), "76")  # 50 Hz, from 0 to 1.5 s
    assert all(end == good[0] for end in good)
    for loss in (0.1, 0.3):
        assert run(languages, loss) == good, loss


def test_a_guest_comes_and_goes_whatever_is_lost():
    """In the three languages, two of them behind a network that loses every fifth datagram."""
    ends = []
    for language in sorted(PROBES):
        with ruedo_run(
            "--lockstep", "1", "--lease", str(PATIENCE), "--disable", "p3at/camera", world=HALL
        ) as server:
            with bad_network(server.url, 1, 0.0 if language == "cpp" else 0.2) as [url]:
                said = probe(language, url, "visited", "client", "p3at")
        assert said.one("guest") == "p3at_2"
        ends.append(said.words("end"))
    assert all(end == ends[0] for end in ends), ends
    step, _, _, of_guest, _ = ends[0]
    assert step == "90" and int(of_guest) > 20


def test_messages_are_those_of_the_robots_that_were_there(language):
    """While one client waits for the end of a long step, robots come, go, and take others'
    places.
    """
    import ruedo

    with (
        ruedo_run("--lockstep", "2", "--disable", "p3at/camera", world=HALL) as server,
        ThreadPoolExecutor() as pool,
        ruedo.connect(server.url, name="director", timeout=PATIENCE) as sim,
    ):
        waits = pool.submit(probe, language, server.url, "watches", "watcher", "80")
        sim.step(0, timeout=PATIENCE)
        seen = []
        for change in (
            lambda: sim.spawn("p3at", 3.0, 1.0, name="guest"),
            lambda: sim.remove("guest"),
            lambda: sim.spawn("p3at", 3.0, 1.0, name="other"),
            lambda: sim.remove("p3at"),
        ):
            change()
            seen.append(sim.step(20, timeout=PATIENCE))
        said = waits.result()
    robots = [{m.channel.split("/")[0] for m in part.messages} - {"ruedo"} for part in seen]
    assert robots == [{"p3at", "guest"}, {"p3at"}, {"p3at", "other"}, {"other"}]
    messages, digest = [m for part in seen for m in part.messages], 0
    for message in messages:
        digest = zlib.crc32(message.data, zlib.crc32(message.channel.encode(), digest))
    assert said.words("end") == [
        str(word) for word in (80, seen[-1].state_hash, len(messages), digest)
    ]


def test_a_later_viewer_sees_the_current_state(language, tmp_path):
    """Joining a run that is under way, and one that begins with a snapshot."""
    import ruedo

    options = ("--disable", "p3at/camera", "--snapshots", str(tmp_path))
    with (
        ruedo_run("--lockstep", "1", *options, world=HALL) as server,
        ThreadPoolExecutor() as pool,
        ruedo.connect(server.url, timeout=PATIENCE) as sim,
    ):
        states = [sim.step(100, timeout=PATIENCE)]
        sim.snapshot("here")
        watches = pool.submit(probe, language, server.url, "watches", "watcher", "2")
        while not watches.done():
            states.append(sim.step(1, timeout=PATIENCE))
    stood = [[str(s.step), f"{s.time:.6f}", str(s.state_hash)] for s in states]
    assert watches.result().words("begin") in stood
    with ruedo_run(
        *("--lockstep", "1", "--restore", str(tmp_path / "here.snapshot"), *options), world=HALL
    ) as server:
        said = probe(language, server.url, "watches", "watcher", "2")
    assert said.words("begin") == stood[0]


def test_commands_ahead_go_with_their_robot(tmp_path):
    """They neither drive the next one in its place, nor are in the log, which is repeated."""
    import ruedo

    log = str(tmp_path / "run.lcm")
    with (
        ruedo_run(
            *("--lockstep", "2", "--disable", "p3at/camera", "--record", log), world=HALL
        ) as server,
        ThreadPoolExecutor() as pool,
        ruedo.connect(server.url, name="driver", timeout=PATIENCE) as driver,
        ruedo.connect(server.url, name="director", timeout=PATIENCE) as director,
    ):
        robot = driver.robot("p3at")
        ahead = [robot.velocity_command(0.5, 0.0).at(k) for k in range(50, 350, 20)]
        drives = pool.submit(driver.step, 400, ahead, timeout=PATIENCE)
        director.step(10, timeout=PATIENCE)
        director.remove("p3at")
        director.spawn("p3at", 3.0, 1.0, name="guest")
        director.step(390, timeout=PATIENCE)
        drives.result()
        assert director.state("guest").position[0] == pytest.approx(3.0, abs=0.01)
        server.end()
    applied = [applied_t.decode(e.data) for e in lcm.EventLog(log) if e.channel == "ruedo/applied"]
    assert {one.channel for one in applied} == {"ruedo/request"}
    assert subprocess.run([RUEDO, "verify", log], timeout=PATIENCE).returncode == 0


@pytest.mark.parametrize("visit", ["visited", "leaves"])
def test_a_leaving_client_is_not_waited_for_despite_losses(visit, language, tmp_path):
    """The LEAVE is lost, once, at the end or in a callback. The lease is longer than the test, in
    which another client goes on.
    """
    import ruedo

    log = str(tmp_path / "run.lcm")
    with ruedo_run(
        *("--lockstep", "1", "--lease", str(PATIENCE), "--disable", "p3at/camera"),
        *("--record", log),
        world=HALL,
    ) as server:
        with bad_network(server.url, 1, 0.0, request_t.LEAVE) as [url]:
            probe(language, url, visit, "client", "p3at")
            with ruedo.connect(server.url, name="next", timeout=PATIENCE) as sim:
                sim.step(1, timeout=0.5 * PATIENCE)
        server.end()
    applied = [applied_t.decode(e.data) for e in lcm.EventLog(log) if e.channel == "ruedo/applied"]
    joined = [one.kind for one in applied if one.kind in (request_t.JOIN, request_t.LEAVE)]
    assert sorted(joined) == 2 * [request_t.JOIN] + 2 * [request_t.LEAVE]


def in_one_step(language, *command):
    with ruedo_run("--lockstep", "1", "--disable", "p3at/camera", world=HALL) as server:
        return probe(language, server.url, *command)


def test_commands_of_no_step_are_refused_and_do_nothing(language):
    """They would act at whatever step the run has reached when they come."""
    runs = [in_one_step(language, "beside", "one", "p3at") for _ in range(3)]
    for said in runs:
        for what in ("before", "velocity", "wheels", "advance", "rotate", "turn_to", "arc", "stop"):
            error = said.one(what).replace("C", "_c").lower()  # Java's velocityCommand
            call = {"before": "velocity", "velocity": "velocity", "wheels": "wheel"}.get(
                what, "move"
            )
            assert error.startswith("notsupported: in lockstep "), error
            assert "sim.step(n, " in error and f"robot.{call}_command(" in error, error
        for name in ("advance", "rotate", "heading", "arc", "stop"):
            assert name in said.one("turn_to" if name == "heading" else name)
    step, state_hash, _messages, _digest = in_one_step(language, "watches", "one", "200").words(
        "end"
    )
    assert all(said.words("end")[:2] == [step, state_hash] for said in runs)


@pytest.mark.parametrize(
    "joints, wrong",
    [(["turret_joint", "hand_jiont"], "hand_jiont"), (["turret_joint", "hand_joint"], None)],
)
def test_a_misspelt_joint_refuses_its_step(language, joints, wrong):
    with ruedo_run("--lockstep", "1", "--spawn", "carrier:c@0,0", world="empty") as server:
        said = probe(language, server.url, "joints", "one", "c", *joints)
    if wrong:
        assert said.one("joints") == (
            "RequestError: GRANT: command 0 (c/joint_command): c has no joint 'hand_jiont' "
            "that takes commands; it has turret_joint, upper_arm_joint, forearm_joint, hand_joint, "
            "left_finger_joint, right_finger_joint"
        )
    else:
        assert said.one("joints") == "none"
    assert said.words("then") == ["1" if wrong else "2"]


def test_commands_beside_the_steps_are_refused(language):
    with ruedo_run("--lockstep", "1", "--disable", "p3at/camera", world=HALL) as server:
        said = probe(language, server.url, "lockstep", "one", "p3at", "4", "2", "0.3")
    assert said.words("end")[0] == "4"
    assert said.one("past").startswith(
        "ValueError: a command is for 1 steps on; of 1 steps 0 to 0 is allowed"
    )


def test_a_step_that_was_given_up_holds_up_no_other(language):
    """More than a client acknowledges together are under way when the next step is asked for."""
    with ruedo_run("--lockstep", "1", "--disable", "p3at/camera", world=HALL) as server:
        said = probe(language, server.url, "given_up", "one")
    # "no": the client did not run (no processor) until the steps were done.
    assert said.one("given_up") in ("Timeout", "no")
    assert said.words("then") == ["2001", "2002"]


def test_without_lockstep_there_are_no_commands():
    import ruedo

    with (
        ruedo_run("--paused", world=HALL) as server,
        ruedo.connect(server.url, timeout=PATIENCE) as sim,
    ):
        assert not sim.lockstep
        with pytest.raises(ruedo.NotSupported, match="--lockstep N"):
            sim.step(1, [sim.robot("p3at").velocity_command(0.1, 0.0)])
        seen = sim.step(3)
        assert (seen.step, seen.messages) == (3, [])


def times_out(sim, steps, says):
    """Those steps are granted and do not come; sooner or later it is known why."""
    import ruedo

    deadline = time.monotonic() + PATIENCE
    while True:
        with pytest.raises(ruedo.Timeout) as told:
            sim.step(steps, timeout=0.5)
        if says in str(told.value):
            return
        assert time.monotonic() < deadline, told.value
        if str(told.value).startswith("step "):  # else it does not take part yet, and granted none
            steps = 0


def test_waiting_reports_the_missing_client():
    import ruedo

    with (
        ruedo_run("--lockstep", "2", world=HALL) as server,
        ruedo.connect(server.url, name="first", timeout=PATIENCE) as sim,
    ):
        times_out(sim, 1, "the run waits for 1 more of 2 clients")
        with ruedo.connect(server.url, name="second", timeout=PATIENCE) as other:
            times_out(other, 5, "the run waits for 'first'")
            assert (
                sim.step(2, timeout=PATIENCE).step == 3
            )  # continues after the timeout: the step granted then, and two more
            assert sim.step(0).step == 3


def step_after_a_lost_lease(lease):
    """Of a client that takes part anew, after 5 and 2 more; None: it lost that lease, too."""
    import ruedo

    policy = ("--lease", str(lease), "--lease-policy", "drop")
    with (
        ruedo_run("--lockstep", "1", *policy, world=HALL) as server,
        ruedo.connect(server.url, timeout=PATIENCE) as sim,
    ):
        sim.step(5)
        while "nothing was heard from" not in server.process.stdout.readline():
            assert server.process.poll() is None
        with pytest.raises(ruedo.LeaseLost):
            sim.step(1)
        with contextlib.suppress(ruedo.LeaseLost):
            return sim.step(2).step
    return None


def test_a_lost_lease():
    """By policy drop; the client takes part anew. And by policy fail, with the exit code."""
    import ruedo

    for lease in (2, 20):  # a client that does not run for longer loses it again
        last = step_after_a_lost_lease(lease)
        if last is not None:
            break
    assert last == 7
    server = ruedo_run("--lockstep", "1", "--lease", "2", "--lease-policy", "fail", world=HALL)
    with ruedo.connect(server.url, timeout=PATIENCE) as sim:
        sim.step(5)
        assert server.process.wait(PATIENCE) == 1
    assert "nothing was heard from" in server.end()


def test_the_run_ends_when_all_have_everything():
    import ruedo

    with (
        ruedo_run("--lockstep", "1", "--duration", "0.1", world=HALL) as server,
        ruedo.connect(server.url, timeout=PATIENCE) as sim,
    ):
        assert sim.step(15).step == 15
        with pytest.raises(ruedo.NoServer, match="ended at step 20"):
            sim.step(10, timeout=PATIENCE)
        assert server.process.wait(PATIENCE) == 0


def test_a_reset_equals_a_fresh_run():
    import ruedo

    with (
        ruedo_run("--lockstep", "1", world=HALL) as server,
        ruedo.connect(server.url, timeout=PATIENCE) as sim,
    ):
        robot = sim.robot("p3at")
        first = [sim.step(1, [robot.velocity_command(0.3, 0.2)]).state_hash for _ in range(30)]
        sim.reset()
        again = [sim.step(1, [robot.velocity_command(0.3, 0.2)]).state_hash for _ in range(30)]
        assert again == first and len(set(first)) == 30


def test_the_program_of_the_docs():
    source = blocks("clients.md")["lockstep_python"]
    said = [
        subprocess.run(
            [sys.executable, "-c", source],
            cwd=SOURCE,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
        for _ in range(2)
    ]
    assert said[0].stdout.startswith("400 "), said[0].stderr  # 2 s of 5 ms
    assert said[0].stdout == said[1].stdout


def test_calls_before_the_first_step_are_answered():
    import ruedo

    with (
        ruedo_run("--lockstep", "1", "--disable", "p3at/camera", world=HALL) as server,
        ruedo.connect(server.url, timeout=PATIENCE) as sim,
    ):
        for call in (
            lambda: sim.set_pose("p3at", 0.0, 1.0),
            lambda: sim.state("p3at"),
            sim.pause,
            lambda: sim.spawn("p3at", 2.0, 1.0),
            sim.reset,
        ):
            with pytest.raises(ruedo.RequestError, match=r"lockstep has not begun: call step\(0\)"):
                call()
        sim.step(0)
        sim.set_pose("p3at", 0.0, 1.0)
        assert sim.state("p3at").position[1] == pytest.approx(1.0, abs=1e-6)
        assert sim.step(2).step == 2
        sim.quit()


def test_a_waiting_call_reports_a_pause_in_lockstep():
    import ruedo

    with (
        ruedo_run("--lockstep", "1", "--disable", "p3at/camera", world=HALL) as server,
        ruedo.connect(server.url, timeout=PATIENCE) as sim,
    ):
        sim.step(1)
        sim.pause()
        times_out(sim, 1, "the run waits for a RESUME: it is paused")
        sim.resume()
        assert sim.step(1).step == 3
