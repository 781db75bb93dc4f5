"""Campaigns that are run, interrupted and resumed: the same table, whatever ran where and when."""

import contextlib
import fcntl
import html
import json
import os
import pty
import re
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import termios
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from conftest import (
    CAMPAIGN,
    CONTROLLER,
    PATIENCE,
    RUEDO,
    SOURCE,
    results_in,
    ruedo,
    table,
    wait_for,
)
from ruedo.campaign import Campaign
from ruedo.campaign.compare import compare_with
from ruedo.hunt.why import Answer, plot


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A folder in which the campaign was run by two workers, and its table."""
    from conftest import WORLD

    folder = tmp_path_factory.mktemp("whole")
    for name, text in (("world.py", WORLD), ("controller.py", CONTROLLER), ("c.yaml", CAMPAIGN)):
        (folder / name).write_text(text)
    ruedo("campaign", "run", "c.yaml", "--workers", "2", folder=folder, code=1)
    return folder, table(folder)


def test_those_cases_fail_that_must(whole):
    folder, _ = whole
    frame = Campaign(folder / "c.yaml").results().frame()
    assert len(frame) == 8
    assert list(frame.passed) == [
        not (bold and distance < 2) for bold, distance in zip(frame.bold, frame.distance)
    ]
    assert set(frame[~frame.passed].what) == {"contact"}
    assert (
        0.9 / 0.5 < float(frame.reason[2].split()[0]) < 3.0
    )  # its front is 0.9 m from the wall, its speed 0.5 m/s at most


def test_one_worker_gives_the_same_bytes(whole):
    folder, expected = whole
    ruedo("campaign", "run", "c.yaml", "--workers", "1", "--out", "one", folder=folder, code=1)
    assert table(folder, "--out", "one") == expected


def test_shards_joined_give_the_same_bytes(whole):
    folder, expected = whole
    for i in (3, 1, 2):
        ruedo(
            "campaign",
            "run",
            "c.yaml",
            "--shard",
            f"{i}/3",
            "--out",
            f"shard{i}",
            folder=folder,
            code=SHARD_CODES[i],
        )
    done = ruedo(
        "campaign", "join", "c.yaml", "--out", "joined", "shard1", "shard2", "shard3", folder=folder
    )
    assert "took over 8 results" in done.stdout
    assert table(folder, "--out", "joined") == expected


SHARD_CODES = {1: 1, 2: 0, 3: 1}


def children(pid):
    return [int(one) for one in open(f"/proc/{pid}/task/{pid}/children").read().split()]


def test_kills_of_the_driver_and_of_workers_cost_the_runs_under_way_alone(whole):
    folder, expected = whole
    out = folder / "killed"
    command = [RUEDO, "campaign", "run", "c.yaml", "--workers", "1", "--out", str(out)]
    held = {**os.environ, "HOLD": str(folder / "c.yaml")}
    driver = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, env=held)
    wait_for(lambda: results_in(out) >= 2)
    os.kill(driver.pid, signal.SIGKILL)
    driver.wait()
    before = results_in(out)
    assert before == 2
    driver = subprocess.Popen(
        [*command[:2], "resume", *command[3:]], cwd=folder, stdout=subprocess.DEVNULL
    )
    wait_for(lambda: results_in(out) > before)
    with contextlib.suppress(IndexError, ProcessLookupError):  # on a fast machine it is done now
        os.kill(children(driver.pid)[0], signal.SIGKILL)
    assert driver.wait(PATIENCE) == 1
    assert table(folder, "--out", str(out)) == expected


def test_nothing_runs_twice_and_a_changed_controller_runs_again(folder):
    campaign = Campaign(folder / "c.yaml")
    ran = []
    campaign.run(workers=1, progress=lambda case, _: ran.append(case.number))
    assert ran == list(range(8))
    Campaign(folder / "c.yaml").run(workers=1, progress=lambda case, _: ran.append(case.number))
    assert len(ran) == 8
    (folder / "controller.py").write_text(CONTROLLER.replace("0.6", "0.7"))
    Campaign(folder / "c.yaml").run(workers=1, progress=lambda case, _: ran.append(case.number))
    assert len(ran) == 16


def ids(folder, file="c.yaml"):
    return [case.id for case in Campaign(folder / file).cases]


def test_files_beside_a_controller_count_as_inputs(folder):
    """Every file, but for what Ruedo itself writes there."""
    before = ids(folder)
    ruedo("campaign", "export", "c.yaml", "-o", "table.csv", folder=folder)
    ruedo("campaign", "export", "c.yaml", "-o", "results.xml", folder=folder)
    for name in ("report.html", "case0.lcm", "controller.pyc"):
        (folder / name).touch()
    for name in ("why.svg", "why.png", "why.pdf"):
        plot(Answer(1.0, "it failed", {"stop": [(0.5, True)]}), str(folder / name))
    (folder / "other.yaml").write_text(CAMPAIGN.replace("seeds: 2", "seeds: 3"))
    (folder / ".hidden").mkdir()
    for name in (".hidden/a.py", ".a.py", "other.campaign/worlds/a.json"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("")
    shutil.copytree(folder / "c.campaign", folder / "taken")
    assert ids(folder) == before
    for name in (
        "lib.py",
        "deep/er/way.txt",
        "way.csv",
        "tree.xml",
        "weights.bin",
        "map.png",
        "map.svg",
        "map.pdf",
        "bare.pyc",
        "gains",
    ):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("1")
        one = ids(folder)
        (folder / name).write_text("2")
        assert not set(before) & set(one) and not set(one) & set(ids(folder)), name
        (folder / name).unlink()
    assert ids(folder) == before


def test_files_that_a_controller_writes_are_not_inputs(folder):
    (folder / "controller.py").write_text(
        CONTROLLER + "\n\nwith open(__file__ + '.log', 'a') as log:\n    log.write('loaded')\n"
    )
    done = ruedo("campaign", "run", "c.yaml", folder=folder, code=1)
    assert "8 of 8 cases" in done.stdout, done
    assert "written while the cases ran: controller.py.log; that counts as no input" in done.stderr
    for code, word in enumerate(("status", "run")):
        done = ruedo("campaign", word, "c.yaml", folder=folder, code=code)
        assert "8 of 8 cases" in done.stdout and not done.stderr, done


def test_the_reason_why_results_are_outdated_is_printed(folder):
    """A picture that lies beside the controller may be read by it."""
    campaign = Campaign(folder / "c.yaml", out=folder / "other.campaign")
    assert campaign.changes() == []
    campaign.run(workers=1, stop=lambda: True)
    (folder / "map.png").touch()
    (folder / "deep").mkdir()
    (folder / "deep/a.txt").touch()
    assert Campaign(folder / "c.yaml", out=folder / "other.campaign").changes() == [
        "deep/a.txt",
        "map.png",
    ]
    for words in (["run", "c.yaml", "--shard", "1/8"], ["status", "c.yaml"]):
        said = ruedo("campaign", *words, "--out", "other.campaign", folder=folder).stderr
        assert ("last run: deep/a.txt, map.png; the cases" in said) == (words[0] == "run")
    (folder / "map.png").unlink()
    said = ruedo("campaign", "report", "c.yaml", "--out", "other.campaign", folder=folder).stderr
    assert "last run: map.png; the cases" in said


@pytest.mark.parametrize(
    "count, size, says", [(2001, 0, "2000 files"), (1, (256 << 20) + 1, "256 MB")]
)
def test_a_folder_that_is_too_large_is_reported(folder, count, size, says):
    (folder / "data").mkdir()
    for i in range(count):
        with (folder / f"data/{i}.npy").open("wb") as file:
            file.truncate(size)
    said = ruedo("campaign", "run", "c.yaml", folder=folder, code=3).stderr
    assert said.count("\n") == 1 and "c.yaml:6: " in said and "in `files`" in said and says in said
    text = CAMPAIGN.replace("name: ahead,", "name: ahead, files: [world.py],")
    (folder / "c.yaml").write_text(text)
    assert len(ids(folder)) == 8


def test_of_students_the_one_that_changed_is_run_again(tmp_path):
    (tmp_path / "students").mkdir()
    for name in ("a", "b"):
        (tmp_path / f"students/{name}.py").write_text("def drive(view):\n    return 0.0, 0.0\n")
    (tmp_path / "c.yaml").write_text(
        "worlds: [empty]\nrobots: ['p3at@0,0']\nlimits: {duration: 1}\n"
        "controllers: [{name: s, each: 'students/*.py', python: '{file}:drive'}]\n"
        "metrics: [{name: m, python: 'metrics.py:measure'}]\n"
    )
    (tmp_path / "metrics.py").write_text("def measure(log):\n    return 1.0\n")
    a, b = ids(tmp_path)
    (tmp_path / "students/b.py").write_text("def drive(view):\n    return 0.1, 0.0\n")
    assert ids(tmp_path)[0] == a and ids(tmp_path)[1] != b
    made = Campaign(tmp_path / "c.yaml")
    again = Campaign(made.content, folder=tmp_path)
    assert [case.id for case in again.cases] == [case.id for case in made.cases]


ROBOT = """<sdf version='1.9'><model name='cart'><link name='base_link'><pose>0 0 0.1 0 0 0</pose>
<collision name='c'><geometry><box><size>0.4 0.4 0.2</size></box></geometry></collision>
<sensor name='imu' type='imu'><update_rate>10</update_rate></sensor></link>
</model></sdf>"""


def test_a_robot_of_the_users_own_is_looked_for_beside_the_file(tmp_path):
    """Regression: it was, where the command was called from there."""
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/cart.sdf").write_text(ROBOT)
    (tmp_path / "stand.py").write_text("def stand(view):\n    return None\n")
    (tmp_path / "c.yaml").write_text(
        "worlds: [empty]\nrobots: ['robots/cart.sdf:guest@1,2']\n"
        "controllers: [{name: stand, python: 'stand.py:stand', no_client_wait: true}]\n"
        "expect: {robot: guest}\nlimits: {duration: 1}\n"
    )
    ruedo("campaign", "run", tmp_path / "c.yaml", folder="/")
    [row] = Campaign(tmp_path / "c.yaml").results().table()
    assert (row["status"], row["robot"]) == ("passed", "robots/cart.sdf:guest@1,2")
    assert (row["x_m"], row["y_m"]) == (pytest.approx(1.0, abs=1e-3), pytest.approx(2.0, abs=1e-3))
    copy = tmp_path / "copy"
    shutil.copytree(tmp_path, copy, ignore=shutil.ignore_patterns("copy", "c.campaign"))
    assert Campaign(copy / "c.yaml").cases[0].id == row["id"]


def test_results_are_read_where_nothing_can_be_written(whole, tmp_path):
    folder, shown = whole
    shutil.copytree(folder, tmp_path / "there")
    command = (
        'mount --bind "$1" "$1" && mount -o remount,ro,bind "$1" && cd "$1" && '
        '"$2" campaign export c.yaml -o "$3" && "$2" campaign report c.yaml -o "$4" --pages 0'
    )
    done = subprocess.run(
        ["unshare", "-rm", "sh", "-c", command, "sh", tmp_path / "there", RUEDO]
        + [tmp_path / "table.csv", tmp_path / "report.html"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done
    assert (tmp_path / "table.csv").read_text() == shown
    assert (tmp_path / "report.html").stat().st_size > 1000


def test_a_second_driver_is_refused(whole):
    folder, _ = whole
    with open(folder / "c.campaign/lock", "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert (
            "is in use by another"
            in ruedo("campaign", "run", "c.yaml", folder=folder, code=4).stderr
        )


KEPT = "; finished cases are kept, `ruedo campaign resume` runs the others"


@pytest.mark.parametrize(
    ("words", "told", "hang", "kept"),
    [
        ("campaign run", "INT", False, KEPT),
        ("campaign run", "TERM", False, KEPT),
        ("campaign run", "HUP", False, KEPT),
        ("campaign run", "INT", True, KEPT),
        ("hunt", "TERM", False, ""),
    ],
)
def test_ending_a_campaign_leaves_nothing_behind(words, told, hang, kept, folder):
    """Neither processes, of its controllers' either, nor folders, whether or not the workers hang;
    finished cases are kept. Or a hunt, which keeps nothing.
    """
    temporary = folder / "temporary"
    temporary.mkdir()
    # In lockstep with a client that never joins: no case ends by itself.
    command = '{name: ahead, command: "sleep 1000 & echo $! > child.$$; wait", lockstep: 1}'
    (folder / "c.yaml").write_text(
        CAMPAIGN.replace('{name: ahead, python: "controller.py:ahead"}', command)
    )
    driver = subprocess.Popen(
        [RUEDO, *words.split(), "c.yaml", "--workers", "2"],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(temporary)},
    )
    wait_for(lambda: sum(f.stat().st_size > 0 for f in folder.glob("child.*")) == 2)
    begun = [int(file.read_text()) for file in folder.glob("child.*")] + children(driver.pid)
    for worker in children(driver.pid) if hang else []:
        os.kill(worker, signal.SIGSTOP)
    driver.send_signal(getattr(signal, f"SIG{told}"))
    said = driver.communicate(timeout=PATIENCE)[1]
    assert driver.returncode == 4 and said.endswith(f"ruedo: interrupted{kept}\n")
    assert not [path.name for path in temporary.iterdir()]
    wait_for(lambda: not any(os.path.exists(f"/proc/{process}") for process in begun))


def test_a_full_disk_is_one_line_and_loses_nothing(whole):
    folder, expected = whole
    (folder / "full").mkdir()
    (folder / "kept.yaml").write_text(CAMPAIGN + "keep: {sample: 8}\n")
    script = (
        "mount -t tmpfs -o size=152k none full && (\"$@\"; code=$?; cp -r full kept; exit $code)"
    )
    done = subprocess.run(
        [
            "unshare",
            "-m" if os.getuid() == 0 else "-rm",
            "sh",
            "-c",
            script,
            "sh",
            RUEDO,
            "campaign",
            "run",
            "kept.yaml",
            "--workers",
            "1",
            "--out",
            "full",
        ],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 4 and "make room, and resume" in done.stderr, (
        done.stdout,
        done.stderr,
    )
    assert 0 < results_in(folder / "kept") < 8
    ruedo("campaign", "resume", "c.yaml", "--out", "kept", folder=folder, code=1)
    assert table(folder, "--out", "kept") == expected


def test_a_kept_log_repeats_byte_for_byte(whole):
    folder, _ = whole
    logs = sorted((folder / "c.campaign/logs").iterdir())
    assert len(logs) == 2  # of what failed
    for log in logs:
        assert log.stat().st_size < 20000
        said = ruedo("verify", log, folder=folder).stdout
        assert "repeated byte for byte" in said
        assert "not as in the log" not in said, "one release, though another program"


def test_show_and_repeat(whole):
    folder, _ = whole
    shown = ruedo("campaign", "show", "c.yaml", "2", folder=folder).stdout
    assert "distance = 1.2" in shown and "touched wall" in shown
    assert (
        "to the last bit"
        in ruedo("campaign", "repeat", "c.yaml", "2", "-o", "full.lcm", folder=folder).stdout
    )
    assert "p3at/lrf" in (folder / "full.lcm").read_bytes().decode("latin-1")
    assert "repeated byte for byte" in ruedo("verify", "full.lcm", folder=folder).stdout
    assert (
        "is not a case of walls"
        in ruedo("campaign", "show", "c.yaml", "8", folder=folder, code=3).stderr
    )


def test_exports_and_the_sum_as_json(whole):
    import pandas

    folder, expected = whole
    ruedo("campaign", "export", "c.yaml", "-o", "t.parquet", folder=folder)
    assert list(pandas.read_parquet(folder / "t.parquet").status) == [
        line.split(",")[8] for line in expected.splitlines()[1:]
    ]
    ruedo("campaign", "export", "c.yaml", "-o", "t.xml", folder=folder)
    suite = ElementTree.parse(folder / "t.xml").getroot()
    assert suite.get("tests") == "8" and len(suite.findall("testcase/failure")) == 2
    summary = json.loads(ruedo("campaign", "run", "c.yaml", "--json", folder=folder, code=1).stdout)
    assert (summary["cases"], summary["failed"], summary["status"]) == (
        8,
        2,
        {"failed": 2, "passed": 6},
    )


def seen_on_a_terminal(*words, folder, code):
    """Standard output, and what a terminal of 100 columns was sent on standard error."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 100, 0, 0))
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    process = subprocess.Popen(
        [RUEDO, *words], cwd=folder, stdout=subprocess.PIPE, stderr=theirs, env=environment
    )
    os.close(theirs)
    seen = b""
    try:
        while part := os.read(ours, 65536):
            seen += part
    except OSError:  # its last writer is gone
        pass
    out = process.communicate(timeout=PATIENCE)[0].decode()
    os.close(ours)
    assert process.returncode == code
    return out, re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", seen.decode())


