"""simulation_interfaces 1.5 to the letter: a table over its services.

Each row is a call, the result's code, and every other field of the response. A call that is refused
leaves the other fields empty and the world as it was. The rows of a test follow each other.
"""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest
from conftest import Peer
from geometry_msgs.msg import (
    Accel,
    Point,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    Twist,
    Vector3,
)
from nav_msgs.msg import Odometry
from server import Run
from simulation_interfaces.msg import (
    Bounds,
    EntityCategory,
    EntityFilters,
    EntityInfo,
    EntityState,
    Resource,
    SimulationState,
    SpawnEntity,
    TagsFilter,
)
from std_msgs.msg import Header

UNSUPPORTED, OK, NOT_FOUND, INCORRECT_STATE, FAILED = range(5)
OBJECT, ROBOT, HUMAN, DYNAMIC, STATIC = 0, 1, 2, 4, 5
EMPTY, BOX, CONVEX_HULL, SPHERE = range(4)
STOPPED, PLAYING, PAUSED, QUITTING, NO_WORLD, LOADING_WORLD = range(6)
WORLD = Path(__file__).resolve().parents[1] / "conformance.sdf"
ALL = ["crate", "ground", "p3at", "walker", "wall"]
TURNED = Quaternion(z=0.5**0.5, w=0.5**0.5)
ZERO = Quaternion(w=0.0)
CRATE = """<sdf version="1.9"><model name="crate"><link name="link">
  <inertial><mass>2</mass></inertial>
  <collision name="box"><geometry><box><size>0.3 0.3 0.3</size></box></geometry></collision>
</link></model></sdf>"""
NAN = float("nan")


class Something:
    """What is compared by a rule."""

    def __init__(self, rule):
        self.rule = rule


def fields_of(message) -> list[str]:
    return list(message.get_fields_and_field_types())


def kind_of(service: str) -> type:
    name = "".join(map(str.capitalize, service.split("_")))
    return getattr(importlib.import_module("simulation_interfaces.srv"), name)


class Client:
    """Calls the services; a request's fields in their order."""

    def __init__(self, peer: Peer):
        self.peer = peer

    def call(self, service: str, *values):
        kind = kind_of(service)
        names = fields_of(kind.Request)
        return self.peer.call(kind, f"/{service}", **dict(zip(names, values, strict=False)))

    def state(self) -> int:
        return self.call("get_simulation_state").state.state


def same(got, wanted) -> bool:
    if isinstance(wanted, Something):
        return bool(wanted.rule(got))
    if isinstance(wanted, list):
        return len(got) == len(wanted) and all(map(same, got, wanted))
    if hasattr(wanted, "get_fields_and_field_types"):
        names = fields_of(wanted)
        return all(same(getattr(got, name), getattr(wanted, name)) for name in names)
    return got == (pytest.approx(wanted, abs=1e-9) if isinstance(wanted, float) else wanted)


def is_empty(value) -> bool:
    if hasattr(value, "get_fields_and_field_types"):
        return all(is_empty(getattr(value, name)) for name in fields_of(value))
    return not (len(value) if hasattr(value, "__len__") else value)


def world_of(client):
    """All that a refused call must not change."""
    states = client.call("get_entities_states", filters())
    infos = [client.call("get_entity_info", name).info for name in states.entities]
    return states.entities, states.states, infos


def check(client, rows):
    for service, arguments, code, *fields in rows:
        before = None if code == OK else world_of(client)
        reply = client.call(service, *arguments)
        where = f"{service}{arguments}: {reply}"
        answer = fields_of(reply)
        if "result" in answer:
            assert reply.result.result == code, where
            assert (code == OK) or reply.result.error_message, where
        others = [name for name in answer if name != "result"]
        if code == OK:
            wanted = fields[0] if fields else {}
            assert set(wanted) == set(others), where
            assert all(same(getattr(reply, name), wanted[name]) for name in others), where
        elif fields:
            assert all(same(getattr(reply, name), fields[0][name]) for name in others), where
        else:
            assert all(is_empty(getattr(reply, name)) for name in others), where
        if before:
            assert same(list(world_of(client)), list(before)), where


def filters(pattern="", categories=(), tags=(), mode=0, bounds=(EMPTY,)) -> EntityFilters:
    return EntityFilters(
        filter=pattern,
        categories=[EntityCategory(category=c) for c in categories],
        tags=TagsFilter(tags=list(tags), filter_mode=mode),
        bounds=boundary(*bounds),
    )


