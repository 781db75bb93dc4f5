"""Readers of logs: each kind by its content, values by hand, and one clear error for bad ones."""

from __future__ import annotations

import gzip
import math
import subprocess
import sys
from pathlib import Path

import lcm
import numpy as np
import pytest
from conftest import ruedo
from ruedo.fit import FitError, read

BOT_CORE = """
package bot_core;
struct pose_t {
  int64_t utime; double pos[3]; double vel[3]; double orientation[4];
  double rotation_rate[3]; double accel[3];
}
struct planar_lidar_t {
  int64_t utime; int32_t nranges; float ranges[nranges];
  int32_t nintensities; float intensities[nintensities]; float rad0; float radstep;
}
"""
METADATA = "type,diff,\nngear,10,\nencRes,36,\nLi,0.4,\nDi,0.2,0.2\nN,1,\n"


def flaser(ranges, pose, time, host="lab"):
    place = " ".join(map(str, pose))
    readings = " ".join(map(str, ranges))
    return f"FLASER {len(ranges)} {readings} {place} {place} {time} {host} {time}\n"


def test_carmen(tmp_path):
    log = tmp_path / "a.log.gz"
    text = "# message formats\nPARAM robot_front_laser_max 50 lab 0\n"
    text += flaser([1, 2, 81.9], (1, 2, 3.0), 10) + flaser([1, 2, 81.9], (2, 2, -3.2), 11)
    log.write_bytes(gzip.compress(text.encode()))
    one = read(log)
    assert one.kind == "CARMEN log"
    assert one.scans.ranges.tolist() == [[1, 2, 81.9], [1, 2, 81.9]]
    assert one.scans.angles == pytest.approx([-np.pi / 2, 0, np.pi / 2])
    assert one.scans.max_range < 81.9  # 81.9 m means no return
    assert one.truth.time.tolist() == [10, 11]
    assert one.truth.pose[1] == pytest.approx([2, 2, 2 * np.pi - 3.2])  # unwrapped


def test_carmen_without_times(tmp_path):
    log = tmp_path / "a.log"
    log.write_text("".join(flaser([1, 2, 3], (x, 0, 0), 0) for x in range(4)))
    one = read(log)
    assert one.truth.time == pytest.approx([0, 2, 4, 6])  # 1 m at 0.5 m/s
    assert "do not increase" in one.findings[0]
    assert not one.timed and not one.streams  # no rate, no jitter, no spectrum of made times


def test_encoder_table(tmp_path):
    (tmp_path / "7_metadata.csv").write_text(METADATA)
    table = tmp_path / "7_run-01.csv"
    table.write_text("0,0,0,0,0,0\n0.1,0,0,0,36,18\n0.2,0.1,0,0,36,18\n")
    one = read(table)
    # 360 ticks a turn; the table has the right wheel first
    assert one.wheels.turned == pytest.approx(
        np.array([[0, 0], [18, 36], [36, 72]]) * 2 * np.pi / 360
    )
    assert (one.geometry.kind, one.geometry.radius_m, one.geometry.track_m) == (
        "differential", 0.1, 0.4,
    )  # fmt: skip


def test_csv_with_header(tmp_path):
    table = tmp_path / "a.csv"
    table.write_text(
        "theta,time,x,y,left,right,battery\n0,1,2,3,0,0,12\n0.1,2,3,3,,,12\n0.2,3,4,3,2,3,12\n"
    )
    one = read(table)
    assert one.truth.pose.tolist() == [[2, 3, 0], [3, 3, 0.1], [4, 3, 0.2]]
    assert one.wheels.time.tolist() == [1, 3]  # the row with empty cells has no encoders
    assert one.findings == ["columns that are not read: battery"]


def test_csv_of_a_spreadsheet(tmp_path):
    """Semicolons, decimal commas, units, a byte-order mark, an empty cell."""
    table = tmp_path / "a.csv"
    text = "Time [s];x (m);y;theta;acc_x [m/s²]\r\n0,5;1,25;-2;0;\r\n1,0;1,5;-2;0,1;3\r\n"
    table.write_bytes(b"\xef\xbb\xbf" + text.encode())
    with pytest.raises(FitError, match="a.csv:1: 'acc_x' without 'gyro_x'|'gyro_x'"):
        read(table)
    table.write_bytes(b"\xef\xbb\xbf" + text.replace("acc_x", "odd").encode())
    one = read(table)
    assert one.truth.time.tolist() == [0.5, 1.0]
    assert one.truth.pose.tolist() == [[1.25, -2, 0], [1.5, -2, 0.1]]
    assert one.findings == ["columns that are not read: odd"]