def test_a_terminal_sees_rate_failures_and_the_time_that_is_left(folder):
    command = ("campaign", "run", "c.yaml", "--workers", "1")
    out, seen = seen_on_a_terminal(*command, folder=folder, code=1)
    last = [line for line in re.split(r"[\r\n]+", seen) if line.strip()][-1]
    assert re.match(r"walls .*8/8 +[\d.]+/s +2 failed +0:\d\d:\d\d left 0:00:00", last), seen
    assert "walls: 8 of 8 cases: 2 failed, 6 passed" in out
    quiet, nothing = seen_on_a_terminal(*command, "--quiet", folder=folder, code=1)
    assert not nothing and quiet == out
    text, nothing = seen_on_a_terminal(*command, "--json", folder=folder, code=1)
    assert not nothing and json.loads(text)["failed"] == 2


def test_the_report_needs_no_network(whole):
    folder, _ = whole
    ruedo("campaign", "report", "c.yaml", "-o", "r.html", folder=folder)
    page = (folder / "r.html").read_text()
    for text in ("2 failed", "Wilson", "bold", "The worst runs", "Where they failed"):
        assert text in page
    loads = [
        part.split('"')[0] for attribute in ('src="', "url(") for part in page.split(attribute)[1:]
    ]
    assert all(one.startswith(("#", "data:")) for one in loads) and "<script" not in page


