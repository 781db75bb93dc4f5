"""Cases know nothing of each other: what one leaves in its process, on the disk or behind it is no
part of the next one, nor of the campaign.
"""

import os
import subprocess
import sys
import time

import pytest
from conftest import PATIENCE, RUEDO, results_in, ruedo, wait_for
from ruedo.campaign import Campaign, output

HEAD = "worlds: [arena]\ndisable: [p3at/camera, p3at/sonar_front, p3at/sonar_rear]\n"


def campaign(folder, controllers, *more, limits="{duration: 1, wall: 300}", **files):
    """c.yaml with these controllers, and FILE.py for each of `files`."""
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text)
    lines = "".join(f"  - {{name: {name}, {rest}}}\n" for name, rest in controllers.items())
    text = f"{HEAD}controllers:\n{lines}" + "".join(f"{one}\n" for one in more)
    (folder / "c.yaml").write_text(f"{text}limits: {limits}\n")
    return Campaign(folder / "c.yaml")


def rows(results):
    return {case.controller: row for case, row in results.done}


COUNTS = """
import os
count = 0
def drive(view):
    global count
    count += 1
    os.environ["COUNT"] = str(count)
    os.chdir("/")
    return 0.03 * count, 0.0
"""


def test_a_case_sees_nothing_of_the_one_before(tmp_path):
    """Regression: the table depended on the number of workers."""
    made = campaign(tmp_path, {"counts": 'python: "counts.py:drive"'}, "seeds: 3", counts=COUNTS)
    ways = {row["metrics"]["path_m"] for _, row in made.run(workers=1).done}
    assert len(ways) == 1 and ways.pop() > 0.0


def test_controllers_of_two_folders_have_modules_of_the_same_names(tmp_path):
    """Regression: each got those of whoever came first; and so did worlds' generators."""
    for name, speed in (("old", 0.1), ("new", 0.4)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "planner.py").write_text(f"SPEED = {speed}\n")
        (tmp_path / name / "drive.py").write_text(
            "import planner\n\ndef drive(view):\n    return planner.SPEED, 0.0\n"
        )
    python = {name: f'python: "{name}/drive.py:drive"' for name in ("old", "new")}
    found = rows(campaign(tmp_path, python).run(workers=1))
    # 1 s at v after a from rest: v - v^2 / (2 a) m, where a is 0.3 m/s^2; 0.4 is not reached.
    assert found["old"]["metrics"]["path_m"] == pytest.approx(0.0833, abs=0.002)
    assert found["new"]["metrics"]["path_m"] == pytest.approx(0.15, abs=0.002)


THREADS = """
import threading, time
from pathlib import Path
def leaves(view):
    has_begun = threading.Event()
    def beat():
        while True:
            Path(__file__).with_name("beat").touch()
            has_begun.set()
            time.sleep(0.001)
    threading.Thread(target=beat).start()
    has_begun.wait()
    return "done" if view.time else (0.0, 0.0)
def waits(view):
    time.sleep(0.5)
    return "done" if view.time else (0.0, 0.0)
"""


def test_a_thread_ends_with_its_case(tmp_path):
    """Regression: it ran on beside the next ones, and kept the worker from its end."""
    names = {name: f'python: "threads.py:{name}"' for name in ("leaves", "waits")}
    made = campaign(tmp_path, names, threads=THREADS)
    begun = time.time()
    found = rows(made.run(workers=1))
    assert {row["status"] for row in found.values()} == {"passed"}
    assert begun - 0.1 < os.stat(tmp_path / "beat").st_mtime < time.time() - 0.5


MEASURES = """
import time
def stand(view):
    return 0.0, 0.0
def hangs(log):
    while True:
        time.sleep(1)
def greedy(log):
    return len(bytearray(1 << 40))
def good(log):
    return 2.0
"""


@pytest.mark.parametrize(
    "name, says",
    [
        ("hangs", "measures.py:hangs: the metrics took more than 10 s"),
        ("greedy", "measures.py:greedy wanted more than 4096 MB of memory"),
    ],
)
def test_a_metric_that_hangs_is_not_the_controllers_fault(tmp_path, name, says):
    metrics = f"metrics: [{{name: m, python: 'measures.py:{name}'}}]"
    python = {"stand": 'python: "measures.py:stand"'}
    made = campaign(tmp_path, python, metrics, limits="{duration: 1, wall: 10}", measures=MEASURES)
    row = rows(made.run(workers=1))["stand"]
    assert (row["status"], row["what"], row["reason"]) == ("invalid", "metric", says)
    assert row["metrics"]["time_s"] == 1.0


