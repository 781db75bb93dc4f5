// Interpolation between states, odometry in the world, and levels of detail.
import { describe, expect, it } from "vitest";
import type { world_state_t } from "../generated/messages";
import { Poses } from "../src/state/poses";
import { inWorld } from "../src/ui/odometry";
import { plainKinds } from "../src/scene/plain";
import { Quality, type Change } from "../src/scene/quality";

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
  // 100 ms between states, often enough to establish the interval.
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

  it("go equally far with each frame of the display, wherever states come between two of them", () => {
    for (const late_ms of [0, 4, 9, 15]) {
      const poses = new Poses(),
        seen: number[] = [];
      const [frame_ms, states] = [100 / 6, 120]; // 60 frames and 30 states a second, at 1 m/s
      for (let i = 0; i < states; ++i) {
        const frame = 2 * i * frame_ms;
        poses.advance(frame);
        seen.push(poses.now[0] ?? 0);
        // It arrives after this frame was timed, maybe before it is drawn
        poses.add(stateAt(i * 33_333, [[0, i / 30, 0]]), frame + late_ms);
        poses.advance(frame + frame_ms);
        seen.push(poses.now[0]!);
      }
      const steps = seen.slice(-40).map((x, i, all) => (i > 0 ? x - all[i - 1]! : 1 / 60));
      expect(Math.max(...steps.map((step) => Math.abs(60 * step - 1)))).toBeLessThan(0.1);
    }
  });

  it("have not moved where a state is the same, or differs by less than is seen", () => {
    const poses = moving();
    let moves = 0;
    for (let i = 101; i <= 110; ++i) {
      poses.add(stateAt(i * 100_000, [[0, 10 + 1e-6 * (i % 2), 0]]), i * 100);
      for (let k = 1; k <= 6; ++k) if (poses.advance(i * 100 + 16 * k)) ++moves;
    }
    expect(moves).toBe(0);
    for (let i = 111; i <= 130; ++i) {
      // slowly, but it is seen in time
      poses.add(stateAt(i * 100_000, [[0, 10 + 5e-5 * (i - 110), 0]]), i * 100);
      if (poses.advance(i * 100 + 100)) ++moves;
    }
    expect(moves).toBeGreaterThan(4);
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
  // Consecutive frames at that interval in ms; how often the level changed.
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

  it("is for 48 frames a second where the processor draws, on the whole and not each", () => {
    const quality = new Quality(true);
    draw(quality, 0, 20, 1000);
    const { ratio, plain } = quality.now;
    expect([ratio < 1, plain]).toEqual([true, true]);
    let at_ms = 30_000;
    for (let i = 0; i < 40; ++i) quality.drawn((at_ms += i % 5 ? 20 : 60));
    expect(quality.now.ratio).toBe(ratio);
    draw(quality, 40_000, 25, 6);
    expect(quality.now.ratio).toBeLessThan(ratio);
    draw(quality, 80_000, 16.7, 6);
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
      quality.next(i * 1000 + 1, "none");
    }
  });

  // The result of a change at that moment: whether it is drawn, at another level, reduced.
  const next = (quality: Quality, at_ms: number, change: Change) => {
    const { draw, other } = quality.next(at_ms, change);
    return [draw, other, quality.reduced];
  };

  it("draws one frame as finely as can be once nothing moves, and less again when something does", () => {
    const quality = new Quality(true);
    expect(next(quality, 0, "motion")).toEqual([true, false, true]);
    expect(next(quality, 100, "none")).toEqual([false, false, true]);
    expect(next(quality, 400, "none")).toEqual([true, true, false]);
    expect(quality.now.shadows).toBe(true);
    expect(next(quality, 1000, "none")).toEqual([false, false, false]); // once is enough
    expect(next(quality, 1100, "motion")).toEqual([true, true, true]);
    expect(next(quality, 1200, "none")).toEqual([false, false, true]);
    expect(next(quality, 1400, "none")).toEqual([true, true, false]);
  });

  it("draws all pixels of scans while nothing moves, a third of the time at most", () => {
    const quality = new Quality(true);
    next(quality, 0, "motion");
    expect(next(quality, 100, "sensing")).toEqual([true, false, true]); // it may go on
    expect(next(quality, 300, "sensing")).toEqual([true, true, false]);
    quality.took(80);
    expect(next(quality, 400, "sensing")).toEqual([false, false, false]);
    expect(next(quality, 540, "sensing")).toEqual([true, false, false]);
    expect(next(quality, 1000, "none")).toEqual([false, false, false]); // the next scan may be late
    expect(next(quality, 1600, "none")).toEqual([true, true, false]);
    expect(quality.now.shadows).toBe(true);
    expect(next(quality, 1700, "sensing")).toEqual([false, false, false]);
    expect(next(quality, 1900, "sensing")).toEqual([true, true, false]);
    expect(next(quality, 1910, "motion")).toEqual([true, true, true]);
  });

  it("draws scans as all else where that is quick", () => {
    const quality = new Quality(false);
    next(quality, 0, "motion");
    quality.took(80);
    for (let at_ms = 1000; at_ms < 1100; at_ms += 16)
      expect(next(quality, at_ms, "sensing")).toEqual([true, false, false]);
  });

  it("has nothing finer to draw where it is the finest already", () => {
    const quality = new Quality(false);
    next(quality, 0, "motion");
    expect(next(quality, 10_000, "none")).toEqual([false, false, false]);
  });
});
