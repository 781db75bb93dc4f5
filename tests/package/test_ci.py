"""docs/ci: the steps of each file, as its service would run them, on the example project with the
wheel. Checkout, Python and the upload are the services' own."""

import json
import os
import re
import shutil
import sys
import sysconfig
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml
from processes import run

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
CI = SOURCE / "docs/ci"
ACTION = yaml.safe_load((SOURCE / ".github/actions/regress/action.yml").read_text())


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """PATH with the Python of a virtual environment that has the wheel and what it depends on, so
    that pip fetches nothing."""
    folder = tmp_path_factory.mktemp("ci")
    run(sys.executable, "-m", "venv", folder / "venv")
    python = folder / "venv/bin/python"
    words = ["-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    run(python, *words, *(BUILD / "wheels").glob("*.whl"))
    packages = next(folder.glob("venv/lib/python*/site-packages"))
    (packages / "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return f"{folder}/venv/bin:{os.environ['PATH']}"


@pytest.fixture
def project(tmp_path):
    """The example, with golden logs of its own making, so that the first run has to pass."""
    shutil.copytree(SOURCE / "docs/example-project", tmp_path / "project")
    return tmp_path / "project"


def steps_of(job):
    """The scripts of a job on GitHub; our action's with its inputs."""
    for step in job["steps"]:
        uses = step.get("uses", "")
        if not uses.startswith("OWNER/ruedo/.github/actions/regress@"):
            assert re.fullmatch(r"actions/(checkout|setup-python)@v\d+", uses)
            continue
        given = {name: about["default"] for name, about in ACTION["inputs"].items()}
        given |= step.get("with", {})
        assert set(given) == set(ACTION["inputs"])
        for part in ACTION["runs"]["steps"]:
            if "run" in part:
                assert part["shell"] == "bash"
                text = part["run"]
                for name, value in given.items():
                    text = text.replace("${{ inputs." + name + " }}", value)
                assert "${{" not in text
                yield text


def github(name):
    return list(steps_of(yaml.safe_load((CI / name).read_text())["jobs"]["regressions"]))


SCRIPTS = {
    "github.yml": github("github.yml"),
    "github-ctest.yml": github("github-ctest.yml"),
    "gitlab.yml": yaml.safe_load((CI / "gitlab.yml").read_text())["regressions"]["script"],
}


@pytest.mark.parametrize("name", SCRIPTS)
def test_its_steps_pass_and_fail_with_the_project(name, path, project):
    more = {"PATH": path, "PIP_NO_INDEX": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    words = ("bash", "-eo", "pipefail", "-c")
    *before, last = SCRIPTS[name]
    for script in before:
        run(*words, script, cwd=project, more=more)
    run(*words, last, cwd=project, more={**more, "RUEDO_RENEW": "1"})
    run(*words, last, cwd=project, more=more)
    suite = ElementTree.parse(project / "ruedo-results/junit.xml").getroot()
    assert suite.findall(".//testcase") and not suite.findall(".//failure")
    # A program that does nothing is a red test with a page.
    (project / "through_the_gate.py").write_text("import ruedo\nruedo.connect(timeout=30)\n")
    (project / "through_the_gate.cpp").write_text("int main() { return 3; }\n")
    run(*words, last, cwd=project, more=more, code=None)
    suite = ElementTree.parse(project / "ruedo-results/junit.xml").getroot()
    assert suite.findall(".//failure")
    upload = ACTION["runs"]["steps"][-1]["with"]["path"].split()
    if name == "gitlab.yml":
        upload = yaml.safe_load((CI / name).read_text())["regressions"]["artifacts"]["paths"]
    assert [file for pattern in upload for file in project.glob(pattern) if file.suffix == ".html"]


def test_the_container_files_agree():
    container = json.loads((CI / "devcontainer.json").read_text())
    assert (CI / container["build"]["dockerfile"]).is_file()
    text = (CI / "Containerfile").read_text()
    assert "pip install --no-cache-dir 'ruedo[camera]'" in text
