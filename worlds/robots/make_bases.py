#!/usr/bin/env python3
"""Makes a robot for each kind of drive: a car, a tricycle, a mecanum, an omni, a holonomic
and a tracked base; a small one for lessons, and one with an arm.

    worlds/robots/make_bases.py [FOLDER]

Writes NAME/model.sdf and NAME/model.config below FOLDER (this one, where none is given). Bodies are
boxes and cylinders, so that no mesh is needed; every robot has a laser range finder and an IMU.
Dimensions and masses are our own.
"""

import math
import sys
from pathlib import Path

HEAD = '<?xml version="1.0"?>\n<!-- Made by worlds/robots/make_bases.py. {about} -->\n<sdf version="1.9" xmlns:ruedo="urn:ruedo">\n  <model name="{name}">\n'


def number(value):
    return f"{value:.9g}"


def numbers(values):
    return " ".join(number(value) for value in values)


def inertia(mass, x, y, z):
    """Of a box, by its lengths."""
    moments = [
        mass / 12 * (y * y + z * z),
        mass / 12 * (x * x + z * z),
        mass / 12 * (x * x + y * y),
    ]
    return "".join(
        f"<i{axis * 2}>{number(moment)}</i{axis * 2}>" for axis, moment in zip("xyz", moments)
    )


def colour(rgb):
    return f"<material><ambient>{numbers(rgb)} 1</ambient><diffuse>{numbers(rgb)} 1</diffuse></material>"


def shape(kind, pose, geometry, rgb=None, name="body"):
    """A collision and a visual of one geometry; pose of both."""
    text = f"<pose>{numbers(pose)}</pose><geometry>{geometry}</geometry>"
    both = f'      <visual name="{name}">{text}{colour(rgb)}</visual>\n'
    return f'      <collision name="{name}">{text}{kind}</collision>\n' + both


SLIDES = "<surface><friction><ode><mu>0</mu><mu2>0</mu2></ode></friction></surface>"
PADS = "<friction><ode><mu>1.5</mu><mu2>1.5</mu2></ode></friction>"
SERVO = "<ruedo:position_gain>20</ruedo:position_gain>"
GREY, BLUE, RED, GREEN, DARK = (
    (0.6, 0.6, 0.62),
    (0.16, 0.33, 0.6),
    (0.6, 0.15, 0.12),
    (0.2, 0.45, 0.25),
    (0.1, 0.1, 0.1),
)


def body(mass, size, ground, rgb, sensors, extra=""):
    """The base link: a box whose underside is `ground` above the floor."""
    _x, _y, z = size
    middle = ground + z / 2
    text = (
        f'    <link name="base_link">\n      <inertial><pose>0 0 {number(middle)} 0 0 0</pose><mass>{number(mass)}</mass>'
        f"<inertia>{inertia(mass, *size)}</inertia></inertial>\n"
    )
    text += shape("", (0, 0, middle, 0, 0, 0), f"<box><size>{numbers(size)}</size></box>", rgb)
    return text + extra + sensors + "    </link>\n"


def sensors(height, ahead=0.0):
    """A range finder on a mast of its own, and an IMU in the middle."""
    mast = shape(
        "",
        (ahead, 0, height - 0.045, 0, 0, 0),
        "<cylinder><radius>0.04</radius><length>0.05</length></cylinder>",
        DARK,
        "lidar",
    )
    return (
        mast
        + f"""      <sensor name="lrf" type="gpu_lidar">
        <pose>{number(ahead)} 0 {number(height)} 0 0 0</pose><update_rate>10</update_rate>
        <lidar>
          <scan><horizontal><samples>360</samples><min_angle>-3.1241393</min_angle><max_angle>3.1415927</max_angle></horizontal></scan>
          <range><min>0.1</min><max>12</max></range><noise><type>gaussian</type><stddev>0.01</stddev></noise>
        </lidar>
      </sensor>
      <sensor name="imu" type="imu"><pose>0 0 {number(height / 2)} 0 0 0</pose><update_rate>100</update_rate></sensor>
"""
    )


def wheel(name, x, y, radius, width, axis=0.0, mass=1.0):
    """A wheel on the ground at (x, y); axis: the heading that it rolls towards, rad."""
    tube = mass * (3 * radius * radius + width * width) / 12
    link = (
        f'    <link name="{name}"><pose>{numbers((x, y, radius, 0, 0, axis))}</pose>\n      <inertial><mass>{number(mass)}</mass><inertia><ixx>{number(tube)}</ixx>'
        f"<iyy>{number(mass * radius * radius / 2)}</iyy><izz>{number(tube)}</izz></inertia></inertial>\n"
    )
    link += shape(
        "",
        (0, 0, 0, math.pi / 2, 0, 0),
        f"<cylinder><radius>{number(radius)}</radius><length>{number(width)}</length></cylinder>",
        DARK,
        "tyre",
    )
    return link + "    </link>\n"