def test_the_commands_of_the_report_show_the_run(whole):
    """A kept log holds the inputs; what is played is the full log that `repeat` makes of it."""
    folder, _ = whole
    ruedo("campaign", "report", "c.yaml", "-o", "r.html", folder=folder)
    page = html.unescape((folder / "r.html").read_text())
    named = re.findall(
        r"ruedo (campaign repeat \S+c\.yaml \d -o (case\d\.lcm)) && ruedo play \2 (--\w+)<", page
    )
    assert len(named) == 2  # that failed
    repeat, log, option = named[0]
    assert f"ruedo play {folder / log} {option}," in ruedo(*repeat.split(), folder=folder).stdout
    assert b"p3at/pose" in (folder / log).read_bytes()
    ruedo("play", log, "--html", "page.html", folder=folder)
    assert f" {option} " in ruedo("play", "--help", folder=folder).stdout


def test_the_report_has_pages_of_the_worst_runs(whole):
    """Repeated, since the kept logs hold no messages; made once."""
    folder, _ = whole
    report = ("campaign", "report", "c.yaml", "-o", "look.html", "--pages")
    ruedo(*report, "1", folder=folder)
    (first,) = (folder / "look.pages").iterdir()
    when = first.stat().st_mtime_ns
    said = ruedo(*report, "5", folder=folder)
    assert said.stdout == "look.html\n" and said.stderr == ""
    links = re.findall(
        r"<a href='(look\.pages/\w+\.html)'>look at it", (folder / "look.html").read_text()
    )
    assert len(links) == len(set(links)) == 2 and first.stat().st_mtime_ns == when  # that failed
    for link in links:
        page = (folder / link).read_text()
        assert "<script" in page and 100_000 < len(page) < 6_000_000
    ruedo("campaign", "report", "c.yaml", "-o", "none.html", "--pages", "0", folder=folder)
    assert not (folder / "none.pages").exists()
    wrong = ruedo("campaign", "report", "c.yaml", "--pages", "some", folder=folder, code=2)
    assert "'some': allowed is a whole number" in wrong.stderr


