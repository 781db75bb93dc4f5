"""The Python probe: does what a test asks of a client and prints the results. probe.cpp and
Probe.java are its twins, with the same commands and output.
"""

import itertools
import math
import sys
import threading
import time
import zlib

import ruedo

PATIENCE = 300.0  # s, for what comes sooner or later
AGAIN = 60.0  # s, for what follows soon, or never


def say(*words):
    print(*(f"{w:.6f}" if isinstance(w, float) else w for w in words), flush=True)


def attempt(what, call):
    try:
        call()
        say(what, "none")
    except (ruedo.RuedoError, ValueError) as error:
        say(what, f"{type(error).__name__}:", str(error).replace("\n", " "))


def list_all(sim):
    say("world", sim.world, sim.seed, sim.step_size)
    for robot in sim.robots:
        say("robot", robot.name, robot.drive or "-", robot.watchdog, robot.track)
        for device in robot.devices:
            say(
                "device",
                robot.name,
                device.name,
                device.kind,
                device.type,
                device.rate,
                device.range_max,
                len(device.elements),
            )
    for body in sim.bodies:
        say("body", body.name, body.is_static, float(body.mass))


def read(sim, name):
    robot = sim.robot(name)
    scan = robot.lrf.latest(PATIENCE)
    say(
        "scan",
        len(scan.ranges),
        float(scan.angles[0]),
        float(scan.angles[-1]),
        scan.nearest(-math.pi, math.pi),
        len(scan.intensities),
    )
    reading = robot.sonar.latest(PATIENCE)
    say(
        "sonar",
        len(reading.ranges),
        float(reading.ranges.max()),
        len(reading.fired_utime),
        len(reading.fresh),
    )
    odometry = robot.odometry.latest(PATIENCE)
    say("odometry", odometry.x, odometry.y, odometry.theta, len(odometry.wheel_angles))
    pose = robot.pose.latest(PATIENCE)
    say("pose", pose.x, pose.y, pose.heading)
    first = robot.lrf.next(PATIENCE).utime
    second = robot.lrf.next(PATIENCE).utime
    say("next", second - first)
    if any(d.type == "image_t" for d in robot.devices):
        image = robot.camera.latest(PATIENCE)
        say("image", image.width, image.height, image.format, len(image.data) > 0)


def drive(sim, name, first, second, seconds, wheels):
    """At the commanded speed, and for that long without a gap: a client that was not scheduled for
    a long time has to start over.
    """
    robot = sim.robot(name)
    first, second = float(first), float(second)
    (robot.set_wheels if wheels else robot.set_velocity)(first, second)
    v, omega = (robot.wheel_radius * first, 0.0) if wheels else (first, second)  # both sides alike
    robot.pose.latest(PATIENCE)
    while True:
        status = robot.motion.next(PATIENCE)
        if abs(status.v - v) > 1e-6 or abs(status.omega - omega) > 1e-6:
            continue
        begin = robot.pose.next(PATIENCE)
        sim.sleep(float(seconds))
        end = robot.pose.next(PATIENCE)
        time = end.time - begin.time
        moved, turned = (
            math.hypot(end.x - begin.x, end.y - begin.y),
            math.remainder(end.heading - begin.heading, 2 * math.pi),
        )
        if (
            abs(moved - chord(v, omega, time)) < 1e-3
            and abs(math.remainder(turned - omega * time, 2 * math.pi)) < 1e-3
        ):
            break
    say("status", status.kind, status.state, status.v, status.omega)
    say("moved", moved, turned, time)
    robot.stop().wait(PATIENCE)
    say("stopped", robot.motion.next(PATIENCE).v)


def chord(v, omega, time):
    return abs(v * time if omega == 0.0 else 2.0 * v / omega * math.sin(omega * time / 2.0))


