"""Random worlds with all that keeps a state, and random commands: for test_snapshots.py."""

import random

import numpy as np
from ruedo import lcmtypes

PLANE = "<model name='ground'><static>true</static><link name='l'><collision name='c'><geometry><plane><normal>0 0 1</normal></plane></geometry></collision></link></model>"
NOISE = "<noise type='gaussian'><mean>0</mean><stddev>0.01</stddev><bias_mean>0.1</bias_mean><bias_stddev>0.02</bias_stddev><dynamic_bias_stddev>0.05</dynamic_bias_stddev><dynamic_bias_correlation_time>2</dynamic_bias_correlation_time></noise>"
PICTURE = "<horizontal_fov>1.2</horizontal_fov><image><width>16</width><height>12</height></image><clip><near>0.1</near><far>10</far></clip>"
# Every kind of sensor that stands in a file, with noise that wanders where it has some.
SENSORS = f"""
<sensor name='imu' type='imu'><update_rate>50</update_rate><imu>
{"".join(f"<{what}>" + "".join(f"<{axis}>{NOISE}</{axis}>" for axis in "xyz") + f"</{what}>" for what in ("angular_velocity", "linear_acceleration"))}
</imu></sensor>
<sensor name='gps' type='navsat'><update_rate>5</update_rate><navsat><position_sensing><horizontal>{NOISE}</horizontal></position_sensing></navsat></sensor>
<sensor name='compass' type='magnetometer'><update_rate>10</update_rate><magnetometer><x>{NOISE}</x></magnetometer></sensor>
<sensor name='altimeter' type='altimeter'><update_rate>10</update_rate><altimeter><vertical_position>{NOISE}</vertical_position></altimeter></sensor>
<sensor name='barometer' type='air_pressure'><update_rate>10</update_rate><air_pressure><pressure>{NOISE}</pressure></air_pressure></sensor>
<sensor name='pitot' type='air_speed'><update_rate>10</update_rate><air_speed><pressure>{NOISE}</pressure></air_speed></sensor>
<sensor name='bumper' type='contact'><update_rate>30</update_rate><contact><collision>c</collision></contact></sensor>
<sensor name='logical' type='logical_camera'><update_rate>7</update_rate><logical_camera><near>0.1</near><far>5</far><horizontal_fov>2</horizontal_fov><aspect_ratio>1</aspect_ratio></logical_camera></sensor>
<sensor name='scan' type='gpu_lidar'><pose>0 0 0.3 0 0 0</pose><update_rate>10</update_rate><lidar><scan><horizontal><samples>24</samples><min_angle>-1.5</min_angle><max_angle>1.5</max_angle></horizontal></scan><range><min>0.05</min><max>8</max></range>{NOISE}</lidar></sensor>
<sensor name='sweep' type='gpu_lidar'><pose>0 0 0.3 0 0 0</pose><update_rate>9</update_rate><ruedo:sweep_time>0.08</ruedo:sweep_time><lidar><scan><horizontal><samples>16</samples><min_angle>-3</min_angle><max_angle>3</max_angle></horizontal></scan><range><min>0.05</min><max>8</max></range>{NOISE}</lidar></sensor>
<sensor name='sonar' type='sonar'><pose>0.3 0 0.2 0 0 0</pose><update_rate>20</update_rate><sonar><min>0.1</min><max>4</max><radius>0.6</radius></sonar></sensor>
<sensor name='camera' type='camera'><pose>0.3 0 0.2 0 0 0</pose><update_rate>4</update_rate><camera>{PICTURE}<noise><type>gaussian</type><stddev>0.02</stddev></noise></camera></sensor>
<sensor name='thermal' type='thermal'><pose>0.3 0 0.2 0 0 0</pose><update_rate>3</update_rate><camera>{PICTURE}</camera></sensor>
"""
SHAPES = {
    "box": lambda r: f"<box><size>{r(0.1, 0.5)} {r(0.1, 0.5)} {r(0.1, 0.4)}</size></box>",
    "sphere": lambda r: f"<sphere><radius>{r(0.1, 0.25)}</radius></sphere>",
    "cylinder": lambda r: (
        f"<cylinder><radius>{r(0.08, 0.25)}</radius><length>{r(0.1, 0.5)}</length></cylinder>"
    ),
    "capsule": lambda r: (
        f"<capsule><radius>{r(0.08, 0.2)}</radius><length>{r(0.1, 0.4)}</length></capsule>"
    ),
    "ellipsoid": lambda r: (
        f"<ellipsoid><radii>{r(0.1, 0.3)} {r(0.1, 0.3)} {r(0.1, 0.3)}</radii></ellipsoid>"
    ),
}
JOINTS = ["revolute", "continuous", "prismatic", "universal", "ball", "screw", "fixed"]
ROBOTS = ["p3at", "p3dx", "mecanum", "omni", "car", "tricycle", "turtle", "crawler", "puck"]
FURNITURE = ["desk", "office_chair", "waste_bin", "bookshelf"]