def boundary(kind=EMPTY, *points) -> Bounds:
    return Bounds(type=kind, points=[vector(point) for point in points])


def vector(v=(0, 0, 0)) -> Vector3:
    x, y, z = map(float, v)
    return Vector3(x=x, y=y, z=z)


def pose(x=0.0, y=0.0, z=0.0, turn=None) -> Pose:
    place = Point(x=float(x), y=float(y), z=float(z))
    return Pose(position=place, orientation=turn or Quaternion())


def state(x=0.0, y=0.0, z=0.0, turn=None, frame="", linear=(), angular=(), acceleration=()):
    """An EntityState."""
    nothing = (0, 0, 0)
    return EntityState(
        header=Header(frame_id=frame),
        pose=pose(x, y, z, turn),
        twist=Twist(linear=vector(linear or nothing), angular=vector(angular or nothing)),
        acceleration=Accel(linear=vector(acceleration or nothing)),
    )


def at(x=0.0, y=0.0, z=0.0, turn=None, frame="") -> PoseStamped:
    return PoseStamped(header=Header(frame_id=frame), pose=pose(x, y, z, turn))


def info(category, description="", tags=()) -> EntityInfo:
    kind = EntityCategory(category=category)
    return EntityInfo(category=kind, description=description, tags=list(tags))


@pytest.fixture(scope="module")
def session():
    with Run("--no-noise", "--disable", "p3at/camera", "--paused", world=str(WORLD)) as run:
        peer = Peer(run.domain)
        yield Client(peer)
        peer.close()


@pytest.fixture
def client(session):
    """At the start, paused."""
    assert session.call("reset_simulation", 255).result.result == OK
    if session.state() != PAUSED:
        assert (
            session.call("set_simulation_state", SimulationState(state=PAUSED)).result.result == OK
        )
    return session


def entities(*names):
    return {"entities": list(names)}


# Expressions that the C library would work on without end.
DEAR = [
    "(a{9}){9}",
    f"({'a' * 190}){{9999}}",
    "a" + "+" * 30,
    "(" * 20 + ".?" + ")+" * 20,
    "a" * 1000,
    "(a)\\1",
]


def test_queries_of_entities(client):
    ask, ok = "get_entities", entities
    hull = (CONVEX_HULL, (0, 0, 0), (1, 0, 0), (0, 1, 0))
    rows = [
        (filters(), OK, ok(*ALL)),
        (filters("^w"), OK, ok("walker", "wall")),
        (filters("^cr.te$|^p3at$"), OK, ok("crate", "p3at")),
        (filters("nobody"), OK, ok()),
        (filters("["), FAILED),
        *[(filters(dear), UNSUPPORTED) for dear in DEAR],
        (filters(categories=[OBJECT]), OK, ok()),
        (filters(categories=[ROBOT]), OK, ok("p3at")),
        (filters(categories=[HUMAN]), OK, ok("walker")),
        (filters(categories=[DYNAMIC]), OK, ok("crate")),
        (filters(categories=[STATIC]), OK, ok("ground", "wall")),
        (filters("^w", [STATIC, ROBOT]), OK, ok("wall")),
        (filters(tags=["red"]), OK, ok()),
        (filters(tags=["red"], mode=2), FAILED),
        # The ground is a plane, without bounds.
        (filters(bounds=(SPHERE, (5, 0, 0.5), (0.05, 0, 0))), OK, ok("ground", "wall")),
        (filters(bounds=(SPHERE, (5.15, 0, 0.5), (0.06, 0, 0))), OK, ok("ground", "wall")),
        (filters(bounds=(SPHERE, (5.15, 0, 0.5), (0.04, 0, 0))), OK, ok("ground")),
        (filters("^crate", bounds=(BOX, (-2.5, 2.2, 1), (-2.91, 2, 0))), OK, ok("crate")),
        (filters("^crate", bounds=(BOX, (-2.5, 2.2, 1), (-2.88, 2, 0))), OK, ok()),
        (filters(bounds=hull), UNSUPPORTED),
        (filters(bounds=(9, (0, 0, 0), (1, 0, 0))), UNSUPPORTED),
        (filters(bounds=(BOX, (0, 0, 0))), FAILED),
        (filters(bounds=(BOX, (0, 0, 0), (NAN, 0, 0))), FAILED),
        (filters(bounds=(EMPTY, (0, 0, 0))), FAILED),
        (filters(bounds=(SPHERE, (0, 0, 0), (-1, 0, 0))), FAILED),
    ]
    check(client, [(ask, (question,), *rest) for question, *rest in rows])

    def with_states(rest):
        names = rest[1]["entities"] if len(rest) > 1 else []
        states = {"states": Something(lambda got: len(got) == len(names))}
        return [rest[0], {**rest[1], **states}] if rest[0] == OK else rest

    check(client, [("get_entities_states", (q,), *with_states(rest)) for q, *rest in rows])
    placed = state(-3, 2, 0.25, TURNED, "world")
    check(
        client,
        [("get_entities_states", (filters("crate"),), OK, {**ok("crate"), "states": [placed]})],
    )