def joint(name, parent, child, axis="0 1 0", kind="continuous", limit=None):
    limits = (
        f"<limit><lower>{number(-limit)}</lower><upper>{number(limit)}</upper></limit>"
        if limit
        else ""
    )
    return f'    <joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child><axis><xyz>{axis}</xyz>{limits}</axis></joint>\n'


def knuckle(name, x, y, z, limit):
    """The part that carries a steered wheel, and its joint."""
    link = f'    <link name="{name}"><pose>{numbers((x, y, z, 0, 0, 0))}</pose><inertial><mass>0.3</mass><inertia>{inertia(0.3, 0.05, 0.05, 0.05)}</inertia></inertial></link>\n'
    return link + joint(f"{name}_joint", "base_link", name, "0 0 1", "revolute", limit)


def drive(steering, elements):
    lines = "".join(f"      <ruedo:{name}>{value}</ruedo:{name}>\n" for name, value in elements)
    return f'    <ruedo:drive steering="{steering}">\n{lines}    </ruedo:drive>\n'


def limits(speed, turn, acceleration, turn_acceleration, side=None):
    return (
        [("max_speed", speed)]
        + ([("max_side_speed", side)] if side else [])
        + [
            ("max_turn_rate", turn),
            ("acceleration", acceleration),
            ("turn_acceleration", turn_acceleration),
        ]
    )


def car():
    """Two steered wheels ahead: the smallest circle has a radius of 0.8 m."""
    radius, base, track, most = 0.1, 0.5, 0.36, 0.56
    text = body(
        12,
        (0.66, 0.28, 0.14),
        0.08,
        BLUE,
        sensors(0.32, 0.2).replace("<pose>0 0 0.16", "<pose>0.25 0 0.16"),
    )
    text = text.replace(
        "<pose>0 0 0.15 0 0 0</pose>", f"<pose>{number(base / 2)} 0 0.15 0 0 0</pose>"
    )
    for side, y in (("left", track / 2), ("right", -track / 2)):
        text += wheel(f"rear_{side}", 0, y, radius, 0.06) + joint(
            f"rear_{side}_joint", "base_link", f"rear_{side}"
        )
        text += knuckle(f"{side}_knuckle", base, y, radius, 0.7) + wheel(
            f"front_{side}", base, y, radius, 0.06
        )
        text += joint(f"front_{side}_joint", f"{side}_knuckle", f"front_{side}")
    text += drive(
        "ackermann",
        [
            ("left_joint", "rear_left_joint"),
            ("left_joint", "front_left_joint"),
            ("right_joint", "rear_right_joint"),
            ("right_joint", "front_right_joint"),
            ("steer_joint", "left_knuckle_joint"),
            ("steer_joint", "right_knuckle_joint"),
            ("max_steering_angle", most),
            ("max_steering_rate", 2),
        ]
        + limits(2, 2.5, 1.5, 6),
    )
    return "A car: bicycle model about the middle of the rear axle.", text


def tricycle():
    """One driven and steered wheel ahead, two free ones."""
    radius, base, track = 0.1, 0.55, 0.44
    text = body(20, (0.3, 0.36, 0.2), 0.1, GREEN, sensors(0.4))
    for side, y in (("left", track / 2), ("right", -track / 2)):
        text += wheel(f"rear_{side}", 0, y, radius, 0.05) + joint(
            f"rear_{side}_joint", "base_link", f"rear_{side}"
        )
    text += knuckle("fork", base, 0, radius, 1.5).replace(
        "</inertial></link>",
        "</inertial>\n"
        + shape("", (0, 0, 0.14, 0, 0, 0), "<box><size>0.08 0.1 0.03</size></box>", GREEN)
        + "    </link>",
    )
    text += wheel("front", base, 0, radius, 0.05) + joint("front_joint", "fork", "front")
    text += drive(
        "tricycle",
        [
            ("wheel_joint", "front_joint"),
            ("left_joint", "rear_left_joint"),
            ("right_joint", "rear_right_joint"),
            ("steer_joint", "fork_joint"),
            ("max_steering_angle", 1.4),
            ("max_steering_rate", 3),
        ]
        + limits(1.5, 2, 1, 4),
    )
    return "A tricycle: driven and steered by its front wheel.", text