def test_results_hold_no_lock(whole):
    """Regression: they did, and another process's last connection removed what this process wrote
    while it had a copy of the file open."""
    folder, _ = whole
    read = Campaign(folder / "c.yaml").results()
    file = folder / "c.campaign/results.sqlite"
    alone = "PRAGMA journal_mode=DELETE"  # refused while there is another connection
    with contextlib.closing(sqlite3.connect(file, timeout=0)) as db:
        assert db.execute(alone).fetchone() == ("delete",)
        assert db.execute("PRAGMA journal_mode=WAL").fetchone() == ("wal",)
    assert len(read) == 8


def test_two_campaigns_compared(whole):
    folder, _ = whole
    (folder / "controller.py").write_text(CONTROLLER.replace('not view.parameters["bold"]', "True"))
    try:
        campaign = Campaign(folder / "c.yaml", out=folder / "careful")
        campaign.run()
        found = compare_with(campaign, str(folder / "c.campaign"))
    finally:
        (folder / "controller.py").write_text(CONTROLLER)
    assert [case.number for case, _, _ in found.better] == [2, 3] and not found.worse
    assert found.p == 0.5 and found.change[0] == pytest.approx(0.25)


def test_worse_cases_have_an_exit_code(whole):
    """Regressions: "1 worse" was 0, where p was large; and a shard that was started in the folder
    of a whole campaign made everybody forget its other cases."""
    folder, _ = whole
    shutil.copytree(folder / "c.campaign", folder / "before")
    ruedo("campaign", "run", "c.yaml", "--shard", "8/8", "--out", "before", folder=folder)
    compare = ("campaign", "compare", "c.yaml", "before")
    assert "8 cases in both" in ruedo(*compare, folder=folder).stdout
    with contextlib.closing(sqlite3.connect(folder / "c.campaign/results.sqlite")) as db:
        first = Campaign(folder / "c.yaml").cases[0].id
        kept = db.execute("SELECT * FROM results WHERE id = ?", (first,)).fetchone()
        db.execute("UPDATE results SET status = 'not judged' WHERE id = ?", (first,))
        db.commit()
        try:
            said = ruedo(*compare, folder=folder, code=1).stdout
            assert "1 worse" in said and f"worse: 0 {first} not judged: " in said
        finally:
            db.execute("UPDATE results SET status = 'passed' WHERE id = ?", (first,))
            db.commit()
            assert db.execute("SELECT * FROM results WHERE id = ?", (first,)).fetchone() == kept
    (folder / "other.yaml").write_text(CAMPAIGN.replace("seeds: 2", "seeds: [7]"))
    said = ruedo("campaign", "compare", "other.yaml", "before", folder=folder, code=1).stderr
    assert "have no case in common" in said
    assert "have passed" not in said
    help_ = " ".join(ruedo("campaign", "compare", "--help", folder=folder).stdout.split())
    assert "A case is worse when it had passed and now has not" in help_