def test_entity_info_and_state(client):
    about, say, ask = "get_entity_info", "set_entity_info", "get_entities"
    check(
        client,
        [
            ("get_entity_state", ("crate",), OK, {"state": state(-3, 2, 0.25, TURNED, "world")}),
            ("get_entity_state", ("nobody",), NOT_FOUND),
            ("get_entity_state", ("",), NOT_FOUND),
            (
                "get_entity_bounds",
                ("crate",),
                OK,
                {"bounds": boundary(BOX, (0.2, 0.1, 0.35), (-0.2, -0.1, -0.25))},
            ),
            (
                "get_entity_bounds",
                ("wall",),
                OK,
                {"bounds": boundary(BOX, (0.1, 2, 0.5), (-0.1, -2, -0.5))},
            ),
            ("get_entity_bounds", ("ground",), OK, {"bounds": boundary()}),
            ("get_entity_bounds", ("nobody",), NOT_FOUND),
            (about, ("p3at",), OK, {"info": info(ROBOT)}),
            (about, ("walker",), OK, {"info": info(HUMAN)}),
            (about, ("nobody",), NOT_FOUND),
            (say, ("nobody", info(OBJECT)), NOT_FOUND),
            (say, ("crate", info(3)), FAILED),
            (say, ("crate", info(OBJECT, "x" * 20_000)), FAILED),
            (say, ("crate", info(OBJECT, "a box", ["red", "small"])), OK),
            (say, ("wall", info(STATIC, "", ["red"])), OK),
            (about, ("crate",), OK, {"info": info(OBJECT, "a box", ["red", "small"])}),
            (ask, (filters(categories=[OBJECT]),), OK, entities("crate")),
            (ask, (filters(tags=["red", "small"]),), OK, entities("crate", "wall")),
            (ask, (filters(tags=["red", "small"], mode=1),), OK, entities("crate")),
            (say, ("crate", info(DYNAMIC)), OK),
            (say, ("wall", info(STATIC)), OK),
            (about, ("wall",), OK, {"info": info(STATIC)}),
        ],
    )


def test_states_that_are_set(client):
    put, ask = "set_entity_state", "get_entity_state"
    invalid = 101
    pushed = state(1, 2, 3, TURNED, "world", linear=(0.1, 0, 0), angular=(0, 0, 0.2))
    check(
        client,
        [
            (put, ("nobody", state()), NOT_FOUND),
            (put, ("", state()), NOT_FOUND),
            (put, ("crate", state(1, turn=ZERO)), invalid),
            (put, ("crate", state(1, turn=Quaternion(w=2.0))), invalid),
            (put, ("crate", state(NAN)), invalid),
            (put, ("crate", state(1e9)), invalid),
            (put, ("crate", state(1, frame="mars")), invalid),
            (put, ("crate", state(1, linear=(1e9, 0, 0))), FAILED),
            (put, ("crate", state(1, linear=(NAN, 0, 0))), FAILED),
            # A robot drives by its commands.
            (put, ("p3at", state(1, linear=(0.1, 0, 0))), FAILED),
            (put, ("walker", state(1)), FAILED),
            (put, ("wall", state(1, linear=(0.1, 0, 0))), FAILED),
            (put, ("wall", state(1, acceleration=(0.1, 0, 0))), FAILED),
            (put, ("crate", pushed), OK),
            (ask, ("crate",), OK, {"state": pushed}),
            (put, ("crate", state(1, 2, 3, TURNED)), OK),
            (ask, ("crate",), OK, {"state": state(1, 2, 3, TURNED, "world")}),
            (put, ("wall", state(6, 1, 0.5, TURNED)), OK),
            (ask, ("wall",), OK, {"state": state(6, 1, 0.5, TURNED, "world")}),
            # In the wall's frame, x is the world's y.
            (put, ("crate", state(-2, 1, 0, frame="wall", linear=(0.5, 0, 0))), OK),
            (ask, ("crate",), OK, {"state": state(5, -1, 0.5, TURNED, "world", (0, 0.5, 0))}),
            (put, ("p3at", state(-1, 1, 0, TURNED, "world")), OK),
        ],
    )
    robot = client.call("get_entity_state", "p3at").state.pose.position
    assert (robot.x, robot.y) == (pytest.approx(-1.0), pytest.approx(1.0))


