"""The types of a ROS release, for rosbags."""

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

# Which rosbags does not know, from ros_gz_interfaces' own files.
CONTACTS = """\
std_msgs/Header header
ros_gz_interfaces/Contact[] contacts
================================================================================
MSG: ros_gz_interfaces/Contact
ros_gz_interfaces/Entity collision1
ros_gz_interfaces/Entity collision2
geometry_msgs/Vector3[] positions
geometry_msgs/Vector3[] normals
float64[] depths
ros_gz_interfaces/JointWrench[] wrenches
================================================================================
MSG: ros_gz_interfaces/Entity
uint64 id
string name
uint8 type
================================================================================
MSG: ros_gz_interfaces/JointWrench
std_msgs/Header header
std_msgs/String body_1_name
std_msgs/UInt32 body_1_id
std_msgs/String body_2_name
std_msgs/UInt32 body_2_id
geometry_msgs/Wrench body_1_wrench
geometry_msgs/Wrench body_2_wrench
"""


def store_of(distro: str):
    store = get_typestore(getattr(Stores, f"ROS2_{distro.upper()}"))
    store.register(get_types_from_msg(CONTACTS, "ros_gz_interfaces/msg/Contacts"))
    return store