CAUSES = """
def first(view):
    return (0.5, 0.0) if view.time < 3 else (0.0, 0.0)
def second(view):
    if view.time > 0.5 + 0.1 * view.seed:
        raise RuntimeError(f"no plan for {view.seed} cells")
    return 0.1, 0.0
def third(view):
    return None
def fourth(view):
    return 0.0, 0.0
"""


def test_a_report_distinguishes_causes(tmp_path):
    from ruedo import World

    (tmp_path / "c.py").write_text(CAUSES)
    for name, x in (("near", 1.2), ("far", 9.0)):
        (tmp_path / f"{name}.sdf").write_text(str(World(name).wall(x, -2, x, 2).robot("p3at")))
    controllers = ", ".join(
        f"{{name: {one}, python: 'c.py:{one}'}}" for one in ("first", "second", "third", "fourth")
    )
    (tmp_path / "c.yaml").write_text(
        f"worlds: [near.sdf, far.sdf]\ncontrollers: [{controllers}]\nseeds: 10\n"
        "disable: [p3at/camera, p3at/sonar_front, p3at/sonar_rear]\n"
        "expect: {no_contact: true}\nlimits: {duration: 3}\n"
    )
    ruedo("campaign", "run", "c.yaml", "--quiet", folder=tmp_path, code=1)
    ruedo("campaign", "report", "c.yaml", "--pages", "0", folder=tmp_path)
    page = html.unescape((tmp_path / "c.campaign/report.html").read_text())
    why = page.partition("<h2>Why they failed</h2>")[2].partition("</table>")[0]
    groups = re.findall(r"<tr><td>([a-z ]+)</td><td>(\w+)</td><td class='n'>(\d+)</td>", why)
    assert groups == [
        ("crashed", "controller", "20"),
        ("not judged", "controller", "20"),
        ("failed", "contact", "10"),
    ], groups
    assert "20 crashed" in page and "20 not judged" in page and "30 passed" in page
    assert "<tr><td>near</td><td class='n'>0 of 10</td><td class='n'>0 of 10</td>" in page
    assert "<tr><td>far</td><td class='n'>10 of 10</td><td class='n'>0 of 10</td>" in page
    assert "; walls as in case 0" in page
    assert re.search(r"<td>passed</td><td>[^<]*p3at touched nothing over \d+ steps", page)
    worst = page.partition("<h2>The worst runs</h2>")[2].partition("<h2>")[0]
    captions = re.findall(r"<figcaption><b>\d+</b> (\w+),", worst)[:3]
    assert set(captions) == {"first", "second", "third"}, captions


