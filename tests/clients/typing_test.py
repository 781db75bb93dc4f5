"""What users see of the package: names, their documentation, and types. The snippets of the
documentation pass mypy and pyright (of basedpyright, which brings its Node.js along).
"""

import ast
import importlib
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

# protocol.md has programs of plain LCM: the modules that lcm-gen makes have no types.
PAGES = sorted(page for page in (SOURCE / "docs").rglob("*.md") if page.name != "protocol.md")
SNIPPET = re.compile(r"^```python[^\n]*\n(.*?)^```", re.DOTALL | re.MULTILINE)
UNTYPED = (  # what the tests do not install
    "stable_baselines3",
    "torchrl/collectors",
    "torchrl/envs",
)


# As pyright checks without settings; lcm's and others' modules come without their sources.
STANDARD = {"typeCheckingMode": "standard", "reportMissingModuleSource": False}


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


def test_names_are_those_that_type_checkers_see():
    """They are loaded by name; checkers read the imports."""
    tree = ast.parse((SOURCE / "clients/python/ruedo/__init__.py").read_text())
    checked = next(node for node in tree.body if isinstance(node, ast.If))
    homes = {
        (one.asname or one.name): node.module
        for node in checked.body
        if isinstance(node, ast.ImportFrom)
        for one in node.names
        if one.name != "*"
    }
    listed = ast.literal_eval(
        next(node for node in checked.body if isinstance(node, ast.Assign)).value
    )
    assert set(listed) <= set(homes)
    generated = {*ruedo.samples.__all__, *ruedo.vocabulary.__all__}
    hidden = {"samples", "vocabulary", "OccupancyMap"}
    assert set(ruedo.__all__) | hidden == set(homes) | generated
    for name, home in homes.items():
        thing = getattr(ruedo, name)
        assert thing is getattr(importlib.import_module(f"ruedo.{home or name}"), name, thing), name
    assert not hasattr(ruedo, "no_such_name")


@pytest.mark.parametrize(
    "program",
    [
        "import ruedo",
        "import ruedo, ruedo.regression",  # by each pytest
        "import ruedo; ruedo.find_ruedo; ruedo.World; ruedo.NoServer",
        # launch() starts the server first.
        "import ruedo, subprocess\n"
        "def started(*command, **options): raise OSError(0, 'nothing')\n"
        "subprocess.Popen = started\n"
        "try: ruedo.launch('arena')\n"
        "except ruedo.LaunchError: pass\n",
    ],
)
def test_numpy_is_loaded_where_it_is_used(program):
    done = subprocess.run(
        [sys.executable, "-c", program + "\nimport sys; print('numpy' in sys.modules)"],
        capture_output=True,
        text=True,
    )
    assert (done.stdout, done.stderr) == ("False\n", "")


def test_public_names_have_documentation():
    for name in dir(ruedo):
        thing = getattr(ruedo, name)
        if inspect.isclass(thing) or inspect.isfunction(thing):
            assert inspect.getdoc(thing), name
    assert "step_size" in pydoc.render_doc(ruedo.Engine)


def test_each_method_has_documentation_and_plain_names():
    """No parameter hides one of Python's own: `type`, `set`, `id`."""
    for name in dir(ruedo):
        kind = getattr(ruedo, name)
        if not inspect.isclass(kind) or issubclass(kind, (Exception, str)):
            continue
        for attribute, thing in inspect.getmembers_static(kind):
            of = getattr(thing, "__func__", thing)  # of static methods and those of classes
            if attribute.startswith("_") or not (
                inspect.isfunction(of) or isinstance(of, property)
            ):
                continue
            assert inspect.getdoc(of), f"{name}.{attribute}"
            if inspect.isfunction(of):
                taken = {"type", "set", "id"} & set(inspect.signature(of).parameters)
                assert not taken, f"{name}.{attribute}"


def test_dir_of_the_environments_has_no_modules():
    import ruedo.gym

    assert "FleetEnv" in dir(ruedo.gym) and "NavigateEnv" in dir(ruedo.gym)
    assert not [name for name in dir(ruedo.gym) if inspect.ismodule(getattr(ruedo.gym, name))]


def snippets(folder):
    files = []
    for page in PAGES:
        name = "_".join(page.relative_to(SOURCE / "docs").with_suffix("").parts).replace("-", "_")
        for number, code in enumerate(SNIPPET.findall(page.read_text())):
            file = folder / f"{name}_{number}.py"
            file.write_text(code)
            files.append(file)
    for module in UNTYPED:
        stub = folder / "stubs" / module / "__init__.pyi"
        stub.parent.mkdir(parents=True)
        stub.write_text("from typing import Any\n\ndef __getattr__(name: str) -> Any: ...\n")
    return files


@pytest.mark.parametrize("checker", ["mypy", "pyright"])
def test_snippets_of_the_documentation_pass_the_type_checkers(checker, tmp_path):
    name = "mypy" if checker == "mypy" else "basedpyright"
    program = shutil.which(name, path=f"{sys.prefix}/bin") or shutil.which(name)
    assert program, f"{name} is not installed: scripts/requirements.txt has it"
    files = snippets(tmp_path)
    assert len(files) > 30
    settings = {"extraPaths": [str(BUILD / "python")], "stubPath": "stubs", **STANDARD}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    own = ["--cache-dir", str(tmp_path / "cache"), "--follow-imports=silent", *files]
    others = ["--pythonpath", sys.executable, "-p", tmp_path]
    done = subprocess.run(
        [program, *(own if checker == "mypy" else others)],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": f"{BUILD / 'python'}:{tmp_path / 'stubs'}"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
