"""What textbook programs use of the client, in Python; api.cpp and Api.java are its twins, with the
same commands and output."""

import itertools
import sys
import time

import numpy as np
import ruedo

PATIENCE = 300.0  # s, for what comes sooner or later


def say(*words):
    print(*(f"{w:.6f}" if isinstance(w, float) else w for w in words), flush=True)


def attempt(what, call):
    try:
        call()
        say(what, "none")
    except (ruedo.RuedoError, ValueError, OSError) as error:
        say(what, f"{type(error).__name__}:", str(error).replace("\n", " "))


def joints(sim):
    robot = sim.robot("arm")
    for name in robot.joints.names:
        joint = robot.joints[name]
        say(name, joint.kind, joint.takes_commands, joint.holds, joint.lower, joint.upper)
        say(f"{name}_most", joint.max_velocity, joint.max_effort)
    attempt("unknown", lambda: robot.joints["elbo"])
    attempt("unknown_command", lambda: robot.command_joints({"elbo": 1.0}))
    attempt("nan", lambda: robot.command_joints({"elbow": float("nan")}))
    attempt("mimic", lambda: robot.command_joints({"finger": 0.1}))
    attempt("unknown_state", lambda: robot.joints.latest(PATIENCE).position("elbo"))
    robot.command_joints({"shoulder": 0.5, "wrist": -0.25})
    while abs(robot.joints["shoulder"].position - 0.5) > 1e-3:
        sim.sleep(0.05)
    sim.sleep(1.0)
    state = robot.joints.next(PATIENCE)
    say("reached", *(state.position(name) for name in ("shoulder", "wrist", "elbow")))
    joint = robot.joints["elbow"]
    joint.velocity = 0.2
    sim.sleep(1.0)
    say("velocity", joint.velocity)
    robot.command_joints({"elbow": 0.0}, mode="velocity")
    robot.joints["wrist"].position = 9.0  # beyond its limit
    sim.sleep(2.0)
    say("limited", robot.joints["wrist"].position)


def joints_in_lockstep(sim):
    robot = sim.robot("arm")
    sim.step(0)
    attempt("at_once", lambda: robot.command_joints({"elbow": 0.1}))
    seen = sim.step(400, [robot.joint_command({"elbow": 0.1})])
    say("reached", seen.latest(robot.joints).position("elbow"))


def in_step(sim):
    """The robot turns about a circle: at each moment its place follows from its heading."""
    robot = sim.robot("p3at")
    robot.set_velocity(0.5, 0.5)
    robot.lrf.latest(PATIENCE)
    stamps, pairs, worst = [], 0, 0.0
    for scan, pose in sim.synchronised(robot.lrf, robot.pose):
        stamps.append(scan.utime)
        worst = max(worst, abs(scan.utime - pose.utime))
        pairs += 1
        if pairs == 10:
            break
    say("joined", pairs, worst, all(b > a for a, b in itertools.pairwise(stamps)))
    three = next(iter(sim.synchronised(robot.lrf, robot.pose, robot.odometry)))
    say("three", *(one.utime - three[0].utime for one in three))
    between = robot.pose.at(stamps[-1] - 7_000)  # poses come each 20 ms
    before, after = robot.pose.at(stamps[-1] - 20_000), robot.pose.at(stamps[-1])
    share = 13.0 / 20.0
    expected = (1 - share) * before.x + share * after.x
    say("between", between.utime - stamps[-1], between.x - expected, before.x != after.x)
    scans = [robot.lrf.at(stamps[-1] + 130_000, PATIENCE).utime - stamps[-1]]  # each 100 ms
    say("nearest", *scans)
    attempt("early", lambda: robot.odometry.at(0))
    for count, _ in enumerate(robot.lrf):
        if count == 2:
            break
    times = []
    for t in sim.every(0.25):
        times.append(t)
        if len(times) == 4:
            break
    say("every", *(b - a for a, b in itertools.pairwise(times)), (times[0] / 0.25) % 1.0)
    attempt("period", lambda: sim.every(0.0))
    sim.quit()
    say("ended", sum(1 for _ in robot.lrf) < 1000, sum(1 for _ in sim.every(0.1)) < 1000)


def queue(sim):
    """Paused; a scan each 20 steps."""
    lrf, came = sim.robot("p3at").lrf, []
    lrf.on_sample(lambda scan: came.append(scan.utime))
    lrf.queue_depth = 4

    def wait_for(count):
        while len(came) < count:
            time.sleep(0.001)

    sim.step(20)
    wait_for(1)
    first, begin = lrf.next(PATIENCE).utime, lrf.dropped
    sim.step(120)
    wait_for(7)
    got = [lrf.next(PATIENCE).utime - first for _ in range(4)]
    say("queue", *got, lrf.dropped - begin, lrf.queue_depth, sim.robot("p3at").lrf.queue_depth)
    lrf.queue_depth = 1
    sim.step(60)
    wait_for(10)
    say("newest", lrf.next(PATIENCE).utime - first, lrf.dropped - begin)
    for depth in (0, 1001):
        attempt(f"depth{depth}", lambda depth=depth: setattr(lrf, "queue_depth", depth))