def test_thirty_students_are_marked_in_one_command(tmp_path):
    (tmp_path / "students").mkdir()
    for i in range(30):  # every third drives into the wall 1.2 m ahead
        (tmp_path / f"students/student{i:02d}.py").write_text(
            CONTROLLER.replace('not view.parameters["bold"]', str(i % 3 != 0))
        )
    (tmp_path / "labs.yaml").write_text("""
worlds: [{name: wall, file: wall.sdf}]
controllers: [{name: student, each: "students/*.py", python: "{file}:ahead"}]
disable: [p3at/camera, p3at/sonar_front, p3at/sonar_rear]
expect: {no_contact: true}
limits: {duration: 3}
""")
    from ruedo import World

    (tmp_path / "wall.sdf").write_text(str(World("wall").wall(1.2, -2, 1.2, 2).robot("p3at")))
    ruedo("campaign", "run", "labs.yaml", "--quiet", folder=tmp_path, code=1)
    marks = Campaign(tmp_path / "labs.yaml").results().frame().groupby("controller").passed.mean()
    assert len(marks) == 30 and [bool(marks[f"student{i:02d}"]) for i in range(30)] == [
        i % 3 != 0 for i in range(30)
    ]


def test_the_labs_of_a_class_are_marked_in_one_command(tmp_path):
    """The labs' own answers pass; each of the wrong ones fails where it should. tests/exam has more
    of those.
    """
    shutil.copytree(SOURCE / "clients/python/examples/labs", tmp_path / "labs")
    folder = tmp_path / "labs/marking"
    students = {
        "done": "class square:\n    def __init__(self, robot): pass\n    def __call__(self, view): return 'done'\nwall_following = sonar_avoidance = umbmark = mapping = particle_filter = planning = vision = many_robots = square\n",
        "bad": "def square(robot):\n    robot.drive(1 / 0, 0.0)\ndef wall_following(robot):\n    for _ in range(9):\n        robot.drive(0.0, 0.0)\ndef sonar_avoidance(robot):\n    while True:\n        robot.drive(0.4, 0.0)\n",
        "$(touch here); 'a name' {lab}": "def umbmark(robot)\n",
    }
    for name, text in students.items():
        (folder / f"students/{name}.py").write_text(text)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    ruedo(
        *("campaign", "run", "labs.yaml", "--quiet", "--workers", "2"),
        folder=folder,
        code=1,
        env={**os.environ, "PATH": path},
    )
    frame = Campaign(folder / "labs.yaml").results().frame()
    passed = frame[frame.passed].groupby("controller").size()
    assert dict(passed) == {"solution": 9}
    assert set(frame[~frame.passed].status) <= {"failed", "crashed"}
    reasons = {(row.controller, row.lab): row.reason for row in frame.itertuples()}
    assert len(reasons) == 4 * 9
    for student, lab, text in (
        ("done", "square", "was not at the corner 2, 0 in its turn"),
        ("done", "wall_following", "went 0.0 m, and 6 are asked for"),
        ("bad", "square", "ZeroDivisionError"),
        ("bad", "wall_following", "went 0.0 m, and 6 are asked for"),
        ("bad", "sonar_avoidance", "touched"),
        ("bad", "mapping", "nothing was handed in"),
        ("done", "planning", "p3at ends "),
        ("done", "vision", " m from the red beacon, not 1"),
        ("done", "many_robots", "p3at ends "),
        ("$(touch here); 'a name' {lab}", "umbmark", "SyntaxError"),
    ):
        assert text in reasons[student, lab], reasons[student, lab]
    assert not (folder / "here").exists()