def model(name="box", inside="<box><size>0.1 0.1 0.1</size></box>") -> str:
    return CRATE.replace('name="crate"', f'name="{name}"').replace(
        "<box><size>0.3 0.3 0.3</size></box>", inside
    )


def mesh(uri: str) -> str:
    return model(inside=f"<mesh><uri>{uri}</uri></mesh>")


NAME_NOT_UNIQUE, NAME_INVALID, UNSUPPORTED_FORMAT, NO_RESOURCE, NAMESPACE_INVALID = range(101, 106)
RESOURCE_PARSE_ERROR, MISSING_ASSETS, UNSUPPORTED_ASSETS, INVALID_POSE = range(106, 110)
SPAWNS = [
    # name, allow_renaming, uri, resource_string, entity_namespace, initial_pose
    (("b", False, "", "", "", at(0, 5, 1)), NO_RESOURCE),
    (("", False, "", model(), "", at(0, 5, 1)), NAME_INVALID),
    ((" b", True, "", model(), "", at(0, 5, 1)), NAME_INVALID),
    (("crate", False, "", model(), "", at(0, 5, 1)), NAME_NOT_UNIQUE),
    (("b", False, "", "#usda 1.0", "", at(0, 5, 1)), UNSUPPORTED_FORMAT),
    (("b", False, "", "<!-- <sdf/> --><mujoco/>", "", at(0, 5, 1)), UNSUPPORTED_FORMAT),
    (("b", False, "no_such_model", "", "", at(0, 5, 1)), NOT_FOUND),
    (("b", False, "", "<sdf version='1.9'><model", "", at(0, 5, 1)), RESOURCE_PARSE_ERROR),
    (("b", False, "", "<sdf version='1.9'/>", "", at(0, 5, 1)), RESOURCE_PARSE_ERROR),
    (("b", False, "", mesh("no.stl"), "", at(0, 5, 1)), MISSING_ASSETS),
    (("b", False, "", mesh("conformance.sdf"), "", at(0, 5, 1)), UNSUPPORTED_ASSETS),
    (("b", False, "", model(), "1st", at(0, 5, 1)), NAMESPACE_INVALID),
    (("b", False, "", model(), "a//b", at(0, 5, 1)), NAMESPACE_INVALID),
    (("b", False, "", model(), "a b", at(0, 5, 1)), NAMESPACE_INVALID),
    (("b", False, "", model(), "", at(0, 5, 1, ZERO)), INVALID_POSE),
    (("b", False, "", model(), "", at(NAN, 5, 1)), INVALID_POSE),
    (("b", False, "", model(), "", at(1e9, 5, 1)), INVALID_POSE),
    (("b", False, "", model(), "", at(0, 5, 1, frame="mars")), INVALID_POSE),
    (("b", False, "", model(), "", at(5, 0, 0.5)), FAILED),  # in the wall
    # A uri hides a text.
    (("robot", False, "p3at", "<mujoco/>", "fleet/one", at(0, 5, 0)), OK, "robot"),
    (("other", False, "p3at", "", "fleet/one", at(0, 7, 0)), NAMESPACE_INVALID),
    (("b", False, "", model(), "", at(0, -5, 1)), OK, "b"),
    (("b", True, "", model(), "", at(1, -5, 1)), OK, "b_2"),
    (("", True, "", model(), "", at(2, -5, 1)), OK, "box"),
    (("", True, "", model(), "", at(3, -5, 1)), OK, "box_2"),
    (("c", False, "", model(), "", at(-3, 3, 0, frame="wall")), OK, "c"),
]