def four(name, steering, rgb, about):
    radius, base, track = 0.08, 0.36, 0.34
    text = body(18, (0.5, 0.26, 0.14), 0.06, rgb, sensors(0.3))
    for side, y in (("left", track / 2), ("right", -track / 2)):
        for end, x in (("front", base / 2), ("rear", -base / 2)):
            text += wheel(f"{end}_{side}", x, y, radius, 0.07) + joint(
                f"{end}_{side}_joint", "base_link", f"{end}_{side}"
            )
    joints = [
        (f"{side}_joint", f"{end}_{side}_joint")
        for side in ("left", "right")
        for end in ("front", "rear")
    ]
    side = 0.8 if steering == "mecanum" else None
    text += drive(steering, joints + limits(1, 2, 1, 4, side))
    return about, text


def omni():
    """Three wheels at 120 degrees, which roll along the circle through them."""
    radius, around = 0.05, 0.18
    text = body(8, (0.22, 0.22, 0.12), 0.06, RED, sensors(0.28))
    elements = []
    for i, degrees in enumerate((0, 120, 240), 1):
        angle = math.radians(degrees)
        text += wheel(
            f"wheel_{i}",
            around * math.cos(angle),
            around * math.sin(angle),
            radius,
            0.03,
            angle + math.pi / 2,
            0.5,
        )
        text += joint(f"wheel_{i}_joint", "base_link", f"wheel_{i}")
        elements.append(("wheel_joint", f"wheel_{i}_joint"))
    text += drive("omni", elements + limits(0.8, 2.5, 1, 5, 0.8))
    return "Three omni wheels.", text


def puck():
    """Holonomic: its wheels do not turn, as with Gazebo's planar move."""
    text = (
        '    <link name="base_link">\n      <inertial><pose>0 0 0.07 0 0 0</pose><mass>6</mass><inertia>'
        + inertia(6, 0.3, 0.3, 0.14)
        + "</inertia></inertial>\n"
        + shape(
            SLIDES,
            (0, 0, 0.07, 0, 0, 0),
            "<cylinder><radius>0.17</radius><length>0.14</length></cylinder>",
            GREY,
        )
        + sensors(0.24)
        + "    </link>\n"
    )
    text += drive("holonomic", limits(1, 2, 2, 5, 1))
    return "A disc that moves in every direction.", text


def round_base(mass, shell, ground, high, radius, track, more=""):
    """Two wheels in the middle, and a ball in front and one behind, on which it slides."""
    middle = ground + high / 2
    text = (
        f'    <link name="base_link">\n      <inertial><pose>0 0 {number(middle)} 0 0 0</pose><mass>{number(mass)}</mass>'
        f"<inertia>{inertia(mass, 1.7 * shell, 1.7 * shell, high)}</inertia></inertial>\n"
    )
    text += shape(
        "",
        (0, 0, middle, 0, 0, 0),
        f"<cylinder><radius>{number(shell)}</radius><length>{number(high)}</length></cylinder>",
        DARK,
    )
    ball = ground / 2 + 0.004
    for name, x in (("caster_front", 0.75 * shell), ("caster_rear", -0.75 * shell)):
        text += shape(
            SLIDES,
            (x, 0, ball, 0, 0, 0),
            f"<sphere><radius>{number(ball)}</radius></sphere>",
            GREY,
            name,
        )
    text += more + "    </link>\n"
    for side, y in (("left", track / 2), ("right", -track / 2)):
        text += wheel(f"{side}_wheel", 0, y, radius, 0.02, mass=0.1) + joint(
            f"{side}_joint", "base_link", f"{side}_wheel"
        )
    return text


def turtle():
    """A small round robot for lessons, with a range finder, a camera and an IMU."""
    plates = "".join(
        shape(
            "",
            (0, 0, z, 0, 0, 0),
            "<cylinder><radius>0.14</radius><length>0.012</length></cylinder>",
            GREY,
            f"plate_{i}",
        )
        for i, z in enumerate((0.19, 0.27))
    )
    posts = "".join(
        shape(
            "",
            (0.1 * math.cos(a), 0.1 * math.sin(a), 0.185, 0, 0, 0),
            "<cylinder><radius>0.008</radius><length>0.17</length></cylinder>",
            DARK,
            f"post_{i}",
        )
        for i, a in enumerate((0.8, 2.35, 3.93, 5.5))
    )
    camera = (
        '      <sensor name="camera" type="camera">\n        <pose>0.13 0 0.22 0 0 0</pose><update_rate>15</update_rate>\n        <camera><horizontal_fov>1.05</horizontal_fov>'
        "<image><width>320</width><height>240</height></image><clip><near>0.05</near><far>30</far></clip></camera>\n      </sensor>\n"
    )
    text = round_base(3.4, 0.17, 0.02, 0.08, 0.036, 0.235, plates + posts + sensors(0.35) + camera)
    text += drive(
        "differential",
        [("left_joint", "left_joint"), ("right_joint", "right_joint")] + limits(0.5, 2, 0.8, 4),
    )
    return (
        "A small round robot for lessons: two wheels, a range finder all around, a camera and an IMU.",
        text,
    )


