"""What a campaign file may contain, how it is expanded, and how errors in it are reported."""

import json
import math
import os
import subprocess
import sys

import pytest
from conftest import CAMPAIGN, PATIENCE, ruedo
from ruedo.campaign import Campaign, SpecError
from ruedo.campaign.plan import points, substitute
from ruedo.campaign.stats import mcnemar, paired_difference, wilson
from ruedo.files import dump_yaml, parse_yaml

WRONG = [  # what is replaced, by what, line, what the message says
    ("name: walls\nworlds", "nmae: walls\nworlds", 2, "nmae: is not known; .*did you mean 'name'"),
    (
        "limits: {duration: 3}",
        "limits: {duration: -1}",
        13,
        "limits.duration: is -1; allowed is more than 0",
    ),
    (
        "limits: {duration: 3}",
        "limits: {duration: .nan}",
        13,
        "limits.duration: is nan; allowed is a finite number",
    ),
    ("seeds: 2", 'seeds: 2\nrobots: ["\\uD800"]', 11, r"robots\[0\]: is '.*', which holds"),
    (
        'name: walls, generator: "world.py:walls", parameters: {distance: "{distance}"}',
        "file: '{distance}'",
        4,
        r"worlds\[0\]: 1.2: no such file",
    ),
    ("seeds: 2", "seeds: 2\nrobots: ['{distance}']", 4, "--spawn '1.2': it looks like MODEL"),
    (
        "world.py:walls",
        "x" * 5000 + ".py:walls",
        4,
        "but there is no file",
    ),
    ("seeds: 2", 'seeds: 2\nset: {"\\uDFFF": 1}', 11, "set: is '.*', which holds half of a char"),
    ("limits: {duration: 3}", "limits: {}", 13, "limits: needs 'duration'"),
    ("limits: {duration: 3}", "", 2, "needs 'limits'"),
    (
        "seeds: 2",
        "seeds: two",
        10,
        "seeds: is 'two'; allowed is a whole number or a list or members with names",
    ),
    ("seeds: 2", "seeds: 0", 10, "seeds: is 0; allowed is 1 or more"),
    ("seeds: 2", "seeds: [1, -2]", 10, r"seeds\[1\]: is -2; allowed is 0 or more"),
    ("seeds: 2", "seeds: 2.0", 10, "seeds: is 2.0; allowed is a whole number"),
    ("seeds: 2", "seeds: {first: 18446744073709551615, count: 2}", 10, "seeds: go beyond"),
    ("seeds: 2", "seeds: 1000000", 2, "4000000 cases .*; allowed are 1000000: make several"),
    (
        "distance: [1.2, 3.0]",
        "distance: {grid: {from: 1, to: 2, steps: 2000000}}",
        2,
        "8000000 cases",
    ),
    (
        "distance: [1.2, 3.0]\n  bold: [false, true]\nseeds: 2",
        "distance: {uniform: [1, 2]}\nsampling: {samples: 1000001}",
        2,
        "1000001 cases",
    ),
    ("distance: [1.2, 3.0]", "distance: [1.2, 1" + "0" * 400 + "]", 8, "a number of 401 digits"),
    ("distance: [1.2, 3.0]", "distance: {uniform: [-1.7e+308, 1.7e+308]}", 8, "too far from each"),
    ("distance: [1.2, 3.0]", "distance: {log_uniform: [1.0e-300, 1.0e+300]}", 8, "too far"),
    (
        "distance: [1.2, 3.0]",
        "on: [1.2, 3.0]",
        7,
        "parameters: has True for a name; put it in quotes",
    ),
    ("distance: [1.2, 3.0]", "distance: [2020-01-01]", 8, "is a date; put it in quotes"),
    (
        "limits: {duration: 3}",
        "limits: {duration: 3, wall: 1.0e+300}",
        13,
        "wall: is 1e[+]300; all",
    ),
    ("limits: {duration: 3}", "limits: {duration: 3, memory_mb: 9e99}", 13, "memory_mb: is"),
    (
        "no_contact: true",
        "clearance: '{distance} m'",
        12,
        "clearance: is '1.2 m'; allowed is a num",
    ),
    ("no_contact: true", "goal: {x: '{bold}', y: 0, radius: 1}", 12, "x: is False; allowed is a"),
    ("no_contact: true", "goal: {x: 1, y: 0, radius: -1}", 12, "radius: is -1; allowed is more"),
    ("no_contact: true", "goal: {x: 1, y: 0, radius: 1, by: 0}", 12, "by: is 0; allowed is more"),
    ("no_contact: true", "goal: []", 12, "goal: is ..; allowed is 1 members or more"),
    ("no_contact: true", "clearance: -1", 12, "clearance: is -1; allowed is 0 to 100"),
    ("no_contact: true", "odometry_error: -0.1", 12, "is -0.1; allowed is 0 to 1e.06"),
    ("no_contact: true", "ignore: ['*']", 12, "ignore: needs expect.golden, the log to compare"),
    ("distance: [1.2, 3.0]", "passed: [1.2, 3.0]", 8, "passed: is a column of the results"),
    (
        "seeds: 2",
        "seeds: 2\nmetrics: [{name: passed, python: 'world.py:walls'}]",
        11,
        "name: is 'passed', which another column of the results is called",
    ),
    (
        "seeds: 2",
        "seeds: 2\nmetrics: [{name: m, python: 'world.py:walls'}, {name: m, python: 'world.py:walls'}]",
        11,
        r"metrics.1..name: is 'm', which another",
    ),
    ("distance: [1.2, 3.0]", "x_m: [1.2, 3.0]", 8, "x_m: is a column of the results"),
    (
        "seeds: 2",
        "seeds: 2\nmetrics: [{name: clearance_m, python: 'world.py:walls'}]",
        11,
        "name: is 'clearance_m', which another column of the results is called",
    ),
    ("seeds: 2", "seeds: 010", 10, "010 is not the number that it looks like"),
    ("seeds: 2", "seeds: [1, -0_7]", 10, "-0_7 is not the number that it looks like"),
    ("limits: {duration: 3}", "limits: {duration: 1:30}", 13, "1:30 is not the number that it"),
    ("limits: {duration: 3}", "limits: {duration: 1:30.5}", 13, "1:30.5 is not the number that"),
    ("seeds: 2", "faults: [{kind: lag, at: soon}]", 10, "at: is 'soon'; allowed is a number"),
    (
        'python: "controller.py:ahead"',
        'python: "controller.py:ahead", hz: 1.0e-310',
        6,
        "hz: is 1e-310; allowed is 0.001 or more",
    ),
    (
        'python: "controller.py:ahead"',
        'python: "controller.py:ahead", files: ["/etc/*"]',
        6,
        "files.0.: is '/etc/[*]', which matches no file",
    ),
    (
        "limits: {duration: 3}",
        "limits: {duration: 3}\nhunt: {obstacles: {most: 1, area: [2, 0, 1, 1]}}",
        14,
        "area: is .2, 0, 1, 1.; allowed is .x1, y1, x2, y2., the least values first",
    ),
    (
        "distance: [1.2, 3.0]",
        "distance: {gird: {from: 1, to: 2, steps: 3}}",
        8,
        "gird: is not known; .*did you mean 'grid'",
    ),
    (
        "distance: [1.2, 3.0]",
        "distance: {uniform: [3, 1]}",
        8,
        r"uniform: is \[3, 1\]; allowed is \[low, high\]",
    ),
    ("distance: [1.2, 3.0]", "seed: [1.2, 3.0]", 8, "seed: is not a name of a parameter"),
    (
        "distance: \"{distance}\"",
        "distance: \"{distanec}\"",
        4,
        "{distanec} is not a parameter; there are bold, distance",
    ),
    (
        "controller.py:ahead",
        "nowhere.py:ahead",
        6,
        r"python: is 'nowhere.py:ahead', but there is no file",
    ),
    ("controller.py:ahead", "controller", 6, "it looks like FILE.py:NAME"),
    ("world.py:walls", "world.py:wall", 4, "world.py has no wall"),
    ("disable: [p3at/camera", "disable: [p3at/camera]]", 11, "no YAML"),
    ("seeds: 2", "noise: !!bool foo", 10, "'foo' is not of type bool"),
    ("seeds: 2", "seeds: !!int ''", 10, "'' is not of type int"),
    ("seeds: 2", "seeds: !!int '-'", 10, "'-' is not of type int"),
    ("seeds: 2", "seeds: !!float ''", 10, "'' is not of type float"),
    ("seeds: 2", "seeds: !!timestamp foo", 10, "'foo' is not of type timestamp"),
    ("seeds: 2", "seeds: 0x" + "F" * 5000, 10, "a number of thousands of digits"),
    ("name: walls\nworlds", "name: 0x" + "F" * 5000 + "\nworlds", 2, "a number of thousands"),
    (
        "name: walls\nworlds",
        'name: "ab\\n"\nworlds',
        2,
        "name: is 'ab.*; allowed is 1 to 63 letters",
    ),
    ("seeds: 2", "seeds: 2\nname: \x1b", 11, r"no YAML: it holds .*1b"),
    ("name: ahead", "name: ahead, each: '.'", 6, "each: is '.', which matches no file"),
    ("name: ahead", f"name: ahead, each: {'a' * 5000}", 6, "which matches no file"),
    ("no_contact: true", 'golden: "\\0"', 12, "golden: is .*, which holds the character 0"),
    (
        "distance: [1.2, 3.0]",
        "distance: {grid: {from: -1.0e+308, to: 1.0e+308, steps: 2}}",
        8,
        "too far from each",
    ),
    ("distance: [1.2, 3.0]", "distance: {normal: [1.0e+308, 1.0e+308]}", 8, "that is too large"),
    ("limits: {duration: 3}", "limits: {duration: 1.0e-9}", 13, "is 1e-09; allowed is 0.001 or"),
    ("seeds: 2", "seeds: 2\nseeds: 3", 11, "'seeds' is there twice"),
    (
        "python: \"controller.py:ahead\"",
        "files: []",
        6,
        "controllers.0.: needs either command or python",
    ),
    (
        "name: walls, generator: \"world.py:walls\", parameters: {distance: \"{distance}\"}",
        "file: nowhere.sdf",
        4,
        "nowhere.sdf",
    ),
]


