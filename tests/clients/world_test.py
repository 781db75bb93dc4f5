"""Models that come and go, over the wire, in each language: the probes see known numbers."""

import pytest
from conftest import HERE, PATIENCE, probe, ruedo_run

HALL = str(HERE / "hall.sdf")
BALL = (
    "<sdf version='1.9'><model name='ball'><link name='link'><inertial><mass>1</mass>"
    "<inertia><ixx>0.004</ixx><iyy>0.004</iyy><izz>0.004</izz></inertia></inertial>"
    "<collision name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link></model></sdf>"
)


def test_models_come_and_go(language):
    with ruedo_run("--no-noise", "--disable", "p3at/camera", world=HALL) as server:
        said = probe(language, server.url, "world", BALL)
    x, robots, bodies = said.numbers("there")
    assert (x, robots) == (pytest.approx(3.0, abs=1e-9), 2) and bodies >= 1
    assert said.words("drives") == [
        "True",
        "181",
    ]  # the new robot takes commands, and its scans come
    assert said.numbers("put") == pytest.approx([2.0], abs=1e-9)
    assert said.words("rolls") == ["True"]
    assert said.one("taken").startswith("RequestError: SPAWN: ") and "'guest' is taken" in said.one(
        "taken"
    )
    assert "it would stand in 'guest'" in said.one("room")
    assert "the text" in said.one("text")
    assert "has a drive" in said.one("driven")
    y, goes_on = said.words("poses")
    assert (float(y), goes_on) == (pytest.approx(1.0, abs=1e-9), "True")
    assert said.words("time") == ["True", "2"]
    assert said.words("gone") == ["1", "0"]
    assert "no model called 'guest'" in said.one("unknown")


def test_snapshots_and_the_names_of_spawned_models(language, tmp_path):
    with ruedo_run(
        "--paused", "--disable", "p3at/camera", "--snapshots", str(tmp_path), world=HALL
    ) as server:
        said = probe(language, server.url, "snapshots")
    assert said.words("names") == ["p3at_2", "p3at_3", "guest"]
    assert said.words("same") == ["True", "True", "True"]
    first, last = (int(word) for word in said.words("steps"))
    assert last - first == 60


def test_errors_of_a_spawned_robots_sensor_are_reported():
    """By the server: it is made when the robot enters."""
    import ruedo

    text = (
        "<sdf version='1.9'><model name='m'><link name='l'><sensor name='s' type='imu'>"
        "<update_rate>nan</update_rate></sensor></link></model></sdf>"
    )
    with (
        ruedo_run("--disable", "p3at/camera", world=HALL) as server,
        ruedo.connect(server.url, timeout=PATIENCE) as sim,
    ):
        sim.spawn(text=text, x=3, y=3)
        said = server.end()
    assert "'nan' is not a rate" in said and "the sensor is left out" in said