FORKS = """
import os, time
def forks(view):
    if os.fork() == 0:
        raise RuntimeError("a child of another case's")
    os.wait()
    return "done" if view.time else (0.0, 0.0)
def stays(view):
    if os.fork() == 0:
        open(__file__ + ".child", "w").write(str(os.getpid()))
        while True:
            time.sleep(1)
    return "done" if view.time else (0.0, 0.0)
def stand(view):
    return 0.0, 0.0
"""


def test_a_child_of_a_controller_has_no_part_in_the_campaign(tmp_path):
    """Regressions: what became of it was stored for another case, and it outlived the campaign."""
    names = {name: f'python: "forks.py:{name}"' for name in ("forks", "stays", "stand")}
    found = rows(campaign(tmp_path, names, forks=FORKS).run(workers=1))
    assert {name: row["status"] for name, row in found.items()} == dict.fromkeys(names, "passed")
    assert found["stand"]["metrics"]["time_s"] == 1.0
    if (tmp_path / "forks.py.child").exists():  # it may be ended before it has begun
        process = (tmp_path / "forks.py.child").read_text()
        assert not process or not os.path.exists(f"/proc/{process}")


LEAVES = """
import os, subprocess
from pathlib import Path
def leave(name):
    child = subprocess.Popen(["sleep", "1000"], start_new_session=name != "dies")
    Path(__file__).with_name(name).write_text(str(child.pid))
def ends(view):
    leave("ends")
    return "done" if view.time else (0.0, 0.0)
def dies(view):
    leave("dies")
    os._exit(0)
def measure(log):
    leave("measure")
    return 1.0
"""


def test_no_process_stays(tmp_path):
    """Regression: those that Python controllers and metrics had started did."""
    names = {name: f'python: "leaves.py:{name}"' for name in ("ends", "dies")}
    made = campaign(tmp_path, names, leaves=LEAVES)
    found = rows(made.run(workers=1))
    assert found["ends"]["status"] == "passed" and found["dies"]["status"] == "crashed"
    metric = 'metrics: [{name: m, python: "leaves.py:measure"}]'
    campaign(tmp_path, {"ends": names["ends"]}, metric).run(workers=1)
    for name in ("ends", "dies", "measure"):
        process = (tmp_path / name).read_text()
        wait_for(lambda process=process: not os.path.exists(f"/proc/{process}"))


def test_processes_that_a_repeated_program_leaves_are_ended(tmp_path):
    """Regression: it was in a campaign alone."""
    command = "echo $$ > child; exec sleep 1000"
    (tmp_path / "leave.sh").write_text(command)
    command = "setsid sh leave.sh & while ! test -s child; do :; done"
    limits = "{duration: 1, wall: 10}"  # background processes are waited for
    campaign(tmp_path, {"c": f'command: "{command}", lockstep: 1'}, limits=limits)
    ruedo("campaign", "repeat", "c.yaml", "0", folder=tmp_path)
    assert not os.path.exists(f"/proc/{(tmp_path / 'child').read_text().strip()}")


EDITS = """
import os
def drive(view):
    with open(FILE, "a") as file:
        file.write("\\n")
    return "done" if view.time else (0.0, 0.0)
"""


@pytest.mark.parametrize("which", ["controller.py", "lib.py", "w.sdf"])
def test_a_run_whose_file_is_edited_meanwhile_gives_no_result(folder, which):
    """Regression: it was stored as one of the file that had been there before."""
    from ruedo import World

    (folder / "w.sdf").write_text(str(World("w").robot("p3at")))
    (folder / "lib.py").write_text("")
    edits = EDITS.replace("FILE", repr(str(folder / which)))
    (folder / "controller.py").write_text(edits)
    campaign(folder, {"edits": 'python: "controller.py:drive", files: [lib.py]'}, "seeds: 2")
    text = (folder / "c.yaml").read_text().replace("[arena]", "[{name: w, file: w.sdf}]")
    (folder / "c.yaml").write_text(text)
    said = ruedo("campaign", "run", "c.yaml", "--workers", "1", folder=folder, code=4).stderr
    assert f"{which} was changed while its cases ran" in said and said.count("\n") == 1
    assert results_in(folder / "c.campaign") == 0
    (folder / "controller.py").write_text("def drive(view):\n    return 0.0, 0.0\n")
    ruedo("campaign", "resume", "c.yaml", folder=folder)


