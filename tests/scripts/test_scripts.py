"""scripts/lib.sh with stand-ins for apt and dpkg: which packages are requested, by which command,
and when nothing is done.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[2]
NOBODY = 65534

DPKG_QUERY = """#!/bin/bash
for name in "${@:3}"; do grep -qx "$name" "$WORLD/installed" && echo "installed $name"; done
"""
APT_CACHE = """#!/bin/bash
for name in "${@:3}"; do grep -qx "$name" "$WORLD/known" && echo "Package: $name"; done
"""
APT_GET = """#!/bin/bash
echo "$*" >>"$WORLD/calls"
if [[ $1 == update ]]; then cp "$WORLD/on_the_mirror" "$WORLD/known"; fi
"""
SUDO_REFUSED = "#!/bin/bash\nexit 1\n"


class Machine:
    """A folder with stand-ins for the package tools, and what they know."""

    def __init__(self, installed, known, on_the_mirror):
        self.folder = Path(tempfile.mkdtemp(prefix="ruedo-scripts-"))
        self.folder.chmod(0o777)
        shutil.copytree(ROOT / "scripts", self.folder / "scripts")
        for name, text in {
            "dpkg-query": DPKG_QUERY,
            "apt-cache": APT_CACHE,
            "apt-get": APT_GET,
            "sudo": SUDO_REFUSED,
        }.items():
            path = self.folder / "bin" / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
            path.chmod(0o755)
        for name, packages in {
            "installed": installed,
            "known": known,
            "on_the_mirror": on_the_mirror,
            "calls": [],
        }.items():
            (self.folder / name).write_text("".join(p + "\n" for p in packages))
            (self.folder / name).chmod(0o666)

    def ensure(self, *specifications, user=None):
        """Runs ensure_packages and returns (exit code, output, calls of apt-get)."""
        environment = {
            **os.environ,
            "PATH": f"{self.folder / 'bin'}:{os.environ['PATH']}",
            "WORLD": str(self.folder),
        }
        command = [
            "bash",
            "-c",
            'set -euo pipefail; source "$WORLD/scripts/lib.sh"; ensure_packages "$@"',
            "x",
            *specifications,
        ]
        result = subprocess.run(
            command,
            env=environment,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            user=user,
            cwd=self.folder,
        )
        return result.returncode, result.stdout, (self.folder / "calls").read_text().splitlines()


@pytest.fixture
def machine():
    made = []

    def make(installed=(), known=(), on_the_mirror=None):
        made.append(Machine(installed, known, known if on_the_mirror is None else on_the_mirror))
        return made[-1]

    yield make
    for each in made:
        shutil.rmtree(each.folder)


as_root = pytest.mark.skipif(os.geteuid() != 0, reason="needs root to be root and to become nobody")


def test_installed_packages_are_not_requested(machine):
    assert machine(installed=["a", "new_b", "c"]).ensure("a", "old_b|new_b", "?c") == (0, "", [])


@as_root
def test_one_call_installs_missing_packages(machine):
    code, _, calls = machine(installed=["a"], known=["a", "b", "c"]).ensure("a", "b", "c")
    assert code == 0
    assert calls == ["update -q", "install --no-install-recommends -y -q b c"]


@as_root
def test_alternatives_and_optional_ones_follow_the_distribution(machine):
    _, _, calls = machine(known=["new_b"]).ensure("old_b|new_b", "?gone")
    assert calls[-1].endswith("-q new_b")
    _, _, calls = machine(known=["old_b", "new_b", "kept"]).ensure("old_b|new_b", "?kept")
    assert calls[-1].endswith("-q old_b kept")


@as_root
def test_fresh_machine_learns_names_from_the_update(machine):
    _, _, calls = machine(known=[], on_the_mirror=["old_b", "kept"]).ensure(
        "old_b|new_b", "?kept", "?gone"
    )
    assert calls[-1].endswith("-q old_b kept")


def test_an_unknown_optional_package_is_not_requested(machine):
    assert machine(installed=["a"], known=["a"]).ensure("a", "?gone") == (0, "", [])


def test_without_rights_the_line_to_ask_for_is_printed(machine):
    user = NOBODY if os.geteuid() == 0 else None
    code, output, calls = machine(installed=["a"], known=["a", "b", "c"]).ensure(
        "a", "b", "c", user=user
    )
    assert code == 4
    assert "    apt-get install --no-install-recommends -y b c\n" in output
    assert calls == []


def test_help_installs_nothing():
    result = subprocess.run([ROOT / "scripts/test", "--help"], capture_output=True, text=True)
    assert result.returncode == 0 and "--sanitizers" in result.stdout


def known_tests(*options):
    command = ["ctest", "--test-dir", os.environ["RUEDO_BINARY_DIR"], "-N", *options]
    return re.findall(r"Test +#\d+: (\S+)", subprocess.check_output(command, text=True))


def test_the_tiers_name_tests_that_there_are():
    """A test that is renamed would else move into the gate."""
    names = known_tests("-C", "Nightly")
    for line in (ROOT / "tests/tiers.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            tier, *patterns = line.split()
            assert tier in ("all", "nightly")
            for pattern in patterns:
                assert any(re.fullmatch(pattern, name) for name in names), pattern


def test_the_gate_leaves_out_what_the_tiers_say():
    """ctest runs everything if it cannot compile the expression that leaves tests out."""
    left_out = subprocess.run(
        ["bash", "-c", '. "$0" && tests_of all nightly', ROOT / "scripts/lib.sh"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    gate = known_tests("-E", left_out)
    assert len(gate) > 1000 and not [name for name in gate if re.fullmatch(left_out, name)]


@pytest.mark.skipif(not shutil.which("gpg"), reason="gpg is not installed")
def test_a_release_is_signed_by_the_key_of_the_environment(tmp_path):
    sums, home = tmp_path / "SHA256SUMS", Path(tempfile.mkdtemp())  # a short path, for gpg's socket
    sums.write_text("of a release\n")
    sums.with_suffix(".minisig").write_text("of an earlier release\n")
    environment = os.environ | {"GNUPGHOME": str(home), "RUEDO_MINISIGN_KEY": ""}
    key = ["--pinentry-mode", "loopback", "--passphrase", "", "--quick-gen-key", "me@example.org"]
    subprocess.run(["gpg", "--batch", "--quiet", *key], env=environment, check=True)

    def sign(key: str) -> subprocess.CompletedProcess:
        return subprocess.run(
            ["bash", "-c", '. "$0" && sign "$1"', ROOT / "scripts/lib.sh", sums],
            env=environment | {"RUEDO_GPG_KEY": key},
            capture_output=True,
            text=True,
        )

    try:
        assert sign("").returncode == 0 and os.listdir(tmp_path) == ["SHA256SUMS"]
        refused = sign("other@example.org")
        assert refused.returncode == 4
        assert "gpg could not sign with the key other@example.org" in refused.stderr
        assert sign("me@example.org").returncode == 0
        signature = f"{sums}.asc"
        verify = ["gpg", "--quiet", "--verify", signature, sums]
        assert subprocess.run(verify, env=environment, capture_output=True).returncode == 0
        sums.write_text("of another release\n")
        assert subprocess.run(verify, env=environment, capture_output=True).returncode != 0
    finally:
        subprocess.run(["gpgconf", "--kill", "all"], env=environment, check=False)
        shutil.rmtree(home)


def test_failed_tests_are_listed_at_the_end(tmp_path):
    (tmp_path / "CTestTestfile.cmake").write_text("""