def inertial(mass, moment=None):
    moment = moment or 0.05 * mass
    return f"<inertial><mass>{mass}</mass><inertia><ixx>{moment}</ixx><iyy>{moment}</iyy><izz>{moment}</izz></inertia></inertial>"


class RandomWorld:
    """A text, and what spawn adds."""

    def __init__(self, seed, pictures=False):
        self.rng = random.Random(seed)
        self.at = lambda low, high: round(self.rng.uniform(low, high), 4)
        parts = [self.floor(), *self.things(), *self.stacks(), *self.slopes(), *self.furniture()]
        parts += [self.arm(f"arm{i}") for i in range(self.rng.choice([0, 1, 1, 2]))]
        parts += [self.sensing_robot(pictures)]
        parts += [self.gantry()] if self.rng.random() < 0.5 else []
        parts += [self.belt(), self.door(), self.path()] if self.rng.random() < 0.5 else []
        if self.rng.random() < 0.4:
            parts.append(
                "<ruedo:crowd name='people'><ruedo:count>4</ruedo:count><ruedo:area>-5 -5 5 5</ruedo:area></ruedo:crowd>"
            )
        if self.rng.random() < 0.4:
            parts.append(
                "<wind><linear_velocity>3 1 0</linear_velocity></wind><plugin filename='gz-sim-wind-effects-system' name='gz::sim::systems::WindEffects'>"
                "<force_approximation_scaling_factor>0.5</force_approximation_scaling_factor></plugin>"
            )
        step = self.rng.choice([0.001, 0.005, 0.005, 0.01])
        self.text = (
            "<sdf version='1.9' xmlns:ruedo='urn:ruedo'><world name='w'><spherical_coordinates><latitude_deg>21</latitude_deg><longitude_deg>-101</longitude_deg><elevation>2000</elevation></spherical_coordinates>"
            f"<physics type='bullet'><max_step_size>{step}</max_step_size></physics>{''.join(parts)}</world></sdf>"
        )
        self.spawn = [
            f"{kind}@{7 * (-1) ** i},{self.at(-4, 4)},{self.at(-3, 3)}"
            for i, kind in enumerate(self.rng.sample(ROBOTS, self.rng.choice([1, 2])))
        ]
        self.fault = self.rng.choice(
            [
                [],
                ["r/scan:lag@0.2,value=0.15"],
                ["r/imu:freeze@0.4,for=1"],
                ["r/left:wheel_slip@0.1,value=0.5"],
            ]
        )

    def pose(self, z=1.0, reach=3.0):
        r = self.at
        return f"<pose>{r(-reach, reach)} {r(-reach, reach)} {z} {r(-1, 1)} {r(-1, 1)} {r(-3, 3)}</pose>"

    def floor(self):
        if self.rng.random() < 0.6:
            return PLANE
        return "<model name='floor'><static>true</static><pose>0 0 -0.5 0 0 0</pose><link name='l'><collision name='c'><geometry><box><size>30 30 1</size></box></geometry></collision></link></model>"

    def shape(self, kind=None):
        return SHAPES[kind or self.rng.choice(list(SHAPES))](self.at)

    def thing(self, name, pose, parts=1, mass=1.0):
        collisions = "".join(
            f"<collision name='c{i}'><pose>{self.at(-0.2, 0.2) if i else 0} 0 {self.at(-0.2, 0.2) if i else 0} 0 0 0</pose><geometry>{self.shape()}</geometry></collision>"
            for i in range(parts)
        )
        wind = "<enable_wind>true</enable_wind>" if self.rng.random() < 0.3 else ""
        return f"<model name='{name}'>{pose}<link name='l'>{inertial(mass)}{collisions}{wind}</link></model>"

    def things(self):
        return [
            self.thing(
                f"thing{i}",
                self.pose(self.at(0.3, 1.5)),
                self.rng.choice([1, 1, 2, 3]),
                self.at(0.3, 4),
            )
            for i in range(self.rng.randint(2, 8))
        ]

    def stacks(self):
        x, y = self.at(-3, 3), self.at(-3, 3)
        return [
            f"<model name='stack{i}'><pose>{x} {y} {0.1 + 0.2 * i} 0 0 {0.1 * i}</pose><link name='l'>{inertial(0.5, 0.004)}<collision name='c'><geometry><box><size>0.3 0.3 0.2</size></box></geometry></collision></link></model>"
            for i in range(self.rng.randint(0, 5))
        ]

    def slopes(self):
        return [
            f"<model name='slope{i}'><static>true</static><pose>{self.at(-4, 4)} {self.at(-4, 4)} 0 0 {self.at(0.1, 0.5)} {self.at(-3, 3)}</pose><link name='l'><collision name='c'><geometry><box><size>2 1.5 0.1</size></box></geometry></collision></link></model>"
            for i in range(self.rng.randint(0, 3))
        ]

    def furniture(self):
        return [
            f"<include><uri>model://{self.rng.choice(FURNITURE)}</uri><name>furniture{i}</name><static>{str(self.rng.random() < 0.4).lower()}</static><pose>{self.at(-4, 4)} {self.at(-4, 4)} 0.02 0 0 {self.at(-3, 3)}</pose></include>"
            for i in range(self.rng.randint(0, 2))
        ]

    def arm(self, name):
        base = self.rng.random() < 0.6
        links = [
            f"<link name='l0'><pose>0 0 0.2 0 0 0</pose>{inertial(3)}<collision name='c'><geometry><box><size>0.3 0.3 0.3</size></box></geometry></collision><sensor name='feel' type='imu'><update_rate>30</update_rate></sensor></link>"
        ]
        if base:
            links.append(
                "<joint name='fast' type='fixed'><parent>world</parent><child>l0</child></joint>"
            )
        for i in range(1, self.rng.randint(2, 5)):
            kind = self.rng.choice(JOINTS)
            axis = self.rng.choice(["1 0 0", "0 1 0", "0 0 1"])
            other = {"1 0 0": "0 1 0", "0 1 0": "0 0 1", "0 0 1": "1 0 0"}[axis]
            limit = self.rng.choice(
                [
                    "",
                    "<limit><lower>-1</lower><upper>1</upper></limit>",
                    "<limit><lower>-7</lower><upper>7</upper><effort>20</effort></limit>",
                ]
            )
            dynamics = self.rng.choice(
                [
                    "",
                    "<dynamics><damping>0.5</damping><friction>0.1</friction></dynamics>",
                    "<dynamics><spring_stiffness>5</spring_stiffness></dynamics>",
                ]
            )
            second = (
                f"<axis2><xyz>{other}</xyz><limit><lower>-1</lower><upper>1</upper></limit></axis2>"
                if kind == "universal"
                else ""
            )
            pitch = "<screw_thread_pitch>0.3</screw_thread_pitch>" if kind == "screw" else ""
            sensor = (
                f"<sensor name='wrench{i}' type='force_torque'><update_rate>20</update_rate></sensor>"
                if kind in ("revolute", "fixed")
                else ""
            )
            links.append(
                f"<link name='l{i}'><pose>{0.3 * i} 0 0.3 0 0 0</pose>{inertial(0.7, 0.02)}<collision name='c'><geometry><box><size>0.2 0.08 0.08</size></box></geometry></collision></link>"
                f"<joint name='j{i}' type='{kind}'><pose>-0.15 0 0 0 0 0</pose><parent>l{i - 1}</parent><child>l{i}</child><axis><xyz>{axis}</xyz>{limit}{dynamics}</axis>{second}{pitch}{sensor}</joint>"
            )
        return f"<model name='{name}'><pose>{self.at(-4, 4)} {self.at(-4, 4)} 0 0 0 0</pose>{''.join(links)}</model>"

    def sensing_robot(self, pictures):
        sensors = SENSORS if pictures else SENSORS[: SENSORS.index("<sensor name='camera'")]
        return (
            f"<model name='r'><pose>{self.at(-2, 2)} {self.at(-2, 2)} 0 0 0 {self.at(-3, 3)}</pose><link name='body'><pose>0 0 0.2 0 0 0</pose>{inertial(10)}<collision name='c'><geometry><box><size>0.5 0.4 0.2</size></box></geometry></collision>{sensors}</link>"
            "<link name='left'><pose>0 0.25 0.1 -1.5707963 0 0</pose><inertial><mass>0.5</mass></inertial><collision name='c'><geometry><cylinder><radius>0.1</radius><length>0.05</length></cylinder></geometry></collision></link>"
            "<link name='right'><pose>0 -0.25 0.1 -1.5707963 0 0</pose><inertial><mass>0.5</mass></inertial><collision name='c'><geometry><cylinder><radius>0.1</radius><length>0.05</length></cylinder></geometry></collision></link>"
            "<joint name='lj' type='revolute'><parent>body</parent><child>left</child><axis><xyz expressed_in='__model__'>0 1 0</xyz></axis></joint>"
            "<joint name='rj' type='revolute'><parent>body</parent><child>right</child><axis><xyz expressed_in='__model__'>0 1 0</xyz></axis></joint>"
            "<link name='mast'><pose>0 0 0.5 0 0 0</pose><inertial><mass>0.3</mass></inertial></link><joint name='tilt' type='revolute'><parent>body</parent><child>mast</child><axis><xyz>0 1 0</xyz></axis></joint>"
            "<ruedo:drive><ruedo:left_joint>lj</ruedo:left_joint><ruedo:right_joint>rj</ruedo:right_joint></ruedo:drive></model>"
        )

    def gantry(self):
        return (
            f"<model name='gantry'><pose>0 0 1.5 0 0 0</pose><link name='base'>{inertial(2)}<sensor name='imu' type='imu'/></link><joint name='fast' type='fixed'><parent>world</parent><child>base</child></joint>"
            "<plugin filename='gz-sim-detachable-joint-system' name='gz::sim::systems::DetachableJoint'><parent_link>base</parent_link><child_model>held</child_model><child_link>l</child_link></plugin></model>"
            f"<model name='held'><pose>0.5 0 1 0 0 0</pose><link name='l'>{inertial(1)}<collision name='c'><geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision></link></model>"
        )

    def belt(self):
        return (
            "<model name='belt'><pose>-3 0 0.1 0 0 0</pose><link name='l'><collision name='c'><geometry><box><size>2 1 0.2</size></box></geometry></collision></link><ruedo:belt><ruedo:velocity>0.4 0 0</ruedo:velocity></ruedo:belt></model>"
            + self.thing("goods", "<pose>-3.5 0 0.5 0 0 0</pose>")
        )

    def door(self):
        return (
            "<model name='door'><pose>2 0 1 0 0 0</pose><link name='l'><collision name='c'><geometry><box><size>0.1 1 2</size></box></geometry></collision></link>"
            "<ruedo:door><ruedo:open>0 1.1 0 0 0 0</ruedo:open><ruedo:time>1</ruedo:time><ruedo:distance>1.5</ruedo:distance><ruedo:hold>0.5</ruedo:hold></ruedo:door></model>"
        )

    def path(self):
        return (
            "<model name='cart'><link name='l'><collision name='c'><geometry><box><size>0.5 0.5 0.5</size></box></geometry></collision></link>"
            "<ruedo:path><ruedo:waypoint>0 -3 -2 0.25 0 0 0</ruedo:waypoint><ruedo:waypoint>2 3 -2 0.25 0 0 0</ruedo:waypoint></ruedo:path></model>"
        )