def segment(name, parent, at, length, mass, axis, most, effort):
    """A link of the arm, upright above its joint, and the joint."""
    x, y, z = at
    link = (
        f'    <link name="{name}"><pose>{numbers((x, y, z, 0, 0, 0))}</pose>\n      <inertial><pose>0 0 {number(length / 2)} 0 0 0</pose><mass>{number(mass)}</mass>'
        f"<inertia>{inertia(mass, 0.05, 0.05, length)}</inertia></inertial>\n"
    )
    link += (
        shape(
            "",
            (0, 0, length / 2, 0, 0, 0),
            f"<box><size>0.045 0.045 {number(length - 0.01)}</size></box>",
            RED,
            "tube",
        )
        + "    </link>\n"
    )
    return link + (
        f'    <joint name="{name}_joint" type="revolute"><parent>{parent}</parent><child>{name}</child><axis><xyz>{axis}</xyz>'
        f"<limit><lower>{number(-most)}</lower><upper>{number(most)}</upper><effort>{number(effort)}</effort><velocity>2</velocity></limit>"
        f"<dynamics><damping>0.1</damping></dynamics>{SERVO}</axis></joint>\n"
    )


def finger(side, at):
    """A finger that slides inwards from 0, on the hand: 4 cm at most, with 20 N."""
    x, y, z = at
    size, name = (0.03, 0.01, 0.07), f"{side}_finger"
    pads = f"<surface>{PADS}</surface>"
    text = f'    <link name="{name}"><pose>{numbers((x, y, z, 0, 0, 0))}</pose>\n      <inertial><pose>0 0 0.035 0 0 0</pose><mass>0.1</mass>'
    text += f"<inertia>{inertia(0.1, *size)}</inertia></inertial>\n"
    box = f"<box><size>{numbers(size)}</size></box>"
    text += shape(pads, (0, 0, 0.035, 0, 0, 0), box, DARK, "pad") + "    </link>\n"
    return text + (
        f'    <joint name="{name}_joint" type="prismatic"><parent>hand</parent><child>{name}</child>'
        f"<axis><xyz>0 {'-1' if y > 0 else '1'} 0</xyz><limit><lower>0</lower><upper>0.04</upper><effort>20</effort>"
        f"<velocity>0.1</velocity></limit>{SERVO}</axis></joint>\n"
    )


def carrier():
    """An arm of four joints and a gripper on a base of two wheels; joint_command moves it."""
    text = round_base(25, 0.26, 0.03, 0.24, 0.08, 0.4, sensors(0.34, 0.18))
    parent, z = "base_link", 0.27
    for name, length, mass, axis, most, effort in (
        ("turret", 0.08, 1.0, "0 0 1", 3.0, 20),
        ("upper_arm", 0.3, 1.2, "0 1 0", 1.9, 40),
        ("forearm", 0.26, 0.8, "0 1 0", 2.4, 25),
        ("hand", 0.1, 0.3, "0 1 0", 1.9, 8),
    ):
        text += segment(name, parent, (-0.06, 0, z), length, mass, axis, most, effort)
        parent, z = name, z + length
    text += finger("left", (-0.06, 0.045, z)) + finger("right", (-0.06, -0.045, z))
    text += drive(
        "differential",
        [("left_joint", "left_joint"), ("right_joint", "right_joint")] + limits(0.8, 1.5, 0.6, 3),
    )
    return "An arm of four joints and a gripper on a base of two wheels.", text


ROBOTS = {
    "turtle": turtle,
    "carrier": carrier,
    "car": car,
    "tricycle": tricycle,
    "mecanum": lambda: four(
        "mecanum", "mecanum", RED, "Four mecanum wheels, whose rollers' axes meet in the middle."
    ),
    "omni": omni,
    "puck": puck,
    "crawler": lambda: four(
        "crawler",
        "tracked",
        GREEN,
        "Tracks: the wheels of a side turn as one, and the robot turns by their difference.",
    ),
}


def main():
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent
    for name, make in ROBOTS.items():
        about, text = make()
        (folder / name).mkdir(parents=True, exist_ok=True)
        (folder / name / "model.sdf").write_text(
            HEAD.format(about=about, name=name) + text + "  </model>\n</sdf>\n"
        )
        (folder / name / "model.config").write_text(
            f'<?xml version="1.0"?>\n<model>\n  <name>{name}</name>\n  <version>1.0</version>\n  <sdf version="1.9">model.sdf</sdf>\n'
            f"  <author><name>The Ruedo authors</name></author>\n  <description>{about}</description>\n</model>\n"
        )


if __name__ == "__main__":
    main()
