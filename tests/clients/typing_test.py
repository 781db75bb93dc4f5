"""What users see of the package: names, their documentation, and types. The snippets of the
documentation pass mypy, and pyright where it is installed.
"""

import inspect
import json
import os
import pydoc
import re
import shutil
import subprocess
import sys

import pytest
import ruedo
from conftest import BUILD, SOURCE

PAGES = ("clients.md", "engine.md", "getting-started.md")
SNIPPET = re.compile(r"```python[^\n]*\n(.*?)```", re.DOTALL)


def test_dir_has_what_a_user_should_see_and_nothing_else():
    names = dir(ruedo)
    for name in ("Engine", "launch", "connect", "Map", "Transform", "Joint", "World", "Scan"):
        assert name in names
    for name in (
        "find_spec",
        "SimpleNamespace",
        "TYPE_CHECKING",
        "load_glib",
        "arguments",
        "stream",
    ):
        assert name not in names
    assert not [name for name in names if name.startswith("_") and not name.startswith("__")]


def test_what_is_seen_has_documentation():
    for name in dir(ruedo):
        thing = getattr(ruedo, name)
        if inspect.isclass(thing) or inspect.isfunction(thing):
            assert inspect.getdoc(thing), name
    assert "step_size" in pydoc.render_doc(ruedo.Engine)


def snippets(folder):
    files = []
    for page in PAGES:
        for number, code in enumerate(SNIPPET.findall((SOURCE / "docs" / page).read_text())):
            file = folder / f"{page.replace('.', '_').replace('-', '_')}_{number}.py"
            file.write_text(code)
            files.append(file)
    return files


@pytest.mark.parametrize("checker", ["mypy", "pyright"])
def test_snippets_of_the_documentation_pass_the_type_checkers(checker, tmp_path):
    names = ["mypy"] if checker == "mypy" else ["pyright", "basedpyright"]
    found = [shutil.which(name, path=f"{sys.prefix}/bin") or shutil.which(name) for name in names]
    program = next(filter(None, found), None)
    if not program:
        pytest.skip(f"{checker} is not installed")
    files = snippets(tmp_path)
    assert len(files) > 8
    (tmp_path / "pyrightconfig.json").write_text(
        json.dumps({"typeCheckingMode": "standard", "extraPaths": [str(BUILD / "python")]})
    )
    own = ["--cache-dir", str(tmp_path / "cache"), "--no-error-summary", *files]
    others = ["--pythonpath", sys.executable, "-p", tmp_path]
    done = subprocess.run(
        [program, *(own if checker == "mypy" else others)],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": str(BUILD / "python")},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