def test_spawning(client):
    rows = []
    for question, code, *name in SPAWNS:
        rows.append(("spawn_entity", question, code, *({"entity_name": n} for n in name)))
    check(client, rows)
    check(client, [("get_entity_state", ("c",), OK, {"state": state(2, 3, 0.5, None, "world")})])
    client.peer.spin_until(
        lambda: client.peer.node.count_publishers("/fleet/one/scan"), "the robot's topics"
    )
    check(
        client,
        [
            ("delete_entity", ("nobody",), NOT_FOUND),
            ("delete_entity", ("",), NOT_FOUND),
            ("delete_entity", ("c",), OK),
            ("get_entity_info", ("c",), NOT_FOUND),
            ("reset_simulation", (4,), OK),
            ("get_entities", (filters(),), OK, entities(*ALL)),
        ],
    )


def test_spawning_several(client):
    def order(question):
        name, renames, uri, text, space, place = question
        return SpawnEntity(
            name=name,
            allow_renaming=renames,
            entity_resource=Resource(uri=uri, resource_string=text),
            entity_namespace=space,
            initial_pose=place,
        )

    check(client, [("spawn_entities", ([],), OK, {"results": []})])
    reply = client.call("spawn_entities", [order(question) for question, *_ in SPAWNS])
    assert reply.result.result == 150
    got = [(one.result.result, one.entity_name) for one in reply.results]
    assert got == [(code, (name or [""])[0]) for _, code, *name in SPAWNS]
    good = [order(("d", True, "", model(), "", at(x, -7, 1))) for x in (0, 1)]
    reply = client.call("spawn_entities", good)
    assert reply.result.result == OK and [r.entity_name for r in reply.results] == ["d", "d_2"]


def test_states_of_the_simulation(client):
    step, ask = "step_simulation", "get_simulation_state"
    already, incorrect = 101, 103

    def put(number, code):
        return ("set_simulation_state", (SimulationState(state=number),), code)

    def told(number):
        return (ask, (), OK, {"state": SimulationState(state=number)})

    check(
        client,
        [
            told(PAUSED),
            put(PAUSED, already),
            put(NO_WORLD, incorrect),
            put(LOADING_WORLD, incorrect),
            put(9, FAILED),
            (step, (0,), FAILED),
            (step, (3,), OK),
            told(PAUSED),
            put(STOPPED, OK),
            told(STOPPED),
            put(STOPPED, already),
            ("get_entity_state", ("wall",), OK, {"state": state(5, 0, 0.5, None, "world")}),
            # As SimulationState has it: a stopped simulation can be paused.
            put(PAUSED, OK),
            told(PAUSED),
            put(STOPPED, OK),
            (step, (1,), OK),
            told(PAUSED),
            put(PLAYING, OK),
            told(PLAYING),
        ],
    )
    # The world advances, so that a refusal cannot be seen in it.
    assert (
        client.call("set_simulation_state", SimulationState(state=PLAYING)).result.result == already
    )
    assert client.call(step, 1).result.result == FAILED
    check(client, [put(PAUSED, OK), told(PAUSED)])


def test_resets(client):
    spawn = ("spawn_entity", ("b", False, "", model(), "", at(0, 5, 1)), OK, {"entity_name": "b"})
    moved = ("set_entity_state", ("crate", state(1, 2, 3)), OK)
    step = ("step_simulation", (2,), OK)
    start = state(-3, 2, 0.25, TURNED, "world")
    for scope in range(8):
        check(client, [spawn, step, moved, ("reset_simulation", (scope,), OK)])
        names, states, _ = world_of(client)
        whole = scope in (0, 7)
        assert ("b" in names) == (not (whole or scope & 4)), scope
        crate = states[names.index("crate")]
        time = 0 if whole or scope & 1 else 2 * 5000
        start.header.stamp.nanosec = time * 1000
        assert same(crate, start) == bool(whole or scope & 2), scope
        assert crate.header.stamp == start.header.stamp, scope
        check(client, [("reset_simulation", (255,), OK)])
    check(client, [("reset_simulation", (8,), UNSUPPORTED), ("reset_simulation", (4,), OK)])