STREAMS = """
import os, sys
def closes(view):
    sys.stdout.close()
    return "done" if view.time else (0.0, 0.0)
def none(view):
    sys.stdout = sys.stderr = None
    return "done" if view.time else (0.0, 0.0)
def closes_both(view):
    if view.time:
        return "done"
    os.close(1)
    os.close(2)
    return 0.0, 0.0
def speaks(view):
    print("here I am")
    raise RuntimeError("and that was it")
"""


def test_streams_are_whole_for_the_next_case(tmp_path):
    """Regression: all later cases of the worker were invalid, for good."""
    names = [name for one in ("closes", "none", "closes_both") for name in (one, f"after_{one}")]
    controllers = {
        name: f'python: "streams.py:{"speaks" if "after" in name else name}", hz: {10 + i}'
        for i, name in enumerate(names)
    }
    found = rows(campaign(tmp_path, controllers, streams=STREAMS).run(workers=1))
    for name in names:
        assert found[name]["status"] == ("crashed" if "after" in name else "passed"), found[name]
        assert ("here I am" in found[name]["output"]) == ("after" in name)


PRINTS = """
def prints(view):
    for _ in range(20_000):
        print("x" * 1000)
    print("the end")
    raise RuntimeError
"""


def test_output_that_was_cut_is_reported_as_cut(tmp_path, monkeypatch):
    """A controller that prints much and ends at once is over before the next look at the file."""
    monkeypatch.setattr(output, "_LOOK_S", 100.0)
    said = output.Output(str(tmp_path / "output"))
    os.write(said.descriptor, b"x" * (2 << 20) + b"the end")
    assert said.text().startswith("(it printed more than 1 MB;")
    assert said.text().endswith("xthe end") and len(said.text()) < 5000
    said.close()


def blocks_bytes(descriptor):
    return os.fstat(descriptor).st_blocks * 512


def test_output_during_a_cut_is_kept(tmp_path, monkeypatch):
    """Regression: what came between the look at the file and the cut was lost."""
    free = output._fallocate

    def free_late(descriptor, *rest):
        os.write(descriptor, b"meanwhile, ")
        return free(descriptor, *rest)

    monkeypatch.setattr(output, "_fallocate", free_late)
    said = output.Output(str(tmp_path / "output"))
    os.write(said.descriptor, b"x" * (2 << 20))
    wait_for(lambda: blocks_bytes(said.descriptor) < 1 << 20)
    os.write(said.descriptor, b"the end")
    assert said.text().startswith("(it printed more than 1 MB;")
    assert said.text().endswith("xmeanwhile, the end") and len(said.text()) < 5000
    os.truncate(said.descriptor, 0)  # by the controller
    os.write(said.descriptor, b"y" * (2 << 20))
    wait_for(lambda: blocks_bytes(said.descriptor) < 1 << 20)
    said.close()


def test_output_is_bounded_where_no_part_of_a_file_can_be_freed(tmp_path, monkeypatch):
    monkeypatch.setattr(output, "_fallocate", lambda *_: -1)
    said = output.Output(str(tmp_path / "output"))
    os.write(said.descriptor, b"x" * (2 << 20))
    wait_for(lambda: blocks_bytes(said.descriptor) == 0)
    os.write(said.descriptor, b"the end")
    assert said.text().startswith("(it printed more than 1 MB;")
    assert said.text().endswith("xthe end") and len(said.text()) < 5000
    said.close()


@pytest.mark.parametrize("way", ["python", "command"])
def test_output_is_bounded(tmp_path, way):
    """Regression: half a GB a case, in memory."""
    ways = {
        "python": 'python: "prints.py:prints"',
        "command": 'command: "head -c 20000000 /dev/zero; sleep 0.1; echo the end; exit 1", lockstep: 1',
    }
    made = campaign(tmp_path, {"prints": ways[way]}, prints=PRINTS)
    (row,) = rows(made.run(workers=1)).values()
    assert row["status"] == "crashed" and "the end" in row["output"]
    assert "it printed more than 1 MB" in row["output"] and len(row["output"]) < 5000


HOSTILE = """
import os, time
def exits(view):
    os._exit(0)
def stubborn(view):
    try:
        while True:
            time.sleep(0.01)
    except BaseException:  # around the loop: the signal that its time is up may come anywhere
        stubborn(view)
"""