@pytest.mark.parametrize("old,new,line,text", WRONG)
def test_a_wrong_file_is_reported_with_line_and_allowed_values(folder, old, new, line, text):
    assert old in CAMPAIGN
    (folder / "c.yaml").write_text(CAMPAIGN.replace(old, new, 1))
    with pytest.raises(SpecError, match=text) as caught:
        _ = Campaign(folder / "c.yaml").cases
    assert str(caught.value).startswith(f"{folder / 'c.yaml'}:{line}: ")


NAMES = [  # faults that only a loaded world shows: a line of the file, the error
    ("set: {p3at/lrf.updaterate: 5}", r"set.p3at/lrf.updaterate: .*p3at/lrf.updaterate"),
    ("set: {p3at/lfr.update_rate: 5}", r"set.p3at/lfr.update_rate: .*lfr"),
    ("set: {p3at/lrf.update_rate: fast}", r"set.p3at/lrf.update_rate: .*fast"),
    ("faults: [{kind: freeze, target: lrf}, {kind: freeze, target: lfr}]", r"faults.1.: .*lfr"),
    ("faults: [{kind: frezee, target: lrf}]", r"faults.0.: .*frezee"),
    ("expect: {robot: p3tx}", r"expect.robot: --robot 'p3tx': .*p3at"),
    ("expect: {golden: world.py}", r"expect.golden: .*world.py"),
    ("expect: {golden: g.lcm, tolerances: ['*/pose:pos=most:1']}", r"expect.tolerances: .*most"),
    ("expect: {golden: g.lcm, ignore: ['*']}", r"expect.ignore: .*leaves nothing to compare"),
]