def primitives(sim, name):
    robot = sim.robot(name)
    robot.stop().wait(PATIENCE)

    def run(what, motion):
        begin = robot.pose.next(PATIENCE)
        sim.pause()  # else it may be over for a late client
        motion = motion()
        early = motion.done
        sim.resume()
        motion.wait(PATIENCE)
        end = robot.pose.next(PATIENCE)
        say(
            what,
            early,
            motion.done,
            motion.state,
            motion.reason or "-",
            math.hypot(end.x - begin.x, end.y - begin.y),
            math.remainder(end.heading - begin.heading, 2 * math.pi),
        )

    run("advance", lambda: robot.advance(0.4, speed=0.5))
    run("rotate", lambda: robot.rotate(1.2))
    run("turn_to", lambda: robot.turn_to(0.0))
    run("arc", lambda: robot.arc(0.8, 0.5))
    replaced = robot.advance(5.0, speed=0.05)  # slowly: a late client finds it under way
    sim.sleep(0.5)
    robot.stop().wait(PATIENCE)
    attempt("replaced", replaced.wait)
    running = robot.advance(5.0, speed=0.05)
    attempt("refused", robot.advance(2e6).wait)  # further than allowed: the current one continues
    attempt("too_long", lambda: running.wait(0.3))
    robot.stop().wait(PATIENCE)


def collisions(sim, name):
    """Into the wall, off it, and into it again."""
    robot = sim.robot(name)
    first = robot.collisions.latest(PATIENCE)
    say("free", len(first.points), first.blocked_by or "-")
    met = []
    with robot.on_collision(lambda sample: met.append(sample.points[0].body)):
        for what in ("once", "twice"):
            motion = robot.advance(20.0)
            attempt(what, motion.wait)
            say(f"{what}_by", motion.blocked_by)
            seen = robot.collisions.latest(PATIENCE)
            say(f"{what}_seen", seen.blocked_by, *{point.body for point in seen.points})
            robot.advance(-0.5).wait(PATIENCE)
            while robot.collisions.next(PATIENCE).points:
                pass
    say("met", *met)
    say("off", robot.collisions.latest(PATIENCE).blocked_by or "-")


def errors(sim, name):
    attempt("robot", lambda: sim.robot("nobody"))
    robot = sim.robot(name)
    attempt("device", lambda: robot.device("nothing"))
    attempt("nan", lambda: robot.set_velocity(math.nan, 0.0))
    attempt("radius", lambda: robot.arc(1.0, 0.0))
    attempt("limit", lambda: robot.advance(1.0, speed=-1.0))
    attempt("spawn", lambda: sim.spawn("no such model", 0.0, 0.0))


def markers(sim, name):
    red = (1.0, 0.0, 0.0, 0.5)
    rm = ruedo.markers
    every = [
        rm.lines([[0, 0, 0], [1, 0, 0]], red, 0.02),
        rm.path([[0, 0], [1, 0], [1, 2]], red, 0.02),
        rm.points([[0, 0, 1]], red, 0.1),
        rm.text("goal", (1, 2, 0.5), red, 0.3),
        rm.map([[0, 100], [-1, 50]], 0.5, (1, 1), math.pi / 2, red),
    ]
    sim.markers("plan", every, frame=name)
    sim.markers("gone")
    attempt("lines", lambda: rm.lines([[0, 0, 0]], red, 0.02))
    attempt("size", lambda: rm.points([], red, 0.0))
    attempt("color", lambda: rm.points([], (2.0, 0.0, 0.0), 0.1))
    attempt("cells", lambda: rm.map([[101]], 0.5, color=red))
    attempt("layer", lambda: sim.markers(""))
    attempt("large", lambda: sim.markers("large", [rm.points([[0, 0]] * 6000, red)]))
    sim.state()
    sim.sleep(0.2)


def sleeps(sim, seconds):
    begin = sim.time
    sim.sleep(float(seconds))
    say("slept", begin, sim.time - begin)
    sim.snapshot("here")
    begin = sim.restore("here").time
    sim.sleep(float(seconds))
    say("slept_again", begin, sim.time - begin)


def streams(sim, name, lrf, odometry):
    robot = sim.robot(name)
    attempt("lrf", lambda: robot.lrf.latest(float(lrf)))
    attempt("odometry", lambda: robot.odometry.latest(float(odometry)))


def control(sim, name):
    sim.pause()
    before = sim.state()
    say("paused", before.paused, all(sim.state().step == before.step for _ in range(20)))
    say("step", sim.step(7).step - before.step)
    say("name", sim.state(name).name, sim.state(name).position[0])
    sim.set_rate(2.0)
    sim.resume()
    sim.sleep(0.2)
    say("rate", sim.state().rate)
    sim.pause()
    sim.reset()
    say("reset", sim.state().step)
    attempt("unknown", lambda: sim.state("nobody"))
    attempt("steps", lambda: sim.step(0))


