// A log that the page makes: events as LCM's log format has them, whose times do not go back.
import { describe, expect, it } from "vitest";
import { LcmLog } from "../src/wire/lcm_log";

// By the format's description: sync, number, time, lengths, channel, data, all big endian.
async function eventsOf(log: LcmLog) {
  const view = new DataView(await log.blob().arrayBuffer()),
    found: [number, number, string, number[]][] = [];
  for (let at = 0; at < view.byteLength;) {
    expect(view.getUint32(at)).toBe(0xeda1da01);
    const name = view.getInt32(at + 20),
      size = view.getInt32(at + 24),
      bytes = (from: number, count: number) =>
        [...new Uint8Array(view.buffer, from, count)] as number[];
    found.push([
      Number(view.getBigInt64(at + 4)),
      Number(view.getBigInt64(at + 12)),
      String.fromCharCode(...bytes(at + 28, name)),
      bytes(at + 28 + name, size),
    ]);
    at += 28 + name + size;
  }
  return found;
}

describe("a log that the page makes", () => {
  it("begins with the header, and continues at a reset of sim time", async () => {
    const log = new LcmLog(Uint8Array.of(9));
    log.add("a", 2_000_000, Uint8Array.of(1, 2));
    log.add("b/c", 1_900_000, Uint8Array.of(3));
    log.reset();
    log.add("a", 100_000, Uint8Array.of());
    expect(await eventsOf(log)).toEqual([
      [0, 2_000_000, "ruedo/header", [9]],
      [1, 2_000_000, "a", [1, 2]],
      [2, 2_000_000, "b/c", [3]],
      [3, 2_100_000, "a", []],
    ]);
  });
});
