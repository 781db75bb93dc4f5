"""Writes the robots that docs/world-files.md names, without a drive: two wheels, four wheels, and a
model to include, into the present folder.
"""

from pathlib import Path

INERTIA = "<inertia ixx='{0}' iyy='{0}' izz='{0}' ixy='0' ixz='0' iyz='0'/>"


def link(name: str, mass: float, shape: str) -> str:
    inertial = f"<inertial><mass value='{mass}'/>{INERTIA.format(0.02 * mass)}</inertial>"
    return (
        f"<link name='{name}'>{inertial}<collision><geometry>{shape}</geometry></collision></link>"
    )


def urdf(robot: str, wheels: dict[str, tuple[float, float]]) -> str:
    """wheels: their places x, y, m."""
    parts = [link("base_link", 10, "<box size='0.5 0.3 0.1'/>")]
    for name, (x, y) in wheels.items():
        parts += [
            link(f"{name}_link", 1, "<sphere radius='0.1'/>"),
            f"<joint name='{name}' type='continuous'><parent link='base_link'/>"
            f"<child link='{name}_link'/><origin xyz='{x} {y} 0'/><axis xyz='0 1 0'/></joint>",
        ]
    return f"<robot name='{robot}'>{''.join(parts)}</robot>"


def main() -> None:
    two = {"left_wheel": (0.0, 0.2), "right_wheel": (0.0, -0.2)}
    four = {
        f"{end}_{side}": (x, y)
        for end, x in (("front", 0.2), ("rear", -0.2))
        for side, y in (("left", 0.2), ("right", -0.2))
    }
    Path("robot.urdf").write_text(urdf("robot", two), encoding="utf-8")
    Path("rover.urdf").write_text(urdf("rover", four), encoding="utf-8")
    Path("world.sdf").write_text(Path("worlds/empty.sdf").read_text("utf-8"), encoding="utf-8")
    Path("my_robot").mkdir()
    Path("my_robot/model.sdf").write_text(urdf("my_robot", two), encoding="utf-8")


if __name__ == "__main__":
    main()