@pytest.mark.parametrize("line, says", NAMES, ids=[line for line, _ in NAMES])
def test_names_that_a_world_lacks_are_reported_before_the_first_run(folder, line, says):
    """Regression: each case was invalid, and none said where."""
    golden = folder / "g.lcm"
    ruedo(*("run", "arena", "--rate", "max", "--duration", 1, "--record", golden), folder=folder)
    text = CAMPAIGN.replace("expect: {no_contact: true}", line)
    (folder / "c.yaml").write_text(text)
    at = next(i for i, one in enumerate(text.splitlines(), 1) if one == line)
    with pytest.raises(SpecError, match=f"c.yaml:{at}: {says}"):
        Campaign(folder / "c.yaml").run(workers=1)


def test_the_command_line_reports_it_in_one_line_with_exit_code_3(folder):
    (folder / "c.yaml").write_text(CAMPAIGN.replace("seeds: 2", "seeds: x"))
    done = ruedo("campaign", "run", "c.yaml", folder=folder, code=3)
    assert done.stderr.count("\n") == 1 and "c.yaml:10" in done.stderr
    assert "cannot be read" in ruedo("campaign", "run", "none.yaml", folder=folder, code=3).stderr


ALIASES = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 9)
)


@pytest.mark.parametrize(
    ("code", "line"),
    [(3, "campaign run no.yaml 2> /dev/full"), (4, "campaign status c.yaml > /dev/full")],
)
def test_a_stream_that_cannot_be_written_changes_no_exit_code(folder, code, line):
    done = subprocess.run(["sh", "-c", f'"$RUEDO" {line}'], cwd=folder, capture_output=True)
    assert done.returncode == code
    assert done.stderr in (b"", b"ruedo: standard output: No space left on device\n")