class Commands:
    """Random commands of each decision, the same for a seed: velocities, and (channel, message)."""

    def __init__(self, seed, engine, joints):
        self.rng = random.Random(seed)
        self.robots, self.joints, self.made = engine.robots, joints, []

    def __getitem__(self, decision):
        while len(self.made) <= decision:
            self.made.append(self.make(len(self.made)))
        return self.made[decision]

    def make(self, decision):
        rng, others = self.rng, []
        velocities = np.full((len(self.robots), 3), np.nan)
        for i, name in enumerate(self.robots):
            chance = rng.random()
            if chance < 0.6:
                velocities[i] = rng.uniform(-0.8, 1.2), rng.uniform(-0.3, 0.3), rng.uniform(-2, 2)
            elif chance < 0.75:
                move = lcmtypes.move_command_t()
                # Without a number: the same decision may be made again in one run.
                move.id, move.kind, move.value = 0, rng.choice([1, 2]), rng.uniform(-1, 1)
                others.append((name + "/move", move))
        for robot, names in self.joints.items():
            if not names or rng.random() < 0.5:
                continue
            command = lcmtypes.joint_command_t()
            command.name = rng.sample(names, rng.randint(1, len(names)))
            command.n = len(command.name)
            if command.name == ["held"]:
                command.mode, command.value = (
                    [lcmtypes.joint_command_t.ATTACHED],
                    [rng.choice([0.0, 1.0])],
                )
            else:
                command.mode = [rng.choice([0, 1, 2]) for _ in command.name]
                command.value = [rng.uniform(-1.5, 1.5) for _ in command.name]
            others.append((robot + "/joint_command", command))
        return velocities, others


def joint_names(engine):
    """{robot: names} of a new engine with record=True, which is reset."""
    names = {}
    engine.step(None, 200)
    for _, _, channel, data in engine.messages():
        robot, _, device = channel.partition("/")
        if device == "joints":
            names[robot] = list(lcmtypes.joint_state_t.decode(data).joint_name)
    if "gantry" in {robot for robot, _, _ in engine.devices}:
        names["gantry"] = ["held"]
    engine.reset()
    return names


def run(engine, world, commands, decisions, steps):
    """What a copy sends, and the hashes of its states; other copies stay as they are."""
    told = []
    mask = np.zeros(engine.worlds, bool)
    mask[world] = True
    for decision in decisions:
        own, others = commands[decision]
        for channel, message in others:
            engine.command(world, channel, message)
        velocities = np.full((engine.worlds, len(engine.robots), 3), np.nan)
        velocities[world] = own
        engine.step(velocities, steps, worlds=mask)
        told.append([one[1:] for one in engine.messages()])
        told.append(engine.state_hash(world))
    return told