def snapshots(sim):
    say(
        "names",
        sim.spawn("p3at", 3.0, 1.0),
        sim.spawn("p3at", 3.0, -1.0),
        sim.spawn("p3at", -3.0, 1.0, name="guest"),
    )
    sim.step(40)
    saved = sim.snapshot("here")
    later = sim.step(60)
    back = sim.restore("here")
    say(
        "same",
        back.step == saved.step,
        back.state_hash == saved.state_hash,
        sim.step(60).state_hash == later.state_hash,
    )
    say("steps", saved.step, later.step)


def world(sim, text):
    sim.spawn("p3at", 3.0, 1.0, name="guest")
    guest = sim.robot("guest")
    say(
        "there",
        sim.state("guest").position[0],
        len(sim.robots),
        sum(body.name.startswith("guest/") for body in sim.bodies),
    )
    guest.set_velocity(0.3, 0.0)
    while sim.state("guest").position[0] <= 3.05:
        sim.sleep(0.1)
    say("drives", True, len(guest.lrf.latest(PATIENCE).ranges))
    guest.stop().wait(PATIENCE)
    sim.set_pose("guest", 3.0, 2.0, 1.0)
    say("put", sim.state("guest").position[1])
    sim.spawn("", -3.0, 2.0, text=text, name="ball")
    sim.set_twist("ball", [0.0, 1.0, 0.0])
    sim.sleep(0.3)
    say("rolls", sim.state("ball").position[1] > 2.05)
    attempt("taken", lambda: sim.spawn("p3at", -3.0, -2.0, name="guest"))
    attempt("room", lambda: sim.spawn("p3at", 3.0, 2.0))
    attempt("text", lambda: sim.spawn("", 0.0, -3.0, text="<sdf"))
    attempt("driven", lambda: sim.set_twist("guest", [1.0, 0.0, 0.0]))
    sim.reset("poses")
    say("poses", sim.state("guest").position[1], sim.state().time > 1.0)
    sim.pause()
    sim.reset("time")
    say("time", sim.state().time < 1.0, len(sim.robots))
    sim.resume()
    sim.remove("guest")
    say("gone", len(sim.robots), sum(body.name.startswith("guest/") for body in sim.bodies))
    attempt("unknown", lambda: sim.remove("guest"))


def lockstep(sim, name, steps, chunk, speed):
    robot, chunk = sim.robot(name), int(chunk)
    digest, messages, poses, odometry, seen = 0, 0, 0, None, sim.step(0)
    say("begin", seen.step, seen.time)
    for step in range(0, int(steps), chunk):
        commands = [robot.velocity_command(float(speed), 0.1 * k).at(k) for k in range(chunk)]
        last = sim.step(chunk, commands)
        for observations in (seen, last) if step == 0 else (last,):
            for message in observations.messages:
                digest = zlib.crc32(message.data, zlib.crc32(message.channel.encode(), digest))
                messages += 1
            poses += len(observations.all(robot.pose))
            odometry = observations.latest(robot.odometry) or odometry
    say("end", last.step, last.state_hash, messages, poses, digest)
    say("odometry", odometry.utime, odometry.x)
    attempt("past", lambda: sim.step(1, [robot.velocity_command(0.1, 0.0).at(1)]))


def given_up(sim):
    sim.step(0)
    try:
        sim.step(2000, timeout=0.0)
        say("given_up", "no")
    except ruedo.Timeout:
        say("given_up", "Timeout")
    first = sim.step(1).step
    say("then", first, sim.step(1).step)


def visited(sim, name):
    """Lockstep in which a robot comes, drives and goes."""
    robot, digest, messages, of_guest, guest, last = sim.robot(name), 0, 0, 0, "", None
    for turn in range(9):
        if turn == 3:
            guest = sim.spawn("p3at", 3.0, 1.0)
            say("guest", guest)
        if turn == 6:
            sim.remove(guest)
        commands = [robot.velocity_command(0.3, 0.2)]
        if 3 <= turn < 6:
            commands.append(sim.robot(guest).velocity_command(0.2, -0.3).at(5))
        last = sim.step(10, commands)
        for message in last.messages:
            digest = zlib.crc32(message.data, zlib.crc32(message.channel.encode(), digest))
            messages += 1
            of_guest += message.channel.startswith("p3at_2/")
    say("end", last.step, last.state_hash, messages, of_guest, digest)