@pytest.mark.parametrize(
    "content, text",
    [
        (ALIASES, "stands for more than 100000 values"),
        ("[" * 50_000, "nested too deep"),
        ("x" * (1 << 21), "allowed are 1048576"),
        (os.mkfifo, "not a regular file"),
        (lambda path: os.symlink("/dev/zero", path), "not a regular file"),
    ],
    ids=["aliases", "depth", "size", "fifo", "device"],
)
def test_a_hostile_file_is_refused_at_once(folder, content, text):
    """Not after hours, and not for gigabytes."""
    path = folder / "hostile\x1b[31m.yaml"
    path.write_text(content) if isinstance(content, str) else content(path)
    done = ruedo("campaign", "status", path.name, folder=folder, code=3)
    assert text in done.stderr and done.stderr.count("\n") == 1 and "\x1b" not in done.stderr


def test_a_missing_python_package_is_reported_in_one_line(folder):
    import os

    (folder / "python").write_text("#!/bin/sh\nexec python3 -S \"$@\"\n")  # no site-packages
    (folder / "python").chmod(0o755)
    done = ruedo(
        "campaign",
        "run",
        "c.yaml",
        folder=folder,
        code=4,
        env={**os.environ, "RUEDO_PYTHON": str(folder / "python")},
    )
    assert done.stderr.count("\n") == 1 and "pip install 'ruedo[campaign]'" in done.stderr
    done = ruedo(
        "campaign",
        "run",
        "c.yaml",
        folder=folder,
        code=4,
        env={**os.environ, "RUEDO_PYTHON": "/nowhere"},
    )
    assert "'/nowhere' cannot be started (No such file or directory)" in done.stderr


def test_a_generator_that_ends_the_program_is_reported(folder):
    (folder / "world.py").write_text("import sys\nsys.exit()\n")
    assert (
        "walls(distance=1.2) raised SystemExit"
        in ruedo("campaign", "run", "c.yaml", folder=folder, code=3).stderr
    )


def test_a_word_of_a_command_may_be_too_long_for_a_file(folder):
    command = CAMPAIGN.replace('python: "controller.py:ahead"', "command: run " + "x" * 5000)
    assert command != CAMPAIGN
    (folder / "c.yaml").write_text(command)
    assert len(Campaign(folder / "c.yaml").cases) == 8


def test_a_worlds_text_costs_time_by_its_length(tmp_path):
    """Looking for what it refers to must not try each way to divide the blanks."""
    text = "<sdf version='1.9'><world name='w'/></sdf><!--<uri>" + " " * 100_000 + "-->"
    (tmp_path / "w.sdf").write_text(text)
    program = """import sys
from pathlib import Path
from ruedo.campaign.worlds import WorldFiles
print(WorldFiles(Path(), Path("made")).sha256("w.sdf", ""))"""
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, timeout=PATIENCE
    )
    assert done.returncode == 0 and len(done.stdout.strip()) == 64


@pytest.mark.parametrize(
    "words",
    [
        ("run", "c.yaml", "--workers", "0"),
        ("run", "c.yaml", "--workers", "9" * 30),
        ("report", "c.yaml", "--pages", "-1"),
        ("slurm", "c.yaml", "--tasks", "0"),
        ("slurm", "c.yaml", "--time", "1\nrm"),
    ],
)
def test_wrong_options_are_reported_with_allowed_values(folder, words):
    said = ruedo("campaign", *words, folder=folder, code=2).stderr
    assert "allowed is" in said or "it looks like" in said


def test_the_same_is_checked_of_a_dict():
    with pytest.raises(SpecError, match="^campaign: it holds what no file can: "):
        Campaign({"worlds": {object()}})
    with pytest.raises(SpecError, match="^campaign: limits.duration: is 'x'; allowed is a number$"):
        Campaign(
            {
                "worlds": ["arena"],
                "controllers": [{"name": "a", "command": "true"}],
                "limits": {"duration": "x"},
            }
        )


