// A log in the page: at each moment the newest message of every wanted channel.
import { describe, expect, it, vi } from "vitest";
import { encode } from "../src/wire/lcm";
import { historyOf } from "../src/wire/link";
import type { LinkHandler } from "../src/wire/protocol";
import { LogFile, newestAt } from "../src/wire/log_file";

describe("a log in the page", () => {
  it("finds the newest entry", () => {
    const entries = [{ time: 1 }, { time: 2 }, { time: 2 }, { time: 5 }];
    expect([0, 1, 1.9, 2, 4.9, 5, 9].map((t) => newestAt(entries, t))).toEqual([
      -1, 0, 0, 2, 2, 3, 3,
    ]);
    expect(newestAt([], 1)).toBe(-1);
  });

  it("gives a field over time, without malformed messages", () => {
    const pose = (x: number) =>
      encode("pose_t", {
        utime: 1n,
        pos: new Float64Array([x, 0, 0]),
        vel: new Float64Array(3),
        orientation: new Float64Array(4),
        rotation_rate: new Float64Array(3),
        accel: new Float64Array(3),
      }).slice();
    const entries = [pose(3), new Uint8Array(5), pose(1).subarray(0, 40), pose(4), pose(1)].map(
      (message, i) => ({ time: 10 + i, messages: [message] }),
    );
    entries.push({ time: 99, messages: [] });
    expect(historyOf(entries, ["pos[0]", "max(pos)"])).toEqual({
      every: 1,
      times: [10, 13, 14],
      columns: [
        [3, 4, 1],
        [3, 4, 1],
      ],
    });
  });

  // Entries of (channel, time, bytes of each of its messages), as write_log_page has them.
  function logOf(entries: [number, number, number[][]][]): LogFile {
    const bytes: number[] = [],
      number32 = (value: number) =>
        bytes.push(value & 255, (value >> 8) & 255, (value >> 16) & 255, (value >> 24) & 255);
    for (const [channel, time, messages] of entries) {
      number32(channel);
      number32(messages.length);
      bytes.push(...new Uint8Array(new Float64Array([time]).buffer));
      for (const message of messages) {
        number32(message.length);
        bytes.push(...message);
      }
    }
    return new LogFile(
      {
        title: "t",
        info: "i",
        fault: "",
        begin: 0,
        end: 10,
        interval: 0.5,
        pictures: 0,
        messages: 0,
        channels: ["a", "b", "i"],
        events: [],
        scenes: [
          { from: 0, files: {} },
          { from: 6, files: {} },
        ],
      },
      new Uint8Array(bytes),
    );
  }

  it("sends the wanted channels once, with all their parts, and another scene when it is time", async () => {
    const log = logOf([
        [0, 1, [[10]]],
        [0, 2, [[20], [21]]],
        [1, 1.5, [[7]]],
        [2, 3, [[99]]],
      ]),
      told: string[] = [];
    vi.useFakeTimers();
    const handler = {
      state: () => undefined,
      hello: () => undefined,
      playback: () => undefined,
      scene: () => told.push("scene"),
      message: (name: string, m: Uint8Array) => told.push(`${name}${m.join()}`),
      traffic: () => undefined,
      events: () => undefined,
      refused: (name: string) => told.push(`no ${name}`),
    };
    log.connect(handler as unknown as LinkHandler);
    vi.advanceTimersByTime(1);
    log.play(false, 1);
    log.want(["a", "i"]);
    await Promise.resolve();
    expect(told).toEqual(["i99"]); // ruedo/info is known from the beginning
    log.seek(2.5);
    log.seek(2.6);
    expect(told.slice(1)).toEqual(["a20", "a21"]);
    log.seek(1.2);
    log.seek(7);
    expect(told.slice(3)).toEqual(["a10", "scene", "a20", "a21"]);
    log.want(["b"]);
    await Promise.resolve();
    expect(told.slice(7)).toEqual(["b7"]);
    expect(log.command("a")).toBe(false);
    expect(told[8]).toBe("no a");
    vi.useRealTimers();
  });
});