def beside(sim, name):
    """Commands that go with no step."""
    robot = sim.robot(name)
    attempt("before", lambda: robot.set_velocity(0.3, 0.0))
    sim.step(0)
    attempt("velocity", lambda: robot.set_velocity(0.3, 0.0))
    attempt("wheels", lambda: robot.set_wheels(1.0, 1.0))
    attempt("advance", lambda: robot.advance(1.0))
    attempt("rotate", lambda: robot.rotate(1.0))
    attempt("turn_to", lambda: robot.turn_to(1.0))
    attempt("arc", lambda: robot.arc(1.0, 0.5))
    attempt("stop", robot.stop)
    last = sim.step(200)
    say("end", last.step, last.state_hash, len(last.messages))


def joints(sim, name, *joints):
    """Sends them all to 0.2, in lockstep."""
    order = ruedo.lcmtypes.joint_command_t()
    order.n, order.name = len(joints), list(joints)
    order.mode, order.value = bytes(len(joints)), [0.2] * len(joints)
    sim.step(0)
    attempt("joints", lambda: sim.step(1, [ruedo.Command(f"{name}/joint_command", order.encode())]))
    say("then", sim.step(1).step)


def sideways(sim, name):
    robot = sim.robot(name)
    attempt("command", lambda: robot.velocity_command(0.2, 0.1, 0.3))
    attempt("velocity", lambda: robot.set_velocity(0.2, 0.1, 0.3))
    attempt("none", lambda: robot.set_velocity(0.0, 0.0, 0.0))


def watches(sim, steps):
    """Lockstep in which others act."""
    seen, digest = sim.step(0), 0
    say("begin", seen.step, seen.time, seen.state_hash)
    last = sim.step(int(steps))
    for message in last.messages:
        digest = zlib.crc32(message.data, zlib.crc32(message.channel.encode(), digest))
    say("end", last.step, last.state_hash, len(last.messages), digest)


def leaves(sim, name):
    """In a callback, while the step that calls it goes on."""
    sim.robot(name).odometry.on_sample(lambda _: sim.close())
    try:
        sim.step(1000)
    except ruedo.NoServer:
        say("left")


def launched(sim):
    say("url", sim.url)
    say("ready", sim.robots[0].odometry.latest(PATIENCE).time >= 0.0)
    while True:
        time.sleep(1.0)


def launched_with(world, text=None):
    with ruedo.launch(
        world or None,
        seed=5,
        lockstep=1,
        spawn=["p3at:guest@2,0"],
        disable=["p3at/camera", "guest/camera"],
        settings={"p3at/lrf.update_rate": 20},
        noise=False,
        text=text,
        timeout=400.0,
    ) as sim:
        say("robots", " ".join(robot.name for robot in sim.robots))
        say("seed", sim.seed)
        robot = sim.robot("p3at")
        say("devices", " ".join(device.name for device in robot.devices))
        say("rate", robot.lrf.rate)
        seen = sim.step(20, [robot.velocity_command(0.3, 0.0)])
        say("scans", len(seen.all(robot.lrf)), seen.latest(robot.lrf).ranges[90])


def say_age(sim, stream):
    """Of the newest sample, s of sim time; without the real time that the question takes, in which
    sim time goes on.
    """
    begin = time.monotonic()
    newest = stream.latest(PATIENCE).time
    now = sim.state().time
    say("age", now - newest - (time.monotonic() - begin))


