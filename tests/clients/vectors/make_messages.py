"""Writes messages.txt: messages as lcm-gen's Python encodes them, and what they mean. The values
are chosen here, by hand.
"""

import math
from pathlib import Path

from ruedo import lcmtypes

INF = math.inf
CASES = [
    (
        "planar_lidar_t",
        dict(
            utime=1000,
            nranges=3,
            ranges=[1.5, INF, -INF],
            nintensities=3,
            intensities=[0.0, 0.5, 1.0],
            rad0=-0.5,
            radstep=0.25,
        ),
        "utime 1000|ranges 1.500000 inf -inf|intensities 0.000000 0.500000 1.000000|angles -0.500000 0.000000",
    ),
    (
        "planar_lidar_t",
        dict(utime=-1, nranges=0, ranges=[], nintensities=0, intensities=[], rad0=0.0, radstep=0.0),
        "utime -1|ranges|intensities|angles",
    ),
    (
        "sonar_t",
        dict(utime=2000, n=2, range=[5.0, 0.125], fired_utime=[-1, 1500], fresh=[False, True]),
        "utime 2000|ranges 5.000000 0.125000|fired_utime -1 1500|fresh 0 1",
    ),
    (
        "odometry_t",
        dict(
            utime=9007199254740993,
            x=1.0,
            y=-2.5,
            theta=7.0,
            v=0.25,
            omega=-0.5,
            n=2,
            angle=[0.5, -0.5],
            rate=[1.0, 2.0],
            ticks=[-3, 4294967296],
            resets=2,
        ),
        "utime 9007199254740993|pose 1.000000 -2.500000 7.000000|twist 0.250000 -0.500000|angles 0.500000 -0.500000|rates 1.000000 2.000000|ticks -3 4294967296|resets 2",
    ),
    (
        "odometry_twist_t",
        dict(
            utime=1,
            vx=0.25,
            vy=-0.125,
            omega=1.5,
            covariance=[4.0, 0.5, -0.5, 0.5, 2.0, 0.0, -0.5, 0.0, 1.0],
        ),
        "utime 1|twist 0.250000 -0.125000 1.500000|covariance 4.000000 0.500000 -0.500000 0.500000 2.000000 0.000000 -0.500000 0.000000 1.000000",
    ),
    (
        "pose_t",
        dict(
            utime=3,
            pos=[1.0, 2.0, 0.5],
            vel=[0.25, 0.0, 0.0],
            orientation=[0.0, 0.0, 0.0, 1.0],
            rotation_rate=[0.0, 0.0, -1.0],
            accel=[0.5, 0.0, 0.0],
        ),
        "utime 3|position 1.000000 2.000000 0.500000|orientation 0.000000 0.000000 0.000000 1.000000|velocity 0.250000 0.000000 0.000000"
        "|rotation_rate 0.000000 0.000000 -1.000000|acceleration 0.500000 0.000000 0.000000|heading 3.141593",
    ),
    (
        "imu_t",
        dict(
            utime=4,
            orientation=[1.0, 0.0, 0.0, 0.0],
            angular_velocity=[0.5, 0.25, 0.125],
            linear_acceleration=[0.0, 0.0, 9.75],
        ),
        "utime 4|orientation 1.000000 0.000000 0.000000 0.000000|angular_velocity 0.500000 0.250000 0.125000|linear_acceleration 0.000000 0.000000 9.750000",
    ),
    (
        "navsat_t",
        dict(
            utime=9,
            latitude_deg=-33.5,
            longitude_deg=151.25,
            altitude=20.5,
            velocity=[1.0, -2.0, 0.5],
        ),
        "utime 9|place -33.500000 151.250000 20.500000|velocity 1.000000 -2.000000 0.500000",
    ),
    (
        "magnetometer_t",
        dict(utime=10, field=[0.25, -0.5, 0.125]),
        "utime 10|field 0.250000 -0.500000 0.125000",
    ),
    (
        "altimeter_t",
        dict(utime=11, altitude=-1.5, velocity=0.25),
        "utime 11|altitude -1.500000 0.250000",
    ),
    ("air_pressure_t", dict(utime=12, pressure=101325.0), "utime 12|pressure 101325.000000"),
    (
        "air_speed_t",
        dict(utime=13, differential_pressure=-61.25, temperature=288.15),
        "utime 13|air -61.250000 288.150000",
    ),
    (
        "force_torque_t",
        dict(utime=14, force=[1.0, -2.0, 29.5], torque=[0.25, 0.0, -0.5]),
        "utime 14|force 1.000000 -2.000000 29.500000|torque 0.250000 0.000000 -0.500000",
    ),
    (
        "logical_camera_t",
        dict(
            utime=15,
            n=1,
            objects=[
                dict(model="crate", position=[1.0, -2.0, 0.5], orientation=[1.0, 0.0, 0.0, 0.0])
            ],
        ),
        "utime 15|object crate 1.000000 -2.000000 0.500000 1.000000 0.000000 0.000000 0.000000",
    ),
    (
        "boxes_2d_t",
        dict(
            utime=16,
            width=320,
            height=240,
            n=1,
            boxes=[dict(label=7, name="crate", x=10.5, y=20.0, width=4.0, height=8.0)],
        ),
        "utime 16|picture 320 240|box crate 7 10.500000 20.000000 4.000000 8.000000",
    ),
    (
        "boxes_3d_t",
        dict(
            utime=17,
            n=1,
            boxes=[
                dict(
                    label=7,
                    name="crate",
                    center=[1.0, 2.0, 3.0],
                    orientation=[0.0, 1.0, 0.0, 0.0],
                    size=[0.5, 0.25, 0.125],
                )
            ],
        ),
        "utime 17|box crate 7 1.000000 2.000000 3.000000 0.000000 1.000000 0.000000 0.000000 0.500000 0.250000 0.125000",
    ),
    (
        "contact_t",
        dict(
            utime=5,
            pressed=True,
            n=1,
            points=[
                dict(
                    body="wall/link",
                    position=[1.0, 2.0, 3.0],
                    normal=[0.0, -1.0, 0.0],
                    force=12.5,
                    depth=0.25,
                )
            ],
        ),
        "utime 5|pressed 1|point wall/link 1.000000 2.000000 3.000000 0.000000 -1.000000 0.000000 12.500000 0.250000",
    ),
    (
        "collisions_t",
        dict(
            utime=9,
            blocked_by="crate/link",
            n=1,
            points=[
                dict(
                    body="wall/link",
                    position=[1.0, 2.0, 3.0],
                    normal=[0.0, -1.0, 0.0],
                    force=12.5,
                    depth=0.25,
                )
            ],
        ),
        "utime 9|blocked by crate/link|point wall/link 1.000000 2.000000 3.000000 0.000000 -1.000000 0.000000 12.500000 0.250000",
    ),
    (
        "joint_state_t",
        dict(
            utime=6,
            num_joints=2,
            joint_name=["left", "right wheel"],
            joint_position=[0.5, -0.5],
            joint_velocity=[1.0, -1.0],
            joint_effort=[0.25, 0.0],
        ),
        "utime 6|joint left 0.500000 1.000000 0.250000|joint right wheel -0.500000 -1.000000 0.000000",
    ),
    (
        "motion_status_t",
        dict(
            utime=7, id=-8, kind=3, state=4, reason=6, done=0.5, remaining=1.5, v=0.25, omega=-0.25
        ),
        "utime 7|id -8|heading refused bad value|amounts 0.500000 1.500000|twist 0.250000 -0.250000",
    ),
    (
        "motion_status_t",
        dict(utime=8, id=0, kind=17, state=1, reason=0, done=0.0, remaining=0.0, v=0.0, omega=0.0),
        "utime 8|id 0|wheels running |amounts 0.000000 0.000000|twist 0.000000 0.000000",
    ),
    (
        "lidar_t",
        dict(
            utime=18,
            nlayers=2,
            ncolumns=3,
            nranges=6,
            ranges=[1.0, 2.0, 3.0, INF, 5.0, -INF],
            nintensities=6,
            intensities=[0.0, 0.25, 0.5, 0.75, 1.0, 0.125],
            azimuth0=-0.5,
            azimuth_step=0.5,
            elevation0=-0.25,
            elevation_step=0.25,
        ),
        "utime 18|shape 2 3|ranges 1.000000 2.000000 3.000000 inf 5.000000 -inf|intensities 0.000000 0.250000 0.500000 0.750000 1.000000 0.125000"
        "|azimuths -0.500000 0.500000|elevations -0.250000 0.000000",
    ),
    (
        "camera_info_t",
        dict(
            utime=19,
            width=320,
            height=240,
            fx=277.5,
            fy=278.5,
            cx=160.5,
            cy=120.5,
            distortion=[0.5, -0.25, 0.125, 0.0625, -0.5],
            near_clip=0.25,
            far_clip=50.0,
        ),
        "utime 19|picture 320 240|focus 277.500000 278.500000 160.500000 120.500000|distortion 0.500000 -0.250000 0.125000 0.062500 -0.500000",
    ),
]

