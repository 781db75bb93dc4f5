"""ruedo_add_regression() of an installed Ruedo: what it refuses, how words reach the client, and
projects without a language or with old policies."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from processes import run

BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
CMAKE = os.environ.get("CMAKE_COMMAND", "cmake")
WORLD = """<sdf version="1.9"><world name="w"><include><uri>model://p3at</uri></include></world></sdf>
"""


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ruedo") / "prefix"
    run(CMAKE, "--install", BUILD, "--prefix", folder)
    return folder


def configure(
    prefix, folder, lines, *, project="x NONE", minimum="3.22", find="ruedo REQUIRED", code=0
):
    """What CMake says, without its line breaks."""
    (folder / "w.sdf").write_text(WORLD)
    (folder / "CMakeLists.txt").write_text(
        f"cmake_minimum_required(VERSION {minimum})\nproject({project})\n"
        f"find_package({find})\nenable_testing()\n{lines}\n"
    )
    said = run(
        *(CMAKE, "-S", folder, "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={prefix}"), code=code
    )
    return " ".join(said.split())


def commands(folder):
    """{test: its words} as ctest starts them."""
    text = run("ctest", "--test-dir", folder / "build", "--show-only=json-v1")
    return {test["name"]: test["command"] for test in json.loads(text[text.index("{") :])["tests"]}


def literal(word):
    """As CMake reads it to the letter."""
    return f"[==[{word}]==]"


def value(command, option):
    found = [
        command[i + 1] if word == option else word.partition("=")[2]
        for i, word in enumerate(command)
        if word == option or word.startswith(f"{option}=")
    ]
    assert len(found) == 1, command
    return found[0]


GOOD = "NAME gate WORLD w.sdf DURATION 1"
REFUSED = [  # the arguments, what the error says besides the test's name
    *(
        (f"{GOOD} {keys} {word}", rf"{key} has the word '.*', which is not the keyword NO_CONTACT")
        for keys, key in (
            ("CLIENT drive", "CLIENT"),
            ("SCRIPT judge", "SCRIPT"),
            ("GOLDEN g.lcm IGNORE */lrf", "IGNORE"),
            ("OPTIONS --no-noise", "OPTIONS"),
        )
        for word in (
            *("no_contact", '"NO_CONTACT;"', '" no_contact "', '"a;No_Contact;b"'),
            *("$<0:NO_CONTACT>", '"$<0:NO_CONTACT;SEED;3>"', '"$<IF:1,NO_CONTACT,>"'),
        )
    ),
    (f"{GOOD} CLIENT drive seed 3", "CLIENT program ...|meant for the program goes into a line"),
    *(
        (f"{GOOD} {key} ${{typo}}", rf"\b{key} has no value: it is {key} ")
        for key in (
            *("SEED", "LOCKSTEP", "GOLDEN", "ROBOT", "CLEARANCE", "ODOMETRY_ERROR", "TIMEOUT"),
            *("CLIENT", "SCRIPT", "WAIT_FOR", "OPTIONS"),
        )
    ),
    *(
        (f"{GOOD} GOLDEN g.lcm {key} ${{typo}}", rf"\b{key} has no value: it is {key} ")
        for key in ("KEEP", "TOLERANCES", "IGNORE")
    ),
    ("NAME gate WORLD ${typo} DURATION 1", "WORLD has no value: it is WORLD file"),
    ("NAME gate WORLD w.sdf DURATION ${typo}", "DURATION has no value: it is DURATION s"),
    ("NAME gate WORLD w.sdf", "DURATION is missing: it is DURATION s"),
    ("NAME gate DURATION 1", "WORLD is missing: it is WORLD file"),
    (f"{GOOD} GOAL ${{gx}} ${{gy}} RADIUS .3 BY 3", "GOAL has no value: it is GOAL x y RADIUS r"),
    (f"{GOOD} GOAL 1 ${{gy}} RADIUS .3 BY 3", "GOAL has 1 words, not 2: it is GOAL x y RADIUS r"),
    (f"{GOOD} GOAL 1 2 3 RADIUS .3 BY 3", "GOAL has 3 words, not 2: it is GOAL x y RADIUS r"),
    (f"{GOOD} GOAL 1 2 RADIUS .3", "GOAL needs BY: it is GOAL x y RADIUS r BY s"),
    (f"{GOOD} GOAL 1 2 BY 3", "GOAL needs RADIUS: it is GOAL x y RADIUS r BY s"),
    (f"{GOOD} GOAL 1 2 RADIUS ${{r}} BY 3", "RADIUS has no value: it is GOAL x y RADIUS r BY s"),
    (f"{GOOD} RADIUS 1", "RADIUS needs GOAL: it is GOAL x y RADIUS r BY s"),
    (f"{GOOD} BY 1", "BY needs GOAL: it is GOAL x y RADIUS r BY s"),
    (f"{GOOD} GOAL a 2 RADIUS 1 BY 3", "GOAL is 'a': it is GOAL x y RADIUS r BY s"),
    (f"{GOOD} GOAL 1 nan RADIUS 1 BY 3", "GOAL is 'nan'"),
    (f"{GOOD} GOAL 1 2 RADIUS 0 BY 3", "RADIUS is '0': it is GOAL"),
    (f"{GOOD} GOAL 1 2 RADIUS 1 BY soon", "BY is 'soon': it is GOAL"),
    ("NAME gate WORLD w.sdf DURATION long", "DURATION is 'long': it is DURATION s"),
    (f"{GOOD} SEED 1.5", "SEED is '1.5': it is SEED n"),
    (f"{GOOD} LOCKSTEP 0", "LOCKSTEP is '0': it is LOCKSTEP n, a whole number from 1 to 64"),
    (f"{GOOD} CLEARANCE -1", "CLEARANCE is '-1': it is CLEARANCE m"),
    (f"{GOOD} ODOMETRY_ERROR x", "ODOMETRY_ERROR is 'x': it is ODOMETRY_ERROR m"),
    (f"{GOOD} TIMEOUT 0", "TIMEOUT is '0': it is TIMEOUT s"),
    (f'{GOOD} SEED ""', "SEED is '': it is SEED n"),
    (f'{GOOD} ROBOT ""', "ROBOT is '': it is ROBOT name"),
    (f'{GOOD} CLIENT ""', "CLIENT is '': it is CLIENT program words..."),
    (f'{GOOD} CLIENT "  "', "CLIENT is ' ': it is CLIENT program words..."),
    (f'{GOOD} CLIENT "" --fast', "CLIENT is '': it is CLIENT program words..."),
    (f'{GOOD} SCRIPT ""', "SCRIPT is '': it is SCRIPT program words..."),
    (f'{GOOD} OPTIONS ""', "OPTIONS is '': it is OPTIONS options"),
    (f'{GOOD} GOLDEN g KEEP a ""', "KEEP is '': it is KEEP patterns"),
    (f"{GOOD} KEEP a", "KEEP needs GOLDEN"),
    (f"{GOOD} TOLERANCES a:b=abs:1", "TOLERANCES needs GOLDEN"),
    (f"{GOOD} IGNORE a", "IGNORE needs GOLDEN"),
    (f"{GOOD} SEED 1 2", "unknown: '2'"),
    (f"{GOOD} NO_CONTACT CONTACTS", "unknown: 'CONTACTS'"),
    (f"${{typo}} x {GOOD} SEEED 1", "unknown: 'x' 'SEEED' '1'"),
    (f"{GOOD} SEED 1 SEED 2", "SEED is given twice: it is SEED n"),
    (f"{GOOD} CLIENT a SEED 1 CLIENT b", "CLIENT is given twice"),
    *(
        (
            f"{GOOD} OPTIONS --no-noise {option}",
            rf"OPTIONS has {option}, which prints something in place of a run: ",
        )
        for option in ("--help", "-h", "--version")
    ),
    *(
        (
            f"{GOOD} OPTIONS {option}",
            rf"OPTIONS has {re.split('[ =]', option)[0]}\b.*: it is OPTIONS",
        )
        for option in (
            *(
                "--record x.lcm",
                "--seed=3",
                "--duration 5",
                "--client x",
                "--script x",
                "--robot a",
            ),
            *("--lockstep 1", "--clearance 1", "--odometry-error 1", "--no-contact"),
            *("--golden x", "--renew", "--html x"),
        )
    ),
    (f'{GOOD} CLIENT sh -c "a\nb"', "CLIENT holds a line break or a tab"),
    (f'{GOOD} KEEP "a\tb" GOLDEN g', "KEEP holds a line break or a tab"),
    (
        "NAME gate WORLD nowhere.sdf DURATION 1",
        r"WORLD is 'nowhere.sdf', and there is no /.*/nowhere.sdf: it is WORLD file",
    ),
    (
        "NAME gate WORLD /nowhere/w.sdf DURATION 1",
        "WORLD is '/nowhere/w.sdf', and there is no /nowhere/w.sdf: ",
    ),
    ("NAME gate WORLD . DURATION 1", "WORLD is '.', and there is no "),
]


@pytest.mark.parametrize("arguments, text", REFUSED, ids=[case[0] for case in REFUSED])
def test_wrong_arguments_are_refused(prefix, tmp_path, arguments, text):
    """Regression: keywords whose value expanded to nothing were left out, and so passed."""
    said = configure(prefix, tmp_path, f"ruedo_add_regression({arguments})", code=1)
    assert re.search(rf"ruedo_add_regression\(gate\): .*{text}", said), said


@pytest.mark.parametrize(
    "arguments", ["", "WORLD w.sdf DURATION 1", 'NAME "" WORLD w.sdf DURATION 1']
)
def test_a_test_needs_a_name(prefix, tmp_path, arguments):
    said = configure(prefix, tmp_path, f"ruedo_add_regression({arguments})", code=1)
    assert re.search(r"ruedo_add_regression\(\): NAME (is missing|is ''): it is NAME name", said)


@pytest.mark.parametrize(
    "world, given",
    [
        ("w.sdf", "{folder}/w.sdf"),
        ("arena", "{prefix}/share/ruedo/worlds/arena.sdf"),
        ("arena.sdf", "{prefix}/share/ruedo/worlds/arena.sdf"),
        ("${CMAKE_CURRENT_BINARY_DIR}/made later.sdf", "{folder}/build/made later.sdf"),
        ("$<1:/later/w.sdf>", "/later/w.sdf"),
    ],
)
def test_a_world_is_a_file_or_of_ruedo_or_made_by_the_build(prefix, tmp_path, world, given):
    configure(prefix, tmp_path, f'ruedo_add_regression(NAME gate WORLD "{world}" DURATION 1)')
    assert commands(tmp_path)["gate"][2] == given.format(folder=tmp_path, prefix=prefix)


WORDS = [
    *("plain", "", "a b", "a;b", "true; exit 3", "a\\", "\\;b", "c:\\d\\", ";", "[", "x;[", "]]"),
    *("it's", '"quoted"', "$HOME", "${HOME}", "`id`", "<in", ">out", "$<", "a|b&c", "*", "~", "#"),
    *("caf\u00e9", "-x=1", "!", "%PATH%", "@a@", "\\\\", "\\n", "(", "OFF"),
]


def test_arguments_arrive_unchanged(prefix, tmp_path):
    """Regression: what followed `;` was dropped, of the program's words and of its shell's."""
    (tmp_path / "show.py").write_text("import json, sys\nprint(json.dumps(sys.argv[1:]))\n")
    program = [sys.executable, str(tmp_path / "show.py")]
    words = " ".join(literal(word) for word in [*program, *WORDS])
    configure(
        prefix,
        tmp_path,
        f"ruedo_add_regression({GOOD} GOLDEN g.lcm CLIENT {words} SCRIPT {words}\n"
        'OPTIONS --set "a;b" "c\\\\" "d[" "e f" KEEP "a;b" "[ab" c TOLERANCES "x\\\\" IGNORE "y z;")',
    )
    command = commands(tmp_path)["gate"]
    for option in ("--client", "--script"):
        done = subprocess.run(value(command, option), shell=True, capture_output=True, check=True)
        assert json.loads(done.stdout) == WORDS
    at = command.index("--set")
    assert command[at + 1 : at + 5] == ["a;b", "c\\", "d[", "e f"]
    assert [word for word in command if word.startswith("--keep")] == [
        *("--keep=a;b", "--keep=[ab", "--keep=c")
    ]
    assert value(command, "--tolerance") == "x\\" and value(command, "--ignore") == "y z;"


@pytest.mark.parametrize("minimum", ["3.0", "3.22"])
def test_arguments_arrive_unchanged_in_a_run(prefix, tmp_path, minimum):
    """As ctest starts it; with all policies of old, too."""
    (tmp_path / "same.py").write_text(
        "import json, sys\nsys.exit(json.load(open(sys.argv[1])) != sys.argv[2:])\n"
    )
    (tmp_path / "words.json").write_text(json.dumps(WORDS))
    program = [sys.executable, tmp_path / "same.py", tmp_path / "words.json"]
    words = " ".join(literal(word) for word in [*program, *WORDS])
    configure(
        prefix,
        tmp_path,
        f"ruedo_add_regression(NAME words WORLD w.sdf DURATION 1 CLIENT {words} SCRIPT {words}\n"
        "OPTIONS --no-client-wait)\n"
        'ruedo_add_regression(NAME three WORLD w.sdf DURATION 1 '
        'CLIENT sh -c "true; exit 3")',
        minimum=minimum,
    )
    said = run("ctest", "--test-dir", tmp_path / "build", "--output-on-failure", code=8)
    assert re.search(r"Test +#1: words \.* +Passed", said), said
    assert "the client ended with exit code 3" in said, said


@pytest.mark.parametrize(
    "client, line",
    [
        ('"echo a | cat; true"', "echo a | cat; true"),
        ('"SPEED=0.1 python3 x.py"', "SPEED=0.1 python3 x.py"),
        ("python3 x.py", "python3 x.py"),
        ("SPEED=0.1 python3 x.py", "SPEED=0.1 python3 x.py"),
        ("program", "program"),
        ('"${CMAKE_CURRENT_SOURCE_DIR}/my client"', "'{folder}/my client'"),
        ('"$<1:/a b>"', "'/a b'"),
        ('"$<1:/a> | cat"', "/a | cat"),
        ('sh "$<1:/a b>/c" "$<1:it\'s>"', "sh '/a b/c' 'it'\\''s'"),
        ("robot", "'{folder}/build/robot'"),
        ("$<TARGET_FILE:robot> -v", "'{folder}/build/robot' -v"),
    ],
)
def test_one_argument_with_shell_characters_is_a_command_line(prefix, tmp_path, client, line):
    (tmp_path / "my client").write_text("")
    (tmp_path / "robot.c").write_text("int main() { return 0; }")
    robot = "add_executable(robot robot.c)\n" if "robot" in client else ""
    configure(
        prefix,
        tmp_path,
        f"{robot}ruedo_add_regression({GOOD} CLIENT {client})",
        project="x C" if robot else "x NONE",
    )
    assert value(commands(tmp_path)["gate"], "--client") == line.format(folder=tmp_path)


def test_everything_together_is_taken(prefix, tmp_path):
    configure(
        prefix,
        tmp_path,
        f"ruedo_add_regression({GOOD} SEED 0 LOCKSTEP 2 GOLDEN goldens/g.lcm KEEP a KEEP b ROBOT p3at "
        "GOAL -1.5 2e-1 RADIUS .3 BY 3. NO_CONTACT CLEARANCE 0 ODOMETRY_ERROR 1 TIMEOUT 7.5 "
        "WAIT_FOR a@1 b@2 OPTIONS --spawn p3at@1,2 --json v.json --goal=1,2,3,4)",
    )
    command = commands(tmp_path)["gate"]
    assert command[:2] == [str(prefix / "bin/ruedo"), "regress"]
    assert value(command, "--golden") == f"{tmp_path}/goldens/g.lcm"
    assert {
        *("--seed=0", "--lockstep=2", "--robot=p3at", "--clearance=0", "--no-contact"),
        *("--goal=-1.5,2e-1,.3,3.", "--keep=a", "--keep=b", "--wait-for=a@1", "--wait-for=b@2"),
    } < set(command)
    assert command[-5:] == ["--spawn", "p3at@1,2", "--json", "v.json", "--goal=1,2,3,4"]


@pytest.mark.parametrize(
    "project, components, missing",
    [
        ("x NONE", "", ""),
        ("x NONE", "COMPONENTS regression", ""),
        ("x CXX", "COMPONENTS regression client engine lcmtypes", ""),
        ("x C", "COMPONENTS client", ""),
        ("x NONE", "OPTIONAL_COMPONENTS client gui", ""),
        ("x NONE", "COMPONENTS gui", "unknown component gui: there are regression, client, engine"),
        ("x NONE", "COMPONENTS client", "the component client needs a language: project.*CXX"),
    ],
)
def test_components(prefix, tmp_path, project, components, missing):
    said = configure(
        prefix,
        tmp_path,
        "",
        project=project,
        minimum="3.0",
        find=f"ruedo REQUIRED {components}",
        code=1 if missing else 0,
    )
    assert re.search(missing, said), said
    assert not missing or "considered to be NOT FOUND" in said


def test_a_project_configures_without_optional_components(prefix, tmp_path):
    said = configure(
        prefix,
        tmp_path,
        'message("found ${ruedo_FOUND}, gui ${ruedo_gui_FOUND}, client ${ruedo_client_FOUND}")\n'
        "cmake_policy(GET CMP0110 policy)\nif(policy STREQUAL NEW)\n  message(FATAL_ERROR x)\nendif()",
        minimum="3.0",
        find="ruedo COMPONENTS regression OPTIONAL_COMPONENTS gui client",
        project="x CXX",
    )
    assert re.search(r"found (1|TRUE), gui (0|FALSE)?, client (1|TRUE)", said), said


@pytest.mark.parametrize("program", ["./drive.sh", "sub/drive.sh", "../{}/drive.sh"])
def test_a_relative_program_is_beside_the_file(prefix, tmp_path, program):
    """As in pytest; ctest starts it in a folder of the test's own."""
    program = program.format(tmp_path.name)
    (tmp_path / "sub").mkdir()
    file = tmp_path / program
    file.write_text("#!/bin/sh\nexit 7\n")
    file.chmod(0o755)
    configure(prefix, tmp_path, f"ruedo_add_regression({GOOD} CLIENT {program} a b)")
    line = value(commands(tmp_path)["gate"], "--client")
    assert line == f"{file.resolve()} a b"
    said = run("ctest", "--test-dir", tmp_path / "build", "--output-on-failure", code=8)
    assert "the client ended with exit code 7" in said
