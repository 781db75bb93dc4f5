// Sends a robot to points that were clicked, one after the other: it turns towards a point, drives
// the remaining distance, and checks again, since the odometry that it moves by drifts.
import { motion_status_t, move_command_t } from "../../generated/messages";

// A motion primitive to be requested.
export type Move = Omit<move_command_t, "utime" | "id">;

// Why a primitive ended, by motion_status_t's reason.
export const kReasons = [
  "",
  "replaced by a newer command",
  "blocked by contact",
  "stopped by the watchdog: no command came",
  "refused: not a finite number",
  "refused: unknown kind",
  "refused: value out of range",
  "refused: the robot cannot move",
  "refused: its drive cannot do that",
];

const kNear_m = 0.05; // closer than this, it has arrived
const kAligned_rad = 0.02; // smaller errors of heading need no turn
const kMostTries = 5; // for one point

export interface Planar {
  x: number;
  y: number;
  z?: number; // m, where it is drawn; the way is planned in x and y
}
export interface PlanarPose extends Planar {
  heading: number; // rad, from the world's x to its y
}

export interface Driven {
  pose(): PlanarPose | null; // in the world; null if unknown
  move(command: Move): bigint | null; // its id; null if the robot takes no motion primitives
  failed(reason: number): void; // motion_status_t's reason
  changed(): void; // points() has changed
}

export class GoTo {
  private ahead: Planar[] = [];
  private running: bigint | null = null; // the primitive's id
  private tries = 0;

  constructor(private readonly robot: Driven) {}

  // The remaining points, the next one first.
  points(): readonly Planar[] {
    return this.ahead;
  }

  // further: add to the remaining points instead of replacing them.
  go(point: Planar, further: boolean): void {
    const underWay = further && this.ahead.length > 0;
    if (!further) this.ahead = [];
    this.ahead.push(point);
    this.robot.changed();
    if (underWay) return;
    this.tries = 0;
    this.next();
  }

  forget(): void {
    this.running = null;
    if (this.ahead.length === 0) return;
    this.ahead = [];
    this.robot.changed();
  }

  // To be called with each status of the robot.
  heard(status: motion_status_t): void {
    if (this.running === null || status.id !== this.running) return;
    if (status.state === motion_status_t.STATE_DONE) {
      this.next();
    } else if (
      status.state === motion_status_t.STATE_ENDED ||
      status.state === motion_status_t.STATE_REFUSED
    ) {
      this.forget();
      if (status.reason !== motion_status_t.REASON_REPLACED) this.robot.failed(status.reason);
    }
  }

  private next(): void {
    const pose = this.robot.pose(),
      [to] = this.ahead;
    this.running = null;
    if (!to || !pose) return this.forget();
    const way = Math.hypot(to.x - pose.x, to.y - pose.y);
    if (way < kNear_m || this.tries >= 2 * kMostTries) {
      this.ahead.shift();
      this.tries = 0;
      this.robot.changed();
      if (this.ahead.length > 0) this.next();
      return;
    }
    ++this.tries;
    const turn = Math.atan2(to.y - pose.y, to.x - pose.x) - pose.heading,
      left = Math.atan2(Math.sin(turn), Math.cos(turn));
    this.running =
      Math.abs(left) > kAligned_rad
        ? this.move(move_command_t.ROTATE, left)
        : this.move(move_command_t.ADVANCE, way);
    if (this.running === null) this.forget();
  }

  private move(kind: number, value: number): bigint | null {
    return this.robot.move({ kind, value, radius: 0, speed: 0, acceleration: 0, deceleration: 0 });
  }
}
