"""Each number and word of worlds that have some of everything, replaced by values that no robot
needs, one at a time: check and run neither crash nor hang, and say the same. Some 20 000 runs, so
nightly alone.
"""

import os
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

RUEDO = os.environ["RUEDO"]
SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
ET.register_namespace("ruedo", "urn:ruedo")

WORLDS = [
    *(f"worlds/{name}.sdf" for name in ("arena", "crossing", "rooms", "warehouse")),
    *(f"tests/golden/{name}.sdf" for name in ("arms", "camera", "wheels")),
    *(f"tests/bridges/ros2/{name}.sdf" for name in ("instruments", "links", "sensors")),
    "tests/console/senses.sdf",
    *(
        f"worlds/robots/{name}/model.sdf"
        for name in ("car", "carrier", "crawler", "mecanum", "omni", "p3at", "tricycle")
    ),
]
NUMBERS = (
    *("1e300", "-1e300", "1e18", "1e9", "1e-9", "1e-300", "0", "-0.0", "-1", "nan", "inf"),
    *("9223372036854775807", "0x10", "1,5", "0.5 0.5", "1 2 3 4 5 6 7"),
)
WORDS = ("", "abc")
PATIENCE_S = 60


def world_of(path):
    """The file's tree; a model stands in a world of its own."""
    text = path.read_text(encoding="utf-8")
    if "xmlns:ruedo" not in text:
        text = text.replace("<sdf ", '<sdf xmlns:ruedo="urn:ruedo" ', 1)
    root = ET.fromstring(text)
    if root.find("world") is None:
        world = ET.Element("world", name="w")
        world.extend(list(root))
        root[:] = [world]
    return root


def places_of(element, path=""):
    """{path: (element, attribute or None for its text)}: the first of each path."""
    path = f"{path}/{element.tag}"
    places = {f"{path}@{name}": (element, name) for name in element.attrib}
    if len(element) == 0 and (element.text or "").strip():
        places[path] = (element, None)
    for child in element:
        for inner, place in places_of(child, path).items():
            places.setdefault(inner, place)
    return places


def put(place, value):
    element, attribute = place
    if attribute is None:
        element.text = value
    else:
        element.attrib[attribute] = value


def ruedo(*arguments):
    """The exit code, or what went wrong."""
    try:
        done = subprocess.run([RUEDO, *arguments], capture_output=True, timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        return f"no end after {PATIENCE_S} s"
    return done.returncode if done.returncode >= 0 else f"signal {-done.returncode}"


@pytest.mark.parametrize("name", WORLDS)
def test_every_value(name):
    original = SOURCE / name
    root = world_of(original)
    file = original.with_name(f"every-value-{os.getpid()}.sdf")  # beside what it includes
    odd = []
    try:
        for path, place in places_of(root).items():
            element, attribute = place
            before = element.text if attribute is None else element.attrib[attribute]
            for value in NUMBERS + WORDS:
                put(place, value)
                file.write_bytes(ET.tostring(root))
                check = ruedo("check", str(file))
                run = ruedo(
                    *("run", str(file), "--quiet", "--rate", "max"),
                    *("--duration", "0.1", "--lcm", "memq://"),
                )
                if (check, run) not in ((0, 0), (1, 0), (3, 3)):
                    odd.append(f"{path} = {value!r}: check {check}, run {run}")
            put(place, before)
    finally:
        file.unlink(missing_ok=True)
    assert not odd, "\n".join(odd)