# The enumerations, by hand: numbers in messages and the texts of the samples.
KINDS = {
    0: "none",
    1: "advance",
    2: "rotate",
    3: "heading",
    4: "arc",
    5: "stop",
    16: "velocity",
    17: "wheels",
}
STATES = {0: "idle", 1: "running", 2: "done", 3: "ended", 4: "refused"}
REASONS = {
    0: "",
    1: "replaced",
    2: "blocked",
    3: "watchdog",
    4: "not finite",
    5: "bad kind",
    6: "bad value",
    7: "no drive",
    8: "not possible",
}
FORMATS = {
    842221382: "float32",
    859981650: "rgb",
    861030210: "bgr",
    909199180: "gray16",
    1196444237: "jpeg",
    1497715271: "gray",
}


def motion(kind, state, reason):
    values = dict(utime=1, id=2, kind=kind, state=state, reason=reason)
    values |= dict(done=0.0, remaining=0.0, v=0.0, omega=0.0)
    words = f"{KINDS[kind]} {STATES[state]} {REASONS[reason]}"
    zeros = "amounts 0.000000 0.000000|twist 0.000000 0.000000"
    return "motion_status_t", values, f"utime 1|id 2|{words}|{zeros}"


def picture(number, name):
    values = dict(utime=3, width=2, height=1, row_stride=6, pixelformat=number, size=3)
    values |= dict(data=bytes([1, 127, 255]), nmetadata=0, metadata=[])
    return "image_t", values, f"utime 3|picture 2 1 6|format {name}|data 1 127 255"