@pytest.fixture
def results(whole):
    """A campaign whose results in `other` may be damaged, and a function that runs SQL on them."""
    folder, _ = whole
    shutil.rmtree(folder / "other", ignore_errors=True)
    shutil.copytree(folder / "c.campaign", folder / "other")
    file = folder / "other/results.sqlite"

    def run(statements):
        with contextlib.closing(sqlite3.connect(file)) as db:
            db.executescript("PRAGMA journal_mode=DELETE;" + statements)
            db.commit()

    return folder, file, run


ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i FROM n"
DAMAGE = {
    "status": "UPDATE results SET status = '<script>'",
    "metrics": "UPDATE results SET metrics = '[1]'",
    "metric": "UPDATE results SET metrics = '{\"x\": \"y\"}'",
    "deep": "UPDATE results SET metrics = '" + "[" * 100_000 + "'",
    "track": "UPDATE results SET track = '[[1, 2]]'",
    "name": r"""UPDATE results SET metrics = '{"\ud800": 1}'""",
    "digits": "UPDATE results SET metrics = '{\"x\": 1" + "0" * 400 + "}'",
    "far": "UPDATE results SET track = '[[1, 2, 1" + "0" * 400 + "]]'",
    "place": "UPDATE results SET track = '[[1, 2, NaN]]'",
    "id": "UPDATE results SET id = '../../' || substr(id, 7)",
    "bytes": "UPDATE results SET reason = x'ff'",
    "cases": "UPDATE about SET value = '[{}]' WHERE key = 'cases'",
    "text": "UPDATE about SET value = '[' WHERE key = 'cases'",
    "format": "UPDATE about SET value = 2 WHERE key = 'format'",
    "view": f"DROP TABLE results; CREATE VIEW results AS {ENDLESS}",
    "trigger": "CREATE TRIGGER t AFTER INSERT ON about BEGIN DELETE FROM results; END",
    "table": "CREATE TABLE more (x)",
}


def test_numbers_at_the_end_of_all_numbers_are_reported(results):
    """Regression: values that differ in their last bits, or by more than a number can say, had no
    scale.
    """
    folder, _, run = results
    run("""UPDATE results SET metrics = '{"a": 1.7e308, "b": 0.1}', track = '[[0, -1e308, 1e308]]';
        UPDATE results SET metrics = '{"a": -1.7e308, "b": 0.10000000000000002}'
        WHERE status = 'passed'""")
    options = ("--out", "other", "--pages", "0", "-o", "far.html")
    ruedo("campaign", "report", "c.yaml", *options, folder=folder)
    assert "The worst runs" in (folder / "far.html").read_text()
    assert Campaign(folder / "c.yaml", out=folder / "other").results().csv().count("1.7e+308") == 8


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_results_are_reported_in_one_line(results, damage):
    folder, _, run = results
    run(DAMAGE[damage])
    join, status = ("join", "--out", "joined", "other"), ("status", "--out", "other")
    commands = {
        "id": [join],  # the campaign asks for its own alone
        "cases": [("compare", "other")],
        "text": [("compare", "other")],
    }.get(damage, [join, status])
    shutil.rmtree(folder / "joined", ignore_errors=True)
    for kind, *words in commands:
        said = ruedo("campaign", kind, "c.yaml", *words, folder=folder, code=3).stderr
        assert said.count("\n") == 1 and "other" in said, said
        assert "damaged" in said or "is of format" in said, said


def test_an_invalid_results_file_is_reported(results):
    folder, file, _ = results
    content = file.read_bytes()
    for wrong in (b"SQLite format 3\0" + bytes(200), content[:5000], b"x" * 5000):
        file.write_bytes(wrong)
        done = ruedo(
            "campaign", "join", "c.yaml", "--out", "joined", "other", folder=folder, code=3
        )
        assert done.stderr.count("\n") == 1 and "other/results.sqlite is damaged" in done.stderr
    file.unlink()
    os.mkfifo(file)
    done = ruedo("campaign", "status", "c.yaml", "--out", "other", folder=folder, code=4)
    assert "not a regular file" in done.stderr


def test_a_fifo_in_place_of_a_log_is_not_waited_for(results):
    folder, _, _ = results
    log = next((folder / "other/logs").iterdir())
    log.unlink()
    os.mkfifo(log)
    shutil.rmtree(folder / "joined", ignore_errors=True)
    done = ruedo("campaign", "join", "c.yaml", "--out", "joined", "other", folder=folder, code=3)
    assert f"logs/{log.name}" in done.stderr and "not a regular file" in done.stderr


ODD = '''
class Odd(Exception):
    pass


def drive(view):
    raise Odd('two\\nlines, \x1b[31mred, """ and "quotes"')


def measure(log):
    return float("nan")
'''


def test_a_controllers_error_stays_one_line_everywhere(tmp_path):
    """Also in the test that a hunt keeps, which was no Python and no YAML any more."""
    folder = tmp_path / "with a space"
    folder.mkdir()
    (folder / "odd.py").write_text(ODD)
    text = CAMPAIGN.replace("controller.py:ahead", "odd.py:drive").replace("seeds: 2", "seeds: 1")
    text = text.replace(
        '{name: walls, generator: "world.py:walls", parameters: {distance: "{distance}"}}', "arena"
    )
    text += 'metrics: [{name: odd, python: "odd.py:measure"}]\n'
    (folder / "c.yaml").write_text(text)
    said = ruedo("campaign", "run", "c.yaml", "--quiet", folder=folder, code=1).stdout
    assert said.count("\n") == 5 and "\x1b" not in said and "Odd: two lines, ?[31mred" in said
    ruedo("campaign", "report", "c.yaml", "--pages", "0", folder=folder)
    ruedo(
        "hunt", "c.yaml", "--cases", "1", "--shrink", "0", "--keep", "kept", folder=folder, code=1
    )
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "kept"]
    failed = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=PATIENCE)
    assert failed.returncode == 1 and "Odd: two lines" in failed.stdout, failed.stdout


