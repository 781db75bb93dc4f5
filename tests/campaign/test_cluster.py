"""A Ray cluster of several nodes on this machine: the same table, with one node, with three, and
with one of them killed.
"""

import csv
import os
import re
import shutil
import subprocess
import threading
import time

import pytest
from conftest import (
    BUILD,
    CAMPAIGN,
    CONTROLLER,
    PATIENCE,
    RUEDO,
    WORLD,
    results_in,
    ruedo,
    table,
    wait_for,
)

os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
import ray
from ray.cluster_utils import Cluster
from ruedo import _engine
from ruedo.campaign import Campaign, CampaignError


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A folder in which the campaign was run without Ray, and its table."""
    folder = tmp_path_factory.mktemp("cluster")
    for name, text in (("world.py", WORLD), ("controller.py", CONTROLLER), ("c.yaml", CAMPAIGN)):
        (folder / name).write_text(text)
    ruedo("campaign", "run", "c.yaml", folder=folder, code=1)
    return folder, table(folder)


def new_node(cluster, **options):
    """Ray gives a node 30 s to start: too few on a machine that does much else."""
    for _ in range(5):
        try:
            return cluster.add_node(num_cpus=1, object_store_memory=100 << 20, **options)
        except Exception as error:
            if "timed out during startup" not in str(error):
                raise
            said = error
    raise said


@pytest.fixture
def cluster():
    made = Cluster()
    new_node(made, include_dashboard=False)
    yield made
    ray.shutdown()
    made.shutdown()


def test_one_node_gives_the_same_bytes(whole, cluster):
    folder, expected = whole
    ruedo(
        "campaign",
        "run",
        "c.yaml",
        "--ray",
        cluster.address,
        "--out",
        "ray1",
        "--quiet",
        folder=folder,
        code=1,
    )
    assert table(folder, "--out", "ray1") == expected
    log = next((folder / "ray1/logs").iterdir())
    assert (
        "repeated byte for byte" in ruedo("verify", log, folder=folder).stdout
    )  # it names the files here


def test_three_nodes_of_which_one_is_killed_give_the_same_bytes(whole, cluster):
    folder, expected = whole
    nodes = [new_node(cluster) for _ in range(2)]
    cluster.wait_for_nodes()
    ray.init(address=cluster.address, log_to_driver=False)
    killed = []

    def kill_one(case, outcome):
        if not killed:
            killed.append(
                threading.Thread(
                    target=cluster.remove_node, args=(nodes[0],), kwargs={"allow_graceful": False}
                )
            )
            killed[0].start()

    campaign = Campaign(folder / "c.yaml", out=folder / "ray3")
    campaign.run(ray=cluster.address, progress=kill_one)
    killed[0].join()
    until = time.monotonic() + PATIENCE
    while sum(node["Alive"] for node in ray.nodes()) != 2:  # the head takes a moment to see it
        assert time.monotonic() < until
        time.sleep(0.05)
    assert table(folder, "--out", "ray3") == expected


def test_a_lost_head_node_is_one_line_and_loses_nothing(whole, cluster):
    folder, expected = whole
    out = folder / "headless"
    hold = folder / "hold"
    hold.touch()
    (folder / "held.py").write_text(CONTROLLER.replace('"HOLD", ""', f'"HOLD", {str(hold)!r}'))
    (folder / "held.yaml").write_text(CAMPAIGN.replace("controller.py", "held.py"))
    command = [RUEDO, "campaign", "run", "held.yaml", "--ray", cluster.address, "--out", str(out)]
    driver = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: results_in(out) >= 1)
    cluster.head_node.kill_all_processes(check_alive=False, allow_graceful=False)
    _, said = driver.communicate(timeout=PATIENCE)
    assert driver.returncode == 4
    (line,) = said.splitlines()
    assert re.match(
        "ruedo: the Ray cluster was lost: its head node [0-9.:]+ does not answer; finished cases are "
        "kept, `ruedo campaign resume` runs the others",
        line,
    )
    assert 1 <= results_in(out) <= 2
    hold.unlink()
    ruedo("campaign", "resume", "held.yaml", "--out", out, folder=folder, code=1)
    resumed = table(folder, "--out", str(out), file="held.yaml")
    (folder / "held.py").unlink()  # what lies beside a controller is a part of its cases
    assert outcomes(resumed) == outcomes(expected)


def outcomes(text):
    return [(row["number"], row["reason"]) for row in csv.DictReader(text.splitlines())]


def test_no_cluster_is_one_line(whole):
    folder, _ = whole
    done = ruedo(
        "campaign",
        "run",
        "c.yaml",
        "--ray",
        "127.0.0.1:1",
        "--out",
        "none",
        "--quiet",
        folder=folder,
        code=4,
    )
    assert "no cluster answers" in done.stderr.splitlines()[-1]


@pytest.fixture
def other_build(tmp_path):
    """A second installed tree, of a build that differs in its build id."""
    for part in ("python", "math"):
        shutil.copytree(BUILD / part, tmp_path / "other" / part)
    ours = re.search(r"build ([0-9a-f]{40})", str(_engine.build)).group(1)
    theirs = ours[::-1]
    library = tmp_path / "other/math/libruedo_core.so"
    bytes_ = library.read_bytes()
    assert bytes_.count(bytes.fromhex(ours)) == 1
    library.write_bytes(bytes_.replace(bytes.fromhex(ours), bytes.fromhex(theirs)))
    return tmp_path / "other", theirs


def test_two_builds_on_two_nodes_are_one_line(whole, other_build):
    folder, _ = whole
    tree, theirs = other_build
    head = {"num_cpus": 0, "object_store_memory": 100 << 20, "include_dashboard": False}
    cluster = Cluster(initialize_head=True, head_node_args=head)
    try:
        cluster.add_node(
            num_cpus=1,
            object_store_memory=100 << 20,
            env_vars={"PYTHONPATH": f"{tree}/python", "LD_LIBRARY_PATH": f"{tree}/math"},
        )
        cluster.wait_for_nodes()
        command = ["campaign", "run", "c.yaml", "--ray", cluster.address, "--out", "other"]
        done = ruedo(*command, folder=folder, code=4)
        # Ray itself reports that it has no route out of the test's network.
        lines = [line for line in done.stderr.splitlines() if "network_util.cc" not in line]
        assert len(lines) == 1, lines
        assert re.fullmatch(
            rf"ruedo: node [0-9.]+ has Ruedo [^ ]+ \([^()]*build {theirs}\), the campaign was started "
            rf"with {re.escape(str(_engine.build))}: install one build on all of them",
            lines[0],
        )
    finally:
        cluster.shutdown()
    # Nothing is lost: cases that were not run yet are run on other nodes.
    ruedo("campaign", "resume", "c.yaml", "--out", "other", folder=folder, code=1)
    assert table(folder, "--out", "other") == table(folder)


def test_more_memory_than_any_node_has_is_one_line(whole, cluster):
    folder, _ = whole
    (folder / "large.yaml").write_text(
        CAMPAIGN.replace("limits: {", "limits: {memory_mb: 100000000, ")
    )
    ray.init(address=cluster.address, log_to_driver=False)
    with pytest.raises(CampaignError, match="no node of the cluster has more than"):
        Campaign(folder / "large.yaml").run(ray=cluster.address)