def test_lcm_log_of_bot_core(tmp_path):
    """Types made by lcm-gen of bot_core's fields, on its own channels POSE and LASER."""
    (tmp_path / "bot.lcm").write_text(BOT_CORE)
    generator = Path(sys.executable).with_name("lcm-gen")
    subprocess.run([generator, "-p", "--ppath", tmp_path, tmp_path / "bot.lcm"], check=True)
    sys.path.insert(0, str(tmp_path))
    try:
        import bot_core
    finally:
        sys.path.remove(str(tmp_path))
    log = lcm.EventLog(str(tmp_path / "a.lcm"), "w", overwrite=True)
    for k in range(1, 4):
        pose, scan = bot_core.pose_t(), bot_core.planar_lidar_t()
        pose.utime = scan.utime = k * 1_000_000
        pose.pos, pose.orientation = [k, 2.0, 0.0], [math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
        scan.nranges, scan.ranges, scan.rad0, scan.radstep = 3, [1.0, 2.0, 3.0], -1.0, 1.0
        log.write_event(pose.utime, "POSE", pose.encode())
        log.write_event(scan.utime, "LASER", scan.encode())
    log.close()
    one = read(tmp_path / "a.lcm")
    assert one.truth.time.tolist() == [1, 2, 3]
    assert one.truth.pose == pytest.approx(np.array([[k, 2, np.pi / 2] for k in (1, 2, 3)]))
    assert one.scans.ranges.tolist() == [[1, 2, 3]] * 3
    assert one.scans.angles.tolist() == [-1, 0, 1]


@pytest.mark.parametrize("kind", ["ros1", "sqlite3", "mcap"])
def test_bags(tmp_path, kind):
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "ros1" else Stores.ROS2_JAZZY)
    if kind == "ros1":  # its store lacks tf2
        tf = "tf2_msgs/msg/TFMessage"
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", tf))
    one = store.types
    stamp = (lambda t: {"seq": 0}) if kind == "ros1" else (lambda t: {})

    def header(t, frame):
        time = one["builtin_interfaces/msg/Time"](int(t), 0)
        return one["std_msgs/msg/Header"](**stamp(t), stamp=time, frame_id=frame)

    quarter = one["geometry_msgs/msg/Quaternion"](0, 0, np.sqrt(0.5), np.sqrt(0.5))
    straight = one["geometry_msgs/msg/Quaternion"](0, 0, 0, 1)
    vector = one["geometry_msgs/msg/Vector3"]

    def transforms(t):
        transform = one["geometry_msgs/msg/Transform"]
        stamped = one["geometry_msgs/msg/TransformStamped"]
        return one["tf2_msgs/msg/TFMessage"](
            [
                stamped(header(t, "map"), "odom", transform(vector(10, 20, 0), quarter)),
                stamped(header(t, "odom"), "base_link", transform(vector(t, 1, 0), straight)),
            ]
        )

    def scan(t):
        rays = np.array([1.0, np.inf, 3.0], np.float32)
        return one["sensor_msgs/msg/LaserScan"](
            header(t, "laser"), -1.0, 1.0, 1.0, 0, 0, 0.1, 8.0, rays, np.zeros(0, np.float32)
        )

    if kind == "ros1":
        from rosbags.rosbag1 import Writer

        path = tmp_path / "a.bag"
        writer, write = Writer(path), store.serialize_ros1
    else:
        from rosbags.rosbag2 import StoragePlugin, Writer

        path = tmp_path / "bag"
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        writer, write = Writer(path, version=9, storage_plugin=plugin), store.serialize_cdr
    with writer:
        for topic, name, make in (
            ("/tf", "tf2_msgs/msg/TFMessage", transforms),
            ("/scan", "sensor_msgs/msg/LaserScan", scan),
        ):
            connection = writer.add_connection(topic, name, typestore=store)
            for t in (1, 2):
                writer.write(connection, t * 10**9, write(make(t), name))
    found = read(path)
    # map->odom turns by 90 degrees: (t, 1) in odom is (10 - 1, 20 + t) in map
    assert found.truth.pose == pytest.approx(np.array([[9, 21, np.pi / 2], [9, 22, np.pi / 2]]))
    assert found.odometry.pose == pytest.approx(np.array([[1, 1, 0], [2, 1, 0]]))
    assert found.scans.ranges.tolist() == [[1, np.inf, 3]] * 2
    assert found.scans.angles.tolist() == [-1, 0, 1]