def test_resources(client):
    models = Something(lambda got: {"p3at", "turtle"} <= {one.uri for one in got})
    world = Something(
        lambda got: (
            got.name == "conformance"
            and got.world_resource == Resource(uri=str(WORLD))
            and (got.description, got.tags) == ("", [])
        )
    )
    tags = TagsFilter()
    check(
        client,
        [
            ("get_spawnables", ([],), OK, {"spawnables": models}),
            ("get_spawnables", (["mars"],), OK, {"spawnables": models}),
            ("get_current_world", (), OK, {"world": world}),
            ("get_available_worlds", ([], tags, True, False), UNSUPPORTED),
            ("load_world", (str(WORLD), "", False, False), UNSUPPORTED),
            ("unload_world", (), UNSUPPORTED),
            ("get_named_poses", (tags,), UNSUPPORTED),
            ("get_named_pose_bounds", ("dock",), UNSUPPORTED),
        ],
    )
    reply = client.call("get_spawnables", ["mars"])
    assert "mars" in reply.result.error_message
    for one in reply.spawnables:
        assert one.description and is_empty(one.spawn_bounds), one
    robot = next(one.uri for one in reply.spawnables if one.uri == "turtle")
    spawned = client.call("spawn_entity", "t", False, robot, "", "", at(0, 5, 0))
    assert spawned.result.result == OK


EVERYTHING = [0, 1, 4, 5, 6, *range(8, 15), *range(20, 27), 31, 32, 33, 44, 50]
WITHOUT_CONTROL = [4, 5, 8, 12, 13, 14, 44]


def test_features_are_those_that_are_there(client, peers):
    told = client.call("get_simulator_features").features
    assert list(told.features) == EVERYTHING
    assert told.spawn_formats == ["sdf", "urdf"]
    assert told.custom_info.startswith("Ruedo ")
    with Run("--no-noise", "--disable", "p3at/camera", "--control", "off", world=str(WORLD)) as run:
        deaf = Client(peers(run))
        assert list(deaf.call("get_simulator_features").features.features) == WITHOUT_CONTROL
        assert deaf.call("get_entities", filters()).entities == ALL
        for service, *arguments in (
            ("step_simulation", 1),
            ("get_entity_state", "crate"),
            ("set_entity_state", "crate", state()),
            ("delete_entity", "crate"),
            ("spawn_entity", "b", False, "", model(), "", at(0, 5, 1)),
            ("reset_simulation", 0),
            ("get_simulation_state",),
            ("set_simulation_state", SimulationState(state=PAUSED)),
            ("get_entities_states", filters()),
        ):
            assert deaf.call(service, *arguments).result.result == UNSUPPORTED, service


def test_quitting_ends_the_run(peers):
    with Run("--no-noise", "--disable", "p3at/camera", world=str(WORLD)) as run:
        client = Client(peers(run))
        assert (
            client.call("set_simulation_state", SimulationState(state=QUITTING)).result.result == OK
        )
        run.process.wait(60)


def test_robots_come_and_go_with_their_topics(run, peers):
    client = Client(peers(run))
    spawned = client.call("spawn_entity", "p3at", True, "p3at", "", "", at(0.0, 1.5))
    assert (spawned.result.result, spawned.entity_name) == (OK, "p3at_2"), spawned
    own = client.peer.hear(Odometry, "/p3at_2/ground_truth")
    first = client.peer.hear(Odometry, "/ground_truth")
    client.peer.spin_until(lambda: len(own) >= 5 and len(first) >= 5, "poses of both")
    assert {(o.child_frame_id, o.pose.pose.position.y) for o in own} == {("p3at_2/base_link", 1.5)}
    assert {(o.child_frame_id, o.pose.pose.position.y) for o in first} == {("base_link", 0.0)}
    assert client.call("delete_entity", "p3at_2").result.result == OK
    assert client.call("delete_entity", "p3at_2").result.result == NOT_FOUND


def test_initialpose_moves_the_robot(run, peers):
    peer = peers(run)
    truth = peer.hear(Odometry, "/ground_truth")
    initial = peer.node.create_publisher(PoseWithCovarianceStamped, "/initialpose", 10)
    peer.spin_until(initial.get_subscription_count, "a reader")
    place = PoseWithCovarianceStamped(header=Header(frame_id="map"))
    place.pose.pose = pose(0.0, 1.5)
    initial.publish(place)
    peer.spin_until(
        lambda: any(abs(o.pose.pose.position.y - 1.5) < 1e-6 for o in truth),
        "the robot at its new place",
    )