@pytest.mark.parametrize(
    "words",
    [("export", "-o"), ("report", "--pages", "0", "-o"), ("repeat", "2", "-o"), ("run", "--junit")],
)
def test_an_unwritable_file_is_reported(whole, words):
    folder, _ = whole
    done = ruedo("campaign", words[0], "c.yaml", *words[1:], "nowhere/t.csv", folder=folder, code=4)
    assert done.stderr == "ruedo: nowhere/t.csv: No such file or directory\n"


def test_a_command_never_overwrites_its_input(whole):
    folder, expected = whole
    log = next((folder / "c.campaign/logs").iterdir()).relative_to(folder)
    linked = folder / "linked.csv"
    os.link(folder / "c.campaign/results.sqlite", linked)
    read = ["c.yaml", "controller.py", "world.py", "c.campaign/results.sqlite", log, linked]
    kept = {file: (folder / file).read_bytes() for file in read}
    commands = (
        ("run", "c.yaml", "--quiet", "--junit"),
        ("report", "c.yaml", "--pages", "0", "-o"),
        ("repeat", "c.yaml", "2", "-o"),
    )
    for *command, file in [
        *((*words, file) for words in commands for file in read),
        ("export", "c.yaml", "-o", linked),
        ("report", "c.yaml", "--pages", "0", "--baseline", ".", "-o", "c.campaign/lock"),
    ]:
        said = ruedo("campaign", *command, file, folder=folder, code=2).stderr
        assert said.endswith(
            f"{command[-1]} {file} is one of the files that are read for this, "
            "which would be lost\n"
        ), said
        assert {file: (folder / file).read_bytes() for file in read} == kept
    linked.unlink()
    assert table(folder) == expected


@pytest.mark.parametrize(
    "words",
    [
        ("export", "c.yaml", "-o", "full/t.csv"),
        ("export", "c.yaml", "-o", "full/t.parquet"),
        ("report", "c.yaml", "--pages", "0", "-o", "full/t.html"),
        ("run", "c.yaml", "--quiet", "--junit", "full/t.xml"),
    ],
)
def test_existing_files_outlive_a_full_disk(whole, words):
    folder, _ = whole
    (folder / "full").mkdir(exist_ok=True)
    kept = "number,id,world,robot,controller,seed,kept"  # as what it replaces begins
    if words[-1].endswith(".xml"):
        kept = "<testsuite/>"
    script = (
        "mount -t tmpfs -o size=64k none full && echo \"$KEPT\" > $0 && ! cat /dev/zero > full/fill && "
        '! cat /dev/zero >> full/fill && "$@"; echo $?; cat $0; ls full'
    )
    full = ["unshare", "-m" if os.getuid() == 0 else "-rm", "sh", "-c", script, words[-1]]
    done = subprocess.run(
        [*full, RUEDO, "campaign", *words],
        cwd=folder,
        env={**os.environ, "KEPT": kept},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    name = words[-1].removeprefix("full/")
    assert done.stdout.split()[-4:] == ["4", kept, "fill", name], done
    assert done.stderr.splitlines()[-1] == f"ruedo: {words[-1]}: No space left on device", done


def test_an_option_is_given_once(folder):
    done = ruedo(
        "campaign", "run", "c.yaml", "--shard", "1/2", "--shard", "2/2", folder=folder, code=2
    )
    assert "argument --shard: is given twice" in done.stderr
    assert not (folder / "c.campaign").exists()


def test_slurm(whole):
    folder, _ = whole
    script = ruedo("campaign", "slurm", "c.yaml", "--tasks", "4", folder=folder).stdout
    assert "#SBATCH --array=1-4" in script
    subprocess.run(["bash", "-n"], input=script, text=True, check=True)
    done = subprocess.run(
        ["bash"],
        input=script,
        text=True,
        cwd="/",
        timeout=PATIENCE,
        env={**os.environ, "SLURM_ARRAY_TASK_ID": "2", "SLURM_CPUS_PER_TASK": "1"},
    )
    assert done.returncode == 0 and results_in(folder / "c.campaign.shard2") == 2


def test_comparing_with_no_results_is_reported(whole):
    folder, _ = whole
    (folder / "empty").mkdir(exist_ok=True)
    done = ruedo("campaign", "compare", "c.yaml", "empty", folder=folder, code=3)
    assert done.stderr == "ruedo: empty holds no results of a campaign (no results.sqlite)\n"


def test_control_characters_of_parameters_are_escaped_in_xml(folder):
    text = CAMPAIGN.replace("bold: [false, true]", 'bold: ["\\a"]')
    (folder / "c.yaml").write_text(text)
    ruedo("campaign", "run", "c.yaml", "--quiet", "--junit", "r.xml", folder=folder, code=1)
    assert len(ElementTree.parse(folder / "r.xml").getroot()) == 4