def keeps_up(rate):
    """What a program does in a run that it launched: looks now and then, works in a callback, and
    acts on what it sees.
    """
    with ruedo.launch("arena", rate=rate, noise=False, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        for _ in range(5):
            time.sleep(0.2)
            say_age(sim, robot.pose)
        seen = []

        def work(scan):
            seen.append(scan.time)
            time.sleep(0.15)

        with robot.lrf.on_sample(work):
            sim.sleep(2.0)
            say_age(sim, robot.odometry)
        say("seen", len(seen), max(b - a for a, b in itertools.pairwise(seen)), robot.lrf.dropped)
        for _ in range(10):
            robot.rotate(0.1).wait(PATIENCE)
            pose = robot.pose.next(PATIENCE)
            sim.sleep(0.2)
            say("after", abs(robot.pose.latest(PATIENCE).heading - pose.heading))
        robot.turn_to(0.0).wait(PATIENCE)
        while min(robot.lrf.next(PATIENCE).ranges[60:120]) > 0.8:
            robot.set_velocity(0.4, 0.0)
        robot.set_velocity(0.0, 0.0)
        sim.sleep(2.0)
        say("stands", min(robot.lrf.next(PATIENCE).ranges[60:120]))


def begins_late(first_call):
    """A program that does something else after it has launched a run at the highest rate."""
    begun = time.monotonic()
    with ruedo.launch("arena", rate="max", noise=False, disable=["p3at/camera"]) as sim:
        while (stands := sim.state().time) < 2.0:
            time.sleep(0.02)
        say("before", stands, time.monotonic() - begun)
        if first_call == "latest":
            say("latest", sim.robot("p3at").pose.latest(PATIENCE).time, time.monotonic() - begun)
        begun = time.monotonic()
        if first_call == "on_sample":
            done = threading.Event()
            sim.robot("p3at").pose.on_sample(lambda pose: pose.time < 100.0 or done.set())
            done.wait(PATIENCE)
        else:
            sim.sleep(100.0 - sim.time)
        say("after", time.monotonic() - begun)


def many_primitives(sim, name, count):
    robot = sim.robot(name)
    done = 0
    for i in range(int(count)):
        done += robot.rotate(0.02 if i % 2 else -0.02).wait(PATIENCE).done
    say("done", done)


def heard_again(sim, name):
    """Of the server that takes the place of this one."""
    begun = threading.Event()
    sim.on_new_run(lambda _: begun.set())
    sim.robot(name).pose.next(PATIENCE)
    say("heard", "first")
    if begun.wait(AGAIN):
        sim.robot(name).pose.next(AGAIN)
        say("heard", "again")


def read_log(path):
    """As pandas has it; what C++ and Java say beside that is not Python's."""
    log = ruedo.read_log(path)
    say("channels", " ".join(sorted(log)))
    scans, poses = log["p3at/lrf"], log["p3at/pose"]
    say("scans", len(scans), len(scans), scans["utime"].iloc[-1], scans["ranges"].iloc[-1][90])
    say("poses", len(poses), poses["utime"].iloc[-1], poses["position"].iloc[-1][0])


def apart(url, name):
    """What another client of this process, or of the same name, has under way is not its own."""

    def advance(own, robot):
        running = robot.advance(5.0, speed=0.05)
        while running.progress == 0.0 and not running.done:  # done: lost on the way
            time.sleep(0.01)
        with ruedo.connect(url, timeout=60.0, name=own) as second:
            attempt(own or "unnamed", second.robot(name).advance(0.02).wait)
        attempt(f"first_{own or 'unnamed'}", running.wait)

    for own in 4 * (None, "driver"):
        with ruedo.connect(url, timeout=60.0, name=own) as first:
            advance(own, first.robot(name))


def fails(url, how):
    """In a callback. how: what the program does then."""
    failed, others = threading.Event(), []

    def callback(_):
        if not failed.is_set():
            failed.set()
            raise ValueError("a fault of the user's")

    def see(sim):
        sim.robot("p3at").odometry.on_sample(others.append)
        sim.robot("p3at").odometry.on_sample(callback)  # the last call before the one that throws
        if how != "sleep":  # while that waits
            failed.wait(PATIENCE)
            time.sleep(0.3)  # that it is kept

    sim = ruedo.connect(url, timeout=60.0)
    if how == "forget":
        see(sim)
        return
    if how == "close":
        see(sim)
        attempt("raised", sim.close)
        attempt("once", sim.close)
        return
    try:
        with sim:
            see(sim)
            if how == "other":
                raise LookupError("another fault")
            if how == "leave":
                return
            odometry = sim.robot("p3at").odometry
            calls = {
                "latest": odometry.latest,
                "sleep": lambda: sim.sleep(PATIENCE),
                "command": lambda: sim.robot("p3at").set_velocity(0.0, 0.0),
                "request": sim.state,
            }
            attempt("raised", calls[how])
            attempt("once", odometry.latest)
            deadline = time.monotonic() + PATIENCE  # the next sample comes sooner or later
            while len(others) < 2 and time.monotonic() < deadline:
                time.sleep(0.01)
            say("others", len(others) > 1)
    except LookupError as error:
        say("won", error)


def ends(url, call):
    """The run, while a call waits for it."""
    with ruedo.connect(url, timeout=60.0) as sim:
        robot, ended = sim.robot("p3at"), threading.Event()

        def fail(_):
            ended.wait(PATIENCE)
            raise ValueError("a fault of the user's")

        def read():
            while True:
                robot.odometry.next(PATIENCE)

        def step():
            while True:
                sim.step(20)

        if call == "uncaught_failed":
            robot.odometry.on_sample(fail)
        if not sim.lockstep:
            sim.resume()
        say("joined")
        if call.startswith("uncaught"):
            try:
                sim.sleep(PATIENCE)
            finally:
                ended.set()
                time.sleep(0.3)
        calls = {
            "next": read,
            "sleep": lambda: sim.sleep(PATIENCE),
            "wait": lambda: robot.advance(5.0, speed=0.01).wait(),
            "step": step,
        }
        attempt("ended", calls[call])
        attempt("request", sim.state)


def stands(url, call):
    """Sim time, while this waits for a motion ("wait", "sleep"), or in lockstep ("idle",
    "stepped").
    """
    with ruedo.connect(url, name="waits", timeout=60.0) as sim:
        if call == "stepped":
            sim.step(1)
        if call in ("wait", "sleep"):
            motion = sim.robot("p3at").advance(1.0)
            attempt("timeout", lambda: motion.wait(1.2))
        threading.Timer(8.0, sim.close).start()
        attempt("ended", motion.wait if call == "wait" else lambda: sim.sleep(1.0))


def main():
    url, command, *rest = sys.argv[1:]
    if command in ("fails", "ends", "stands"):
        {"fails": fails, "ends": ends, "stands": stands}[command](url, *rest)
        return
    try:
        if command == "apart":
            apart(url, *rest)
            return
        launching = {"launch_with": launched_with, "keeps_up": keeps_up, "begins_late": begins_late}
        if command in launching or command == "log":
            launching.get(command, read_log)(*rest)
            return
        if command == "launch":
            launched(ruedo.launch(rest[0], seed=3, args=rest[1:]))
        with ruedo.connect(
            url,
            name=rest[0]
            if command in ("lockstep", "visited", "watches", "leaves", "beside", "joints")
            else None,
            timeout=2.0 if command == "connect" else 60.0,
        ) as sim:
            actions = {
                "lockstep": lambda: lockstep(sim, *rest[1:]),
                "given_up": lambda: given_up(sim),
                "visited": lambda: visited(sim, *rest[1:]),
                "watches": lambda: watches(sim, *rest[1:]),
                "leaves": lambda: leaves(sim, *rest[1:]),
                "beside": lambda: beside(sim, *rest[1:]),
                "joints": lambda: joints(sim, *rest[1:]),
                "sideways": lambda: sideways(sim, *rest),
                "connect": lambda: say("connected", sim.world),
                "list": lambda: list_all(sim),
                "read": lambda: read(sim, *rest),
                "velocity": lambda: drive(sim, *rest, False),
                "wheels": lambda: drive(sim, *rest, True),
                "primitives": lambda: primitives(sim, *rest),
                "many_primitives": lambda: many_primitives(sim, *rest),
                "heard_again": lambda: heard_again(sim, *rest),
                "collisions": lambda: collisions(sim, *rest),
                "errors": lambda: errors(sim, *rest),
                "markers": lambda: markers(sim, *rest),
                "streams": lambda: streams(sim, *rest),
                "sleeps": lambda: sleeps(sim, *rest),
                "control": lambda: control(sim, *rest),
                "world": lambda: world(sim, *rest),
                "snapshots": lambda: snapshots(sim),
                "quit": lambda: (sim.quit(), say("quit", True)),
            }
            actions[command]()
    except ruedo.RuedoError as error:
        say("failed", f"{type(error).__name__}:", str(error).replace("\n", " "))


main()
