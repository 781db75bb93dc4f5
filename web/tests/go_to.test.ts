// Points that a robot is sent to: the commands that it gets, whatever it makes of them.
import { describe, expect, it } from "vitest";
import { motion_status_t, move_command_t } from "../generated/messages";
import { GoTo, type PlanarPose } from "../src/state/go_to";

const kRotate = move_command_t.ROTATE,
  kAdvance = move_command_t.ADVANCE;

// A robot at the origin that executes its commands, but falls short by a fraction of each.
function robot(short = 0) {
  const pose: PlanarPose = { x: 0, y: 0, heading: 0 },
    told: [number, number][] = [],
    failures: number[] = [];
  let id = 0n,
    shown = 0;
  const goTo = new GoTo({
    pose: () => pose,
    move: ({ kind, value }) => {
      told.push([kind, value]);
      return ++id;
    },
    failed: (reason) => failures.push(reason),
    changed: () => ++shown,
  });
  const status = (state: number, reason = 0, of = id) =>
    goTo.heard({ id: of, state, reason } as motion_status_t);
  const work = (most = 50) => {
    for (let done = 0; done < told.length && done < most; ++done) {
      const [kind, value] = told[done]!;
      if (kind === kRotate) pose.heading += value;
      else {
        pose.x += value * (1 - short) * Math.cos(pose.heading);
        pose.y += value * (1 - short) * Math.sin(pose.heading);
      }
      status(motion_status_t.STATE_RUNNING);
      status(motion_status_t.STATE_DONE);
    }
  };
  return { pose, told, failures, goTo, status, work, shown: () => shown };
}

describe("a robot that is sent to a point", () => {
  it("turns the short way and goes there", () => {
    const { goTo, told, work, pose } = robot();
    pose.heading = 3; // the shorter turn is the other way round than -2 - 3 rad
    goTo.go({ x: Math.cos(-2), y: Math.sin(-2) }, false);
    work();
    expect(told.map(([kind]) => kind)).toEqual([kRotate, kAdvance]);
    expect(told[0]![1]).toBeCloseTo(2 * Math.PI - 5, 12);
    expect(told[1]![1]).toBeCloseTo(1, 12);
    expect(goTo.points()).toEqual([]);
  });

  it("goes to all points in their order", () => {
    const { goTo, work, pose, told } = robot();
    goTo.go({ x: 1, y: 0 }, false);
    goTo.go({ x: 1, y: 1 }, true);
    expect(goTo.points()).toHaveLength(2);
    work();
    expect([pose.x, pose.y]).toEqual([1, expect.closeTo(1, 12) as number]);
    expect(told.map(([kind]) => kind)).toEqual([kAdvance, kRotate, kAdvance]);
  });

  it("looks again when it is not there, and gives up a point that it never reaches", () => {
    const near = robot(0.2);
    near.goTo.go({ x: 1, y: 0 }, false);
    near.work();
    expect(Math.abs(near.pose.x - 1)).toBeLessThan(0.05);
    expect(near.told).toHaveLength(2); // 0.8 m, then 0.16 of the 0.2 that are left
    const stuck = robot(1);
    stuck.goTo.go({ x: 1, y: 0 }, false);
    stuck.work();
    expect(stuck.told.length).toBeLessThan(20);
    expect(stuck.goTo.points()).toEqual([]);
  });

  it("shows why it stops, except for the user's own command", () => {
    const { goTo, status, failures } = robot();
    goTo.go({ x: 1, y: 0 }, false);
    status(motion_status_t.STATE_ENDED, motion_status_t.REASON_BLOCKED, 99n); // another's
    expect(goTo.points()).toHaveLength(1);
    status(motion_status_t.STATE_ENDED, motion_status_t.REASON_REPLACED);
    expect(goTo.points()).toEqual([]);
    goTo.go({ x: 1, y: 0 }, false);
    status(motion_status_t.STATE_ENDED, motion_status_t.REASON_BLOCKED);
    expect(goTo.points()).toEqual([]);
    expect(failures).toEqual([motion_status_t.REASON_BLOCKED]);
  });

  it("goes elsewhere when another point is clicked", () => {
    const { goTo, status, told, failures } = robot();
    goTo.go({ x: 1, y: 0 }, false);
    goTo.go({ x: 2, y: 0 }, false);
    status(motion_status_t.STATE_ENDED, motion_status_t.REASON_REPLACED, 1n); // the first
    expect(told).toHaveLength(2);
    expect(goTo.points()).toEqual([{ x: 2, y: 0 }]);
    expect(failures).toEqual([]);
  });
});