add_test(good "true")
add_test(bad "sh" "-c" "seq 100; printf 'red <&]]>'; exit 3")
add_test(late "sh" "-c" "echo begun; sleep 1000")
set_tests_properties(late PROPERTIES TIMEOUT 300 TIMEOUT_AFTER_MATCH "1;begun")
""")
    report = tmp_path / "tests.xml"
    assert (
        subprocess.run(
            ["ctest", "--output-junit", report], cwd=tmp_path, capture_output=True
        ).returncode
        != 0
    )
    told = subprocess.run(
        [sys.executable, ROOT / "scripts/failed_tests.py", report],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    first, *output = told.splitlines()
    assert (
        first.startswith("--- bad failed after ")
        and output[:2] == ["42", "43"]
        and output[59] == "red <&]]>"
    )
    assert output[60].startswith("--- late failed after ") and output[61:] == ["begun", "---"]


def test_tests_that_began_anew_are_counted_in_the_report(tmp_path):
    (tmp_path / "CTestTestfile.cmake").write_text('add_test(good "true")\n')
    report, repeats = tmp_path / "tests.xml", tmp_path / "repeats.txt"
    subprocess.run(
        ["ctest", "--output-junit", report], cwd=tmp_path, capture_output=True, check=True
    )
    repeats.write_text("b_test.py::two\na_test.py::one\nb_test.py::two\n")
    subprocess.run([sys.executable, ROOT / "scripts/count_repeats.py", report, repeats], check=True)
    suite = ElementTree.parse(report).getroot()
    assert [case.get("name") for case in suite.iter("testcase")] == ["good"]
    assert {one.get("name"): one.get("value") for one in suite.iter("property")} == {
        "begun anew": "3",
        "begun anew: a_test.py::one": "1",
        "begun anew: b_test.py::two": "2",
    }