def test_lists_and_grids_are_crossed_in_the_order_of_the_file():
    found = points({"a": [1, 2], "b": {"grid": {"from": 0.0, "to": 1.0, "steps": 3}}}, {})
    assert [(p["a"], p["b"]) for p in found] == [
        (1, 0.0),
        (1, 0.5),
        (1, 1.0),
        (2, 0.0),
        (2, 0.5),
        (2, 1.0),
    ]


def test_a_latin_hypercube_has_one_value_in_each_stratum():
    found = points(
        {"x": {"uniform": [10.0, 20.0]}, "y": {"log_uniform": [1.0, 256.0]}}, {"samples": 8}
    )
    assert sorted(int((p["x"] - 10.0) / 10.0 * 8) for p in found) == list(range(8))
    assert sorted(int(math.log2(p["y"])) for p in found) == list(range(8))
    assert [p["x"] for p in found] != sorted(p["x"] for p in found)


def test_another_parameter_leaves_a_column_as_it_is():
    one = points({"x": {"uniform": [0.0, 1.0]}}, {"samples": 5})
    two = points({"y": {"normal": [0.0, 1.0]}, "x": {"uniform": [0.0, 1.0]}}, {"samples": 5})
    assert [p["x"] for p in one] == [p["x"] for p in two]


def test_whole_numbers_are_drawn_evenly():
    found = points({"n": {"integers": [3, 6]}}, {"samples": 400})
    assert [sum(p["n"] == n for p in found) for n in range(2, 8)] == [0, 100, 100, 100, 100, 0]


def test_holes_in_texts_are_filled():
    fill = lambda value: substitute(value, {"v": 0.5, "b": True}, ValueError)  # noqa: E731
    assert fill("{v}") == 0.5 and fill("--v {v} --b={b}") == "--v 0.5 --b=true"
    assert fill("${HOME} {{v}}") == "${HOME} {v}" and fill([{"a": "{b}"}]) == [{"a": True}]


def test_intervals_and_tests_of_counts():
    # By hand: the roots of (p - 0.8)^2 = z^2 p (1 - p) / 10.
    low, high = wilson(8, 10)
    for p in (low, high):
        assert (p - 0.8) ** 2 == pytest.approx(1.959963984540054**2 * p * (1 - p) / 10)
    assert low < 0.8 < high and wilson(0, 0) == (0.0, 1.0)
    assert (
        mcnemar(1, 9) == pytest.approx(2 * (1 + 10) / 1024)
        and mcnemar(4, 4) == 1.0
        and mcnemar(0, 0) == 1.0
    )
    change, low, high = paired_difference(40, 2, 10, 8)
    assert change == pytest.approx(8 / 60) and low < change < high
    other, low2, high2 = paired_difference(40, 10, 2, 8)
    assert (other, low2, high2) == pytest.approx((-change, -high, -low))


def test_a_shard_without_a_case_is_reported(folder):
    """Regression: nothing was run, and all was well."""
    said = ruedo("campaign", "run", "c.yaml", "--shard", "9/9", folder=folder, code=3).stderr
    assert said == "ruedo: --shard 9/9: there are 8 cases, and none is in it\n"
    script = ruedo("campaign", "slurm", "c.yaml", "--tasks", "20", folder=folder).stdout
    assert "--array=1-8\n" in script and '"$SLURM_ARRAY_TASK_ID/8"' in script


@pytest.mark.parametrize("shard", ["9" * 5000 + "/" + "9" * 5000, "0/2", "3/2", "1/2/3"], ids=len)
def test_a_wrong_shard_is_reported(folder, shard):
    said = ruedo("campaign", "run", "c.yaml", "--shard", shard, folder=folder, code=3).stderr
    assert said.count("\n") == 1 and "it looks like I/N" in said


def test_a_file_name_that_is_not_utf8_is_reported(folder):
    """Regression: it came to light when the results were written, and they were not."""
    (folder / os.fsdecode(b"stud\xffent.py")).write_text("def ahead(view):\n    return 'done'\n")
    text = CAMPAIGN.replace("name: ahead", "name: ahead, each: 'stud*.py'")
    (folder / "c.yaml").write_text(text.replace("controller.py:ahead", "{file}:ahead"))
    said = ruedo("campaign", "run", "c.yaml", folder=folder, code=3).stderr
    assert said.count("\n") == 1 and "c.yaml:6: " in said and "not UTF-8: rename it" in said


