// Interpolation between states, odometry in the world, and how finely is drawn.
import { describe, expect, it } from "vitest";
import type { world_state_t } from "../generated/messages";
import { Poses } from "../src/state/poses";
import { inWorld } from "../src/ui/odometry";
import { plainKinds } from "../src/scene/plain";
import { Quality } from "../src/scene/quality";

function stateAt(
  utime: number,
  bodies: [index: number, x: number, yaw: number][],
  more: Partial<world_state_t> = {},
): world_state_t {
  return {
    utime: BigInt(utime),
    epoch: 0,
    part: 0,
    nparts: 1,
    index: bodies.map(([index]) => index),
    position: bodies.flatMap(([, x]) => [x, 0, 0]),
    orientation: bodies.flatMap(([, , yaw]) => [Math.cos(yaw / 2), 0, 0, Math.sin(yaw / 2)]),
    ...more,
  } as unknown as world_state_t;
}
const yawOf = (poses: Poses, body: number) =>
  2 * Math.atan2(poses.now[7 * body + 6]!, poses.now[7 * body + 3]!);

describe("poses between two states", () => {
  // 100 ms between states, often enough that this is the interval.
  function moving(): Poses {
    const poses = new Poses();
    for (let i = 0; i <= 100; ++i) {
      poses.add(stateAt(i * 100_000, [[0, i * 0.1, 0]]), i * 100);
      poses.advance(i * 100 + 100);
    }
    return poses;
  }

  it("are one interval behind, and on the way in the middle of it", () => {
    const poses = moving();
    poses.add(stateAt(10_100_000, [[0, 10.1, 0.4]]), 10_100);
    poses.advance(10_100);
    expect(poses.now[0]).toBeCloseTo(10.0, 4);
    poses.advance(10_150);
    expect(poses.now[0]).toBeCloseTo(10.05, 3);
    expect(yawOf(poses, 0)).toBeCloseTo(0.2, 3);
    poses.advance(10_200);
    expect([poses.now[0], yawOf(poses, 0)].map((v) => Number(v!.toFixed(4)))).toEqual([10.1, 0.4]);
    expect(poses.settled).toBe(true);
    expect(poses.advance(10_300)).toBe(false);
  });

  it("turn the short way", () => {
    const poses = moving();
    poses.add(stateAt(10_100_000, [[0, 10, Math.PI - 0.1]]), 10_100);
    poses.advance(10_200);
    const next = stateAt(10_200_000, [[0, 10, -Math.PI + 0.1]]);
    poses.add(next, 10_200);
    poses.advance(10_250);
    expect(Math.abs(Math.abs(yawOf(poses, 0)) - Math.PI)).toBeLessThan(0.02);
  });

  it("do not fly to a new place, after a jump or in another epoch", () => {
    for (const [utime, x, epoch, jump] of [
      [10_100_000, 20, 0, false],
      [10_100_000, 10.5, 0, true],
      [0, 10.5, 1, false],
      [5_000_000, 10.5, 0, false],
    ] as const) {
      const poses = moving();
      if (jump) poses.jump();
      poses.add(stateAt(utime, [[0, x, 0]], { epoch }), 10_100);
      poses.advance(10_100);
      expect(poses.now[0]).toBeCloseTo(x, 4);
    }
  });

  it("appear where they come to be, and take parts of a state", () => {
    const poses = moving();
    poses.add(stateAt(10_100_000, [[0, 10.1, 0]], { nparts: 2 }), 10_100);
    poses.add(stateAt(10_100_000, [[2, 5, 0]], { part: 1, nparts: 2 }), 10_100);
    poses.advance(10_100);
    expect([poses.size, poses.now[14]]).toEqual([3, 5]);
  });

  it("refuse bodies without end", () => {
    expect(() => new Poses().add(stateAt(0, [[1 << 30, 0, 0]]), 0)).toThrow(RangeError);
  });
});

it("kinds of links are drawn plainly when the scene is above its budget, the costliest first, and few links never", () => {
  expect(plainKinds([1620], [100])).toEqual(new Set([0])); // 162 000 triangles
  expect(plainKinds([1620, 100], [30, 50])).toEqual(new Set()); // 53 600
  // 60 000 and 30 000: the first is enough
  expect(plainKinds([1000, 30], [60, 1000])).toEqual(new Set([0]));
  expect(plainKinds([500_000], [1])).toEqual(new Set()); // one house
  expect(plainKinds([500_000, 50], [1, 400])).toEqual(new Set([1]));
});

