// What is drawn of curves, and the duration of videos.
import { describe, expect, it } from "vitest";
import { withDuration } from "../src/ui/webm";
import { boxAround, tickStep } from "../src/widgets/xy_plot";

describe("curves", () => {
  it("have ticks at 1, 2 or 5 times a power of ten", () => {
    expect(tickStep(10, 5)).toBe(2);
    expect(tickStep(0.9, 3)).toBeCloseTo(0.5, 12);
    expect(tickStep(7, 7)).toBe(1);
  });

  it("have equal scales where a metre is a metre", () => {
    const { x, y } = boxAround([[0, 0], [4, 1]], [200, 100], true); // prettier-ignore
    expect((x[1] - x[0]) / 200).toBeCloseTo((y[1] - y[0]) / 100, 12);
    expect(x[0]).toBeLessThan(0);
    expect(x[1]).toBeGreaterThan(4);
    expect((y[0] + y[1]) / 2).toBeCloseTo(0.5, 12);
  });
});

describe("a WebM", () => {
  // EBML's head, a segment of unknown size, its info of 7 bytes (a scale of 1 ms), and a cluster.
  const head = [
      0x1a, 0x45, 0xdf, 0xa3, 0x80, 0x18, 0x53, 0x80, 0x67, 0x01, 255, 255, 255, 255, 255, 255, 255,
    ],
    info = [0x2a, 0xd7, 0xb1, 0x83, 0x0f, 0x42, 0x40],
    cluster = [0x1f, 0x43, 0xb6, 0x75, 0xff];
  const bytes = async (blob: Blob) => [...new Uint8Array(await blob.arrayBuffer())];

  it("gets the duration that it lacks, and nothing else changes", async () => {
    const video = new Blob([
      Uint8Array.from([...head, 0x15, 0x49, 0xa9, 0x66, 0x87, ...info, ...cluster]),
    ]);
    const found = await bytes(await withDuration(video, 2.5));
    const duration = [...new Uint8Array(new Float64Array([2500]).buffer)].reverse();
    expect(found).toEqual([
      ...head,
      ...[0x15, 0x49, 0xa9, 0x66, 0x01, 0, 0, 0, 0, 0, 0, 7 + 11],
      ...info,
      ...[0x44, 0x89, 0x88, ...duration],
      ...cluster,
    ]);
  });

  it("stays as it is if it has one, or is none", async () => {
    const long = Uint8Array.from([
      ...head,
      0x15,
      0x49,
      0xa9,
      0x66,
      0x84,
      0x44,
      0x89,
      0x81,
      1,
      ...cluster,
    ]);
    expect(await bytes(await withDuration(new Blob([long]), 9))).toEqual([...long]);
    expect(await bytes(await withDuration(new Blob(["none"]), 9))).toHaveLength(4);
  });
});
