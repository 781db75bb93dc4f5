"""The types of a ROS release, for rosbags."""

from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

INTERFACES = Path(__file__).resolve().parent / "real/interfaces.txt"


def store_of(distro: str):
    store = get_typestore(getattr(Stores, f"ROS2_{distro.upper()}"))
    for part in INTERFACES.read_text(encoding="utf-8").split("\n=== ")[1:]:
        file, _, text = part.partition("\n")
        if file.startswith("ros_gz_interfaces/"):  # which rosbags does not know
            store.register(get_types_from_msg(text, file.removesuffix(".msg")))
    return store