def test_bag_with_frames_of_its_own(tmp_path):
    """Frames as the Odometry message has them; the range finder hangs upside down behind a mast."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    one = {name.split("/")[-1]: kind for name, kind in store.types.items()}
    straight, over = (0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0)

    def header(t, frame):
        return one["Header"](one["Time"](int(t), 0), frame)

    def moved(t, frame, child, x, y, turn=straight):
        place = one["Transform"](one["Vector3"](x, y, 0.0), one["Quaternion"](*turn))
        return one["TransformStamped"](header(t, frame), child, place)

    def odometry(t):
        pose = one["Pose"](one["Point"](float(t), 0.0, 0.0), one["Quaternion"](*straight))
        zero = one["Vector3"](0.0, 0.0, 0.0)
        none = np.zeros(36)
        return one["Odometry"](
            header(t, "bot_7/odom_combined"), "bot_7/chassis",
            one["PoseWithCovariance"](pose, none),
            one["TwistWithCovariance"](one["Twist"](zero, zero), none),
        )  # fmt: skip

    def scan(t):
        rays = np.array([1.0, 2.0, 3.0], np.float32)
        none = np.zeros(0, np.float32)
        return one["LaserScan"](header(t, "sick"), -1.0, 0.0, 0.5, 0.0, 0.0, 0.1, 8.0, rays, none)

    fixed = [
        moved(1, "bot_7/chassis", "mast", 0.3, 0.1),
        moved(1, "mast", "sick", 0.0, 0.2, over),
    ]
    path = tmp_path / "bag"
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, name, make in (
            ("/bot_7/tf", "tf2_msgs/msg/TFMessage", lambda t: one["TFMessage"](
                [moved(t, "site", "bot_7/odom_combined", 5.0, 6.0)])),
            ("/tf_static", "tf2_msgs/msg/TFMessage", lambda t: one["TFMessage"](fixed)),
            ("/bot_7/wheels", "nav_msgs/msg/Odometry", odometry),
            ("/bot_7/front", "sensor_msgs/msg/LaserScan", scan),
        ):  # fmt: skip
            connection = writer.add_connection(topic, name, typestore=store)
            for t in (1, 2, 3):
                writer.write(connection, t * 10**9, store.serialize_cdr(make(t), name))
    found = read(path)
    assert found.truth.pose == pytest.approx(np.array([[5 + t, 6, 0] for t in (1, 2, 3)]))
    assert found.scans.mount == pytest.approx([0.3, 0.3, 0])
    assert found.scans.ranges.tolist() == [[3, 2, 1]] * 3  # turned over, left is right
    assert found.scans.angles == pytest.approx([0, 0.5, 1])


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.log", "", "it is empty"),
        ("a.log", "hello world\n", "it begins with 'hello world'; allowed are CARMEN log"),
        ("a.log", "FLASER 3 1 2\n", "a.log:1: FLASER with 4 words and '3' rays"),
        ("a.log", flaser([1, 2, 3], (0, 0, 0), 1).replace("2", "x", 1), "a.log:1: "),
        ("a.log", "PARAM a 1 lab 0\n", "no FLASER or ROBOTLASER1 line"),
        ("a.csv", "0,0,0,0,1,1\n1,0,0,0,1,1\n", "metadata"),
        ("a.csv", "time,x,y\n0,1,2\n1,2,3\n", "a.csv:1: 'x' without 'theta'"),
        ("a.csv", "time,left,right\n0,1,2\n1,2\n", "a.csv:3: 2 columns, the first row has 3"),
        ("a.csv", "x,y,theta\n0,1,2\n", "no column 'time'"),
        ("a.csv", "stamp;pos_x;pos_y\n0;1;2\n", "no column 'time'; allowed are time, x, y, theta"),
        (
            "a.csv",
            "time,x [mm],y,theta\n0,1,2,3\n",
            "a.csv:1: column 'x [mm]'; the unit of 'x' is m",
        ),
        ("a.csv", "time,x,y,theta(deg)\n0,1,2,3\n", "the unit of 'theta' is rad"),
        ("a.csv", "time\tx\ty\ttheta\n0\t1\t2\tx\n", "a.csv:2: could not convert"),
        ("a.csv", "time,left,right\n" + "5,1,2\n" * 9, "time is 5 s in all rows"),
        (
            "a.csv",
            "time,left,right\n" + "".join(f"{50 * k},{k},{k}\n" for k in range(9)),
            "a reading of its wheels every 50 s; allowed are times in s",
        ),
        (
            "a.csv",
            "time,x,y,theta\n" + "".join(f"{0.1 * k:.1f},{30 * k},0,0\n" for k in range(9)),
            "its path moves at 300 m/s; allowed are m and s",
        ),
        (
            "7_run-01.csv",
            "0,0,0,0,0,0\n0,0,0,0,36,18\n",
            "7_run-01.csv:2: time 0 s does not increase",
        ),
        ("7_run-01.csv", "0,0,0,0,0,0\n1,nan,0,0,36,18\n", "7_run-01.csv:2: finite numbers"),
    ],
)
def test_bad_files(tmp_path, name, text, said):
    (tmp_path / "7_metadata.csv").write_text(METADATA)
    (tmp_path / name).write_text(text)
    with pytest.raises(FitError) as error:
        read(tmp_path / name)
    assert said in str(error.value)
    if text:
        assert str(tmp_path / name) in str(error.value)


def test_damaged_gzip(tmp_path):
    log = tmp_path / "a.log.gz"
    log.write_bytes(gzip.compress(flaser(range(1000), (0, 0, 0), 1).encode() * 10)[:-20])
    with pytest.raises(FitError, match="damaged"):
        read(log)


def test_errors_of_the_command(tmp_path):
    (tmp_path / "a.log").write_text("hello\n")
    _, said = ruedo("fit", tmp_path / "a.log", code=3)
    assert said.startswith(f"ruedo: {tmp_path}/a.log: it begins with 'hello'")
    _, said = ruedo("fit", tmp_path / "none.log", code=3)
    assert said == f"ruedo: {tmp_path}/none.log: No such file or directory\n"
    _, said = ruedo("fit", tmp_path / "a.log", "-o", tmp_path / "x.sdf", code=2)
    assert "--robot" in said
