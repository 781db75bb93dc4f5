"""The wheel's program in a bare Debian 12 and 13, made by debootstrap: what was recorded here is
repeated there byte for byte, pictures among it. What was recorded here are the bytes that
tests/golden pins. Client and engine for Python in bare Debians: packaging/try_in_debian.sh.
"""

import os
import shutil
import zipfile
from pathlib import Path

import pytest
from processes import run

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
GOLDEN = SOURCE / "tests/golden"
WORLDS = {"arena": 1.0, "fleet": 1.0, GOLDEN / "wheels.sdf": 1.0, GOLDEN / "camera.sdf": 0.2}
pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="debootstrap and chroot want root")


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """A folder with what the wheel holds; bin/ruedo is below ruedo/."""
    folder = tmp_path_factory.mktemp("wheel")
    for wheel in (BUILD / "wheels").glob("*.whl"):  # of the test package.make_wheel
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(folder / "ruedo")
    for file in (folder / "ruedo/ruedo/bin").iterdir():
        file.chmod(0o755)
    return folder / "ruedo"


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    for world, seconds in WORLDS.items():
        log = folder / f"{Path(world).stem}.lcm"
        run(
            *(BUILD / "bin/ruedo", "run", world, "--rate", "max", "--duration", seconds),
            *("--seed", "7", "--record", log, "--lcm", "memq://"),
        )
    return folder


@pytest.fixture(scope="module", params=["bookworm", "trixie"])
def debian(request):
    """The root of a bare system, fetched once."""
    root = BUILD / "debians" / request.param
    if not (root / "done").exists():
        shutil.rmtree(root, ignore_errors=True)
        root.parent.mkdir(exist_ok=True)
        run("debootstrap", "--variant=minbase", request.param, root)
        (root / "done").touch()
    return root


# In a mount namespace of its own the system has /proc and, at the same place as here, this
# checkout, whose worlds the logs name; no network.
ENTER = """
mount -t proc proc "$0/proc"
mkdir -p "$0$1"
mount --bind "$1" "$0$1"
root=$0
shift
exec chroot "$root" env -i "$@"
"""


def test_it_repeats_what_was_recorded_here(debian, program, logs):
    for folder in (program, logs):
        there = debian / "opt" / folder.name
        shutil.rmtree(there, ignore_errors=True)
        shutil.copytree(folder, there, symlinks=True)
    ruedo = f"/opt/{program.name}/ruedo/bin/ruedo"
    assert len(list(logs.iterdir())) == len(WORLDS)
    for log in logs.iterdir():
        said = run(
            *("unshare", "--net", "--mount", "sh", "-ec", ENTER, debian, SOURCE),
            *(ruedo, "verify", f"/opt/{logs.name}/{log.name}"),
        )
        assert "repeated byte for byte" in said
    for folder in (program, logs):
        shutil.rmtree(debian / "opt" / folder.name)
