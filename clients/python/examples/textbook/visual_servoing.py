"""Visual servoing (Chaumette and Hutchinson 2006, part I): the robot turns and drives until a
beacon has its wanted column and size in the camera's picture."""

import numpy as np
import ruedo

RADIUS, DISTANCE = 0.15, 1.5  # m: of the beacon, and how far the camera is to be from its middle


def beacon_in(picture):
    """Column of the beacon's middle and its width (pixels), by its red; None: it is not seen."""
    red, green, blue = (picture[..., i].astype(int) for i in range(3))
    columns = np.flatnonzero(((red > 90) & (red > 2 * green) & (red > 2 * blue)).sum(axis=0) > 3)
    return (columns.mean(), np.ptp(columns) + 1.0) if columns.size else None


def servo(beacon=(4.0, 1.2), seconds=30.0):
    """Distance of the camera from the beacon (m) and its bearing (rad) at the end."""
    x, y = beacon
    world = (
        ruedo.World()
        .robot("p3at")
        .cylinder(x, y, radius=RADIUS, height=1.2, colour=(0.9, 0.05, 0.05))
    )
    with ruedo.launch(world, lockstep=1, noise=False) as sim:
        robot = sim.robot("p3at")
        seen, command = sim.step(20), (0.0, 0.4)
        focal = robot.camera.width / 2.0 / np.tan(robot.camera.fov_horizontal / 2.0)
        while seen.time < seconds:
            image = seen.latest(robot.camera)
            found = beacon_in(image.array()) if image else None
            if found:
                column, width = found
                aside = (image.width / 2.0 - column) / focal  # tan of the bearing, to the left
                away = 2.0 * RADIUS * focal / width
                v = float(np.clip(0.6 * (away - DISTANCE), -0.4, 0.4))
                command = v, float(np.clip(1.2 * aside, -0.8, 0.8))
            seen = sim.step(20, [robot.velocity_command(*command)])
        pose = seen.latest(robot.pose).transform
        in_camera = (pose @ robot.camera.transform).inverse().apply((x, y, 0.0))
    return float(np.hypot(*in_camera[:2])), float(np.arctan2(in_camera[1], in_camera[0]))


if __name__ == "__main__":
    print("%.2f m from the beacon, at %.3f rad" % servo())