@pytest.mark.parametrize(
    "command, name",
    [
        ("python3 '{file}'", "Maria Lopez.py"),
        ("cd students && python3 \"$(basename '{file}')\"", "a.py"),
        ("(python3 students/a.py)", "a.py"),
        ("python3 students/a.py; true", "a.py"),
    ],
)
def test_a_program_is_run_again_when_it_changes(folder, command, name):
    """Regression: where its name was not a plain word of the command, it was not."""
    (folder / "students").mkdir()
    program = folder / "students" / name
    program.write_text("")
    one = f"name: s, each: 'students/*.py', command: {json.dumps(command)}"
    if "{file}" not in command:
        one = f"name: s, command: {json.dumps(command)}"
    text = CAMPAIGN.replace('name: ahead, python: "controller.py:ahead"', one)
    (folder / "c.yaml").write_text(text)
    before = {case.id for case in Campaign(folder / "c.yaml").cases}
    program.write_text("pass\n")
    assert not before & {case.id for case in Campaign(folder / "c.yaml").cases}


@pytest.mark.parametrize("name", ["my robot", "müller", "_v2.1 (final)"])
def test_a_controller_may_be_called_as_its_file(tmp_path, name):
    """Regression: its campaign could not be read again, as `ruedo why` does."""
    (tmp_path / f"{name}.py").write_text("def drive(view):\n    return 'done'\n")
    (tmp_path / "c.yaml").write_text(
        "worlds: [empty]\nlimits: {duration: 1}\n"
        "controllers: [{name: one, each: '*.py', python: '{file}:drive'}]\n"
    )
    made = Campaign(tmp_path / "c.yaml")
    [case] = made.cases
    assert case.controller == name
    assert [one.id for one in Campaign(made.content, folder=tmp_path).cases] == [case.id]


@pytest.mark.parametrize("text", ["1e9", "2.5e3", "-1E-3", "+.5e2", "1.e+1", "1.0e+9"])
def test_a_number_with_an_exponent_is_one(text):
    """Regression: without a point and a sign it was a text, as YAML 1.1 has it."""
    assert parse_yaml(f"[{text}, '{text}']")[1] == [float(text), text]


@pytest.mark.parametrize("text", ["1e", "e9", "1e9s", "1e9.5", "a1e9", "1 e9", "v1e9", "."])
def test_text_that_is_not_a_number_stays_text(text):
    assert parse_yaml(f"[{text}]")[1] == [text]


def test_written_yaml_reads_as_the_same_value():
    content = {"1e9": ["1e9", 1e9, 1e22, 1e-9, 7, "7", True, "true", None, "caf\u00e9", 0.1]}
    assert parse_yaml(dump_yaml(content))[1] == content


def test_a_command_that_names_no_file_is_reported(folder):
    text = CAMPAIGN.replace('python: "controller.py:ahead"', 'command: "true", lockstep: 1')
    (folder / "c.yaml").write_text(text)
    said = ruedo("campaign", "run", "c.yaml", folder=folder, code=1).stderr
    [told] = [line for line in said.splitlines() if "controller ahead: no file of" in line]
    assert "`inputs`" in told


def test_a_parameter_may_be_a_name_though_it_is_a_number(folder):
    """Regression: a file, a program or a device called so was a traceback."""
    (folder / "5").write_text("")
    text = CAMPAIGN.replace("bold: [false, true]", "bold: [false]\n  g: [5]")
    text = text.replace('python: "controller.py:ahead"', 'command: "{g}"')
    text = text.replace("no_contact: true", "golden: '{g}'")
    text = text.replace("disable: [p3at/camera,", "disable: ['p3at/{g}',")
    (folder / "c.yaml").write_text(text)
    what = Campaign(folder / "c.yaml").cases[0].what
    assert (what["controller"]["command"], what["expect"]["golden"]) == ("5", "5")
    assert what["disable"][0] == "p3at/5"
    (folder / "c.yaml").write_text(text.replace('command: "{g}"', 'python: "{g}"'))
    with pytest.raises(SpecError, match="c.yaml:6: .*is '5'; it looks like FILE.py:NAME"):
        _ = Campaign(folder / "c.yaml").cases