it("odometry that begins turned and aside is turned and moved", () => {
  const [x, y, heading] = inWorld({ x: 2, y: 1, theta: 0.25 }, [10, 20, Math.PI / 2]);
  expect([x, y, heading].map((v) => Number(v.toFixed(9)))).toEqual([
    9,
    22,
    Number((Math.PI / 2 + 0.25).toFixed(9)),
  ]);
});

describe("quality", () => {
  // Frames in a row, each so many ms after the last; how often the level changed.
  function draw(quality: Quality, from_ms: number, interval_ms: number, frames: number): number {
    let changes = 0;
    for (let i = 1; i <= frames; ++i) if (quality.drawn(from_ms + i * interval_ms)) ++changes;
    return changes;
  }

  it("goes down step by step where drawing is slow, and no further than the last", () => {
    const quality = new Quality(false);
    expect(quality.now.shadows).toBe(true);
    expect(draw(quality, 0, 100, 6)).toBe(1);
    expect(quality.now.ratio).toBe(1);
    draw(quality, 1000, 100, 100);
    const least = quality.now.ratio;
    draw(quality, 20_000, 100, 100);
    expect(quality.now.ratio).toBe(least);
  });

  it("tries a finer one after a while, later each time", () => {
    const quality = new Quality(false);
    draw(quality, 0, 100, 6);
    expect(draw(quality, 1000, 10, 50)).toBe(0);
    expect(draw(quality, 20_000, 10, 20)).toBe(1);
    expect(quality.now.ratio).toBe(2);
    draw(quality, 21_000, 100, 6);
    expect(draw(quality, 32_000, 10, 50)).toBe(0);
    expect(draw(quality, 50_000, 10, 20)).toBe(1);
  });

  it("stays where frames are neither slow nor quick", () => {
    const quality = new Quality(false);
    expect(draw(quality, 0, 35, 1000)).toBe(0);
  });

  it("is the finest when it is not to adapt", () => {
    const quality = new Quality(true);
    quality.automatic = false;
    draw(quality, 0, 200, 100);
    expect(quality.now).toEqual({ ratio: 2, shadows: true, plain: false });
  });

  it("is for 40 frames a second where the processor draws, on the whole and not each", () => {
    const quality = new Quality(true);
    draw(quality, 0, 23, 1000);
    const { ratio, plain } = quality.now;
    expect([ratio < 1, plain]).toEqual([true, true]);
    // Of a display with 60 a second: every second one is missed
    let at_ms = 30_000;
    for (let i = 0; i < 20; ++i) quality.drawn((at_ms += i % 2 ? 16.7 : 33.3));
    expect(quality.now.ratio).toBeLessThanOrEqual(ratio);
    draw(quality, 40_000, 30, 20);
    expect(quality.now.ratio).toBeLessThan(ratio);
    draw(quality, 80_000, 16.7, 20);
    expect(quality.now.ratio).toBe(ratio);
  });

  it("one frame that takes long is no slow drawing", () => {
    const quality = new Quality(true);
    let at_ms = 0;
    for (let i = 0; i < 100; ++i)
      expect(quality.drawn((at_ms += i % 10 === 0 ? 200 : 20))).toBe(false);
  });

  it("a pause between frames says nothing about them", () => {
    const quality = new Quality(false);
    for (let i = 0; i < 50; ++i) {
      expect(quality.drawn(i * 1000)).toBe(false);
      quality.idle(i * 1000 + 1);
    }
  });

  it("draws one frame as finely as can be once nothing moves, and less again when something does", () => {
    const quality = new Quality(true);
    expect([quality.moves(0), quality.reduced]).toEqual([false, true]);
    expect([quality.idle(100), quality.reduced]).toEqual([false, true]);
    expect([quality.idle(400), quality.reduced, quality.now.shadows]).toEqual([true, false, true]);
    expect([quality.idle(1000), quality.reduced]).toEqual([false, false]); // once is enough
    expect([quality.moves(1100), quality.reduced]).toEqual([true, true]);
    expect(quality.idle(1200)).toBe(false);
    expect(quality.idle(1400)).toBe(true);
  });

  it("has nothing finer to draw where it is the finest already", () => {
    const quality = new Quality(false);
    quality.moves(0);
    expect(quality.idle(10_000)).toBe(false);
  });
});
