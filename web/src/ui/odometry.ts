// Odometry poses in the world frame.
export type Heading = [x: number, y: number, heading: number]; // m, m, rad

// start: the pose of odom in the world.
export function inWorld(
  m: { x: number; y: number; theta: number },
  [x0, y0, a0]: Heading,
): Heading {
  return [
    x0 + m.x * Math.cos(a0) - m.y * Math.sin(a0),
    y0 + m.x * Math.sin(a0) + m.y * Math.cos(a0),
    a0 + m.theta,
  ];
}