def played(sim):
    """A log as a run: what would change it is refused, and it ends."""
    robot = sim.robot("p3at")
    say("world", sim.world, robot.lrf.range_max > 1.0)
    attempt("drive", lambda: robot.set_velocity(0.1, 0.0))
    attempt("pause", sim.pause)
    xs = [pose.x for _, pose in sim.synchronised(robot.lrf, robot.pose)]
    say("went", len(xs), xs[-1], sim.time)


def map_files(_, folder):
    map = ruedo.load_map(f"{folder}/given.yaml")
    rows, columns = map.cells.shape
    say("map", rows, columns, map.resolution, *map.origin)
    say("cells", *map.cells.ravel().tolist())
    map.save(f"{folder}/saved.yaml")
    attempt("name", lambda: map.save(f"{folder}/saved.png"))
    for wrong in ("none", "missing", "resolution", "origin", "short", "picture"):
        attempt(wrong, lambda wrong=wrong: ruedo.load_map(f"{folder}/{wrong}.yaml"))


def devices_by_name(sim):
    """The depth of one camera among several, and the boxes of two."""
    robot = sim.robot("rig")
    say("width", robot.cameras["right"].latest(PATIENCE).width)
    say("depth", robot.cameras["right"].depth.latest(PATIENCE).width)
    boxes = robot.boxes_2d.latest(PATIENCE).boxes
    say("boxes", *(f"{box.name} {box.label}" for box in boxes))
    box = robot.boxes_3d.latest(PATIENCE).boxes[0]
    say("solid", box.name, *map(float, box.center))


def bodies(sim):
    crate = sim.body("crate")
    say("crate", crate.is_static, crate.mass, crate.pose.x, crate.pose.y, crate.pose.heading)
    crate.set_pose(1.0, 2.0, 0.5)
    say("put", crate.pose.x, crate.pose.y, crate.pose.heading)
    crate.set_twist((0.0, 0.0, 3.0))
    sim.step(10)
    say("rises", crate.twist.linear[2] < 3.0, crate.twist.linear[2] > 1.0, crate.pose.z > 0.1)
    attempt("unknown", lambda: sim.body("crat"))
    say("all", len(sim.bodies) > 1, sim.bodies[0].name)


def geometry(sim):
    a, b = (
        ruedo.Transform.of(1.0, 2.0, 0.3),
        ruedo.Transform((0.5, -1.0, 0.25), (0.5, 0.5, 0.5, 0.5)),
    )
    product = a @ b
    say("product", *map(float, product.position), *map(float, product.orientation))
    identity = product @ product.inverse()
    say("identity", *map(float, identity.position), *map(abs, map(float, identity.orientation)))
    say("apply", *map(float, a.apply((1.0, 0.0, 0.0))))
    say("angles", *map(ruedo.normalize_angle, (3.5, -3.5, 7.0, 0.25, -100.0)))
    robot = sim.robot("p3at")
    scan = robot.lrf.latest(PATIENCE)
    pose = robot.pose.latest(PATIENCE)
    world = pose.transform @ robot.lrf.transform
    ahead = [world.apply(point) for point in scan.points()]
    say("wall", max(float(one[0]) for one in ahead if abs(one[1]) < 1.0))


def driving(sim):
    robot = sim.robot("p3at")
    begin = robot.pose.latest(PATIENCE)
    with robot.driving(0.3, 0.0):
        sim.sleep(2.0)
    while robot.motion.next(PATIENCE).v > 0.0:
        pass
    say("went", robot.pose.next(PATIENCE).x - begin.x > 0.3)
    command = ruedo.lcmtypes.velocity_command_t()
    command.vx = 0.1
    sim.publish("p3at/velocity", command)
    fastest = 0.0
    while fastest == 0.0 or robot.motion.latest(PATIENCE).v > 0.0:
        fastest = max(fastest, robot.motion.next(PATIENCE).v)
    say("published", fastest)  # it lapsed: nothing repeats it


def saves(sim):
    begin = sim.state().step
    saved = sim.save("here")
    sim.step(40)
    say("back", sim.restore(saved).step - begin, sim.state().step - begin)


def chart(_):
    """8 x 6 m with walls of a cell, about the origin, and a pillar of a cell."""
    cells = [[0] * 80 for _ in range(60)]
    for row in range(60):
        for column in range(80):
            if row in (0, 59) or column in (0, 79) or (row, column) == (40, 50):
                cells[row][column] = 100
    map = ruedo.Map(np.array(cells, np.int8), 0.1, (-4.0, -3.0, 0.0))
    say("at", map.at(0.0, 0.0), map.at(1.05, 1.05), map.at(9.0, 0.0))
    say("rays", *(map.ray(-0.5, -0.75, 0.1 * i) for i in range(63)), map.ray(0.0, 0.0, 0.0, 1.0))
    say("field", *map.distance_field()[::7, ::9].ravel().tolist())
    grown = map.inflated(0.25)
    say("grown", grown.occupied(1.05, 1.25), grown.occupied(1.05, 1.35))


def fixes(sim):
    first, second = (sim.robot(name).gps.latest(PATIENCE) for name in ("here", "there"))
    say("enu", *map(float, second.enu(first)))
    say("heading", sim.robot("there").imu.latest(PATIENCE).heading)
    attempt("none", lambda: sim.robot("here").magnetometer)


def main():
    url, command, *rest = sys.argv[1:]
    with ruedo.connect(url, name="api", timeout=60.0) as sim:
        globals()[command](sim, *rest)


main()