@pytest.mark.parametrize(
    "name, status, wall", [("exits", "crashed", 300), ("stubborn", "timeout", 1)]
)
def test_reports_and_repetitions_outlive_a_controller(tmp_path, name, status, wall):
    """Regressions: the program ended with it, silently and well; or hung for ever."""
    campaign(
        tmp_path,
        {name: f'python: "hostile.py:{name}"'},
        limits=f"{{duration: 1, wall: {wall}}}",
        hostile=HOSTILE,
    )
    assert f"1 {status}" in ruedo("campaign", "run", "c.yaml", folder=tmp_path, code=1).stdout
    done = ruedo("campaign", "report", "c.yaml", "-o", "r.html", folder=tmp_path)
    assert done.stdout == "r.html\n" and "no page of case 0" in done.stderr
    assert ruedo("campaign", "repeat", "c.yaml", "0", folder=tmp_path).stdout.startswith(status)


@pytest.mark.parametrize("line", ["raise SystemExit(0)", "1 / 0"])
def test_a_package_is_found_without_being_imported(tmp_path, line):
    """Regression: `status` ended with it, silently and well."""
    (tmp_path / "package").mkdir()
    (tmp_path / "package/__init__.py").write_text(line + "\n")
    (tmp_path / "package/sub.py").write_text("def drive(view):\n    return 0.0, 0.0\n")
    campaign(tmp_path, {"c": 'python: "package.sub:drive"'})
    assert "0 of 1 cases" in ruedo("campaign", "status", "c.yaml", folder=tmp_path).stdout
    assert "1 passed" in ruedo("campaign", "run", "c.yaml", folder=tmp_path).stdout


def test_a_lock_that_is_not_a_regular_file_is_refused(folder):
    (folder / "out").mkdir()
    os.mkfifo(folder / "out/lock")
    said = ruedo("campaign", "run", "c.yaml", "--out", "out", folder=folder, code=4).stderr
    assert said.endswith("out/lock: it is not a regular file\n")


WRITES = """
def drive(view):
    return 0.3, 0.2
def measure(log):
    return 1.0
"""


@pytest.mark.parametrize("way", ["python", "command"])
def test_a_full_temporary_folder_is_not_blamed_on_the_controller(tmp_path, way):
    """Regression: it was stored as a crash, and never repeated."""
    program = f"{sys.executable} -c 'import ruedo; ruedo.connect(timeout={PATIENCE}).step(1000)'"
    ways = {
        "python": 'python: "writes.py:drive"',
        "command": f'command: "{program}", lockstep: 1',
    }
    metric = 'metrics: [{name: m, python: "writes.py:measure"}]'
    limits = "{duration: 5, wall: 300}"
    campaign(tmp_path, {"c": ways[way]}, metric, limits=limits, writes=WRITES)
    (tmp_path / "full").mkdir()
    namespace = ["unshare", "-m" if os.getuid() == 0 else "-rm", "sh", "-c"]
    script = 'mount -t tmpfs -o size=100k none full && exec "$@"'
    done = subprocess.run(
        [*namespace, script, "sh", RUEDO, "campaign", "run", "c.yaml", "--workers", "1"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        env={**os.environ, "TMPDIR": str(tmp_path / "full")},
    )
    assert done.returncode == 4 and done.stderr.count("\n") == 1, (done.stdout, done.stderr)
    assert done.stderr.endswith(
        "No space left on device; finished cases are kept: make room, and resume\n"
    )
    assert "1 of 1 cases: 1 passed" in ruedo("campaign", "resume", "c.yaml", folder=tmp_path).stdout


ANSWERS = """
def nan(view): return float("nan"), 0.0
def inf(view): return float("inf"), 0.0
def four(view): return 0.1, 0.2, 0.3, 0.4
def one(view): return (0.1,)
def text(view): return "12"
def texts(view): return "1", "2"
def three(view): return 0.1, 0.0, 0.2
def nothing(view): return None
"""


def test_a_wrong_answer_is_the_controllers_failure(tmp_path):
    """Regression: four numbers, texts and what is not finite passed."""
    others = {"three": "passed", "nothing": "not judged"}
    names = {*others, "nan", "inf", "four", "one", "text", "texts"}
    controllers = {name: f'python: "answers.py:{name}"' for name in sorted(names)}
    found = rows(campaign(tmp_path, controllers, answers=ANSWERS).run(workers=1))
    for name, row in found.items():
        assert row["status"] == others.get(name, "crashed"), row
    assert "(0.1, 0.2, 0.3, 0.4): a controller answers (m/s, rad/s)" in found["four"]["reason"]
    assert "velocity is inf: it must be a finite number" in found["inf"]["reason"]