CASES += [motion(kind, 1, 0) for kind in KINDS]
CASES += [motion(1, state, 0) for state in STATES]
CASES += [motion(1, 4, reason) for reason in REASONS]
CASES += [picture(number, name) for number, name in FORMATS.items()]

PARTS = {
    "contact_t": "contact_point_t",
    "collisions_t": "contact_point_t",
    "logical_camera_t": "logical_object_t",
    "boxes_2d_t": "box_2d_t",
    "boxes_3d_t": "box_3d_t",
}


UNREAD = {"camera_info_t": 16, "image_t": 4}  # bytes at the end that C++ and Java pass over


def message(type, values):
    made = getattr(lcmtypes, type)()
    for name, value in values.items():
        assert hasattr(made, name), (type, name)
        if isinstance(value, list) and value and isinstance(value[0], dict):
            value = [message(PARTS[type], one) for one in value]
        setattr(made, name, value)
    return made


def main():
    lines = ["# TYPE BYTES, then what they mean; 'broken' where no reader may take them for good."]
    for type, values, meaning in CASES:
        encoded = message(type, values).encode()
        lines += [f"{type} {encoded.hex()}", *("  " + line for line in meaning.split("|"))]
        end = UNREAD.get(type, 0) + 1
        lines += [
            f"{type} {encoded[:-end].hex()}",
            "  broken",
            f"{type} {encoded[:7].hex()}",
            "  broken",
        ]  # its end is missing
        lines += [f"{type} {(bytes(8) + encoded[8:]).hex()}", "  broken"]  # another version
    for type, at in (
        ("planar_lidar_t", 16),
        ("sonar_t", 16),
        ("lidar_t", 24),
        ("image_t", 32),
        ("odometry_t", 56),
        ("contact_t", 17),
        ("collisions_t", 31),
        ("logical_camera_t", 16),
        ("boxes_2d_t", 24),
        ("boxes_3d_t", 16),
    ):  # a length that lies
        encoded = next(message(t, v).encode() for t, v, _ in CASES if t == type)
        for lie in (b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\x20\x00\x00\x01"):
            lines += [f"{type} {(encoded[:at] + lie + encoded[at + 4 :]).hex()}", "  broken"]
    (Path(__file__).parent / "messages.txt").write_text("\n".join(lines) + "\n")


main()
