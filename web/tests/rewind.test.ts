// The past of a live run: what is kept, what is shown of it, and what continues meanwhile.
import { beforeEach, describe, expect, it, vi } from "vitest";
import { decode, encode } from "../src/wire/lcm";
import type { Hello, LinkHandler, RunLink } from "../src/wire/protocol";
import { kMostSeconds, Rewind, type Past } from "../src/wire/rewind";

// A link whose other end the test controls.
class Hand implements RunLink {
  handler!: LinkHandler;
  sent: string[] = [];
  connect(handler: LinkHandler) {
    this.handler = handler;
  }
  want() {}
  watchTraffic() {}
  command(channel: string) {
    this.sent.push(channel);
    return true;
  }
  history() {
    return Promise.resolve({ every: 1, times: [], columns: [] });
  }
  step(ahead: boolean) {
    this.sent.push(ahead ? "ahead" : "back");
  }
  play() {}
  seek() {}
}

const layer = (name: string, n: number) =>
  encode("markers_t", {
    utime: 0n,
    layer: name,
    frame: "",
    n,
    markers: Array.from({ length: n }, () => ({
      kind: 3,
      position: new Float64Array(3),
      orientation: new Float64Array([1, 0, 0, 0]),
      color: new Float32Array(4),
      size: 1,
      text: "",
      n: 0,
      points: new Float32Array(),
      columns: 0,
      ncells: 0,
      cells: new Uint8Array(),
    })),
  }).slice();

const state = (time_s: number, x: number, epoch = 0, part = 0, nparts = 1) =>
  encode("world_state_t", {
    utime: BigInt(Math.round(time_s * 1e6)),
    epoch,
    part,
    nparts,
    n: 1,
    index: new Int32Array([part]),
    position: new Float64Array([x, 0, 0]),
    orientation: new Float64Array([1, 0, 0, 0]),
  }).slice();

describe("the past", () => {
  let hand: Hand, rewind: Rewind, seen: [string, number, number][], pasts: (Past | null)[];
  beforeEach(() => {
    vi.useFakeTimers();
    hand = new Hand();
    rewind = new Rewind(hand);
    seen = [];
    pasts = [];
    rewind.onPast = (past) => pasts.push(past);
    rewind.connect({
      hello: () => undefined,
      message: (channel: string, bytes: Uint8Array) => {
        if (channel !== "ruedo/world") return seen.push([channel, 0, 0]);
        const { utime, position } = decode("world_state_t", bytes);
        return seen.push([channel, Number(utime) * 1e-6, position[0]!]);
      },
    } as unknown as LinkHandler);
  });
  const come = (time_s: number, x = time_s) =>
    hand.handler.message("ruedo/world", state(time_s, x));
  const last = () => seen.at(-1);

  it("is shown while the run goes on, and the present comes back", () => {
    for (let t = 0; t <= 10; ++t) come(t);
    expect(last()).toEqual(["ruedo/world", 10, 10]);
    rewind.show(3.4);
    expect(last()).toEqual(["ruedo/world", 3, 3]);
    come(11);
    expect(last()).toEqual(["ruedo/world", 3, 3]);
    expect(rewind.range).toEqual({ begin: 0, end: 11 });
    rewind.live();
    expect(last()).toEqual(["ruedo/world", 11, 11]);
    come(12);
    expect(last()).toEqual(["ruedo/world", 12, 12]);
  });

  it("plays from there to the present", () => {
    for (let t = 0; t <= 10; ++t) come(t);
    rewind.show(2);
    rewind.play(true, 2);
    vi.advanceTimersByTime(1000);
    expect(last()![1]).toBeGreaterThanOrEqual(3);
    expect(last()![1]).toBeLessThanOrEqual(4);
  });

  it("goes from state to state, both ways, and no further than there are any", () => {
    for (let t = 0; t <= 5; ++t) come(t, 10 * t);
    rewind.step(false); // from the present
    expect(last()![1]).toBe(4);
    rewind.step(false);
    expect(last()![1]).toBe(3);
    rewind.show(2.5);
    rewind.step(false);
    expect(last()![1]).toBe(2);
    rewind.step(true);
    rewind.step(true);
    expect(last()![1]).toBe(4);
    rewind.show(0);
    rewind.step(false);
    expect(last()![1]).toBe(0);
    hand.handler.hello({ mode: "log" } as Hello);
    rewind.step(true);
    expect(hand.sent).toEqual(["ahead"]); // of a log the server knows
  });

  it("is bounded", () => {
    for (let t = 0; t <= 2 * kMostSeconds; ++t) come(t);
    expect(rewind.range).toEqual({ begin: kMostSeconds, end: 2 * kMostSeconds });
    rewind.show(1);
    expect(last()![1]).toBe(kMostSeconds);
  });

  it("ends where the world is reset", () => {
    come(5);
    rewind.show(5);
    hand.handler.message("ruedo/world", state(0, 7, 1));
    expect(pasts.at(-1)).toBeNull();
    expect(last()).toEqual(["ruedo/world", 0, 7]);
    expect(rewind.range).toEqual({ begin: 0, end: 0 });
  });

  it("has all layers of drawings, however old", () => {
    const drawn: Record<string, number> = {};
    hand.handler.hello({ mode: "live" } as Hello);
    vi.spyOn(rewind["handler"], "message").mockImplementation((channel, bytes) => {
      if (channel !== "ruedo/markers") return;
      const { layer, n } = decode("markers_t", bytes);
      drawn[layer] = n;
    });
    const draw = (name: string, n: number) => hand.handler.message("ruedo/markers", layer(name, n));
    const shown = (time_s: number) => {
      for (const name of Object.keys(drawn)) delete drawn[name];
      rewind.show(time_s);
      return { ...drawn };
    };
    for (let t = 0; t <= 10; ++t) {
      come(t);
      if (t === 2) draw("plan", 1);
      if (t === 4) draw("goals", 2);
      if (t === 6) draw("plan", 3);
    }
    expect(shown(1)).toEqual({});
    expect(shown(3)).toEqual({ plan: 1 });
    expect(shown(5)).toEqual({ plan: 1, goals: 2 });
    expect(shown(7)).toEqual({ plan: 3, goals: 2 });
    for (let t = 11; t <= 2 * kMostSeconds; ++t) come(t);
    expect(shown(kMostSeconds + 1)).toEqual({ plan: 3, goals: 2 });
    hand.handler.message("ruedo/world", state(0, 0, 1)); // a reset, which keeps what programs drew
    expect(shown(0)).toEqual({ plan: 3, goals: 2 });
  });

  it("shows messages in parts whole, and steers what runs", () => {
    for (const t of [1, 2]) {
      hand.handler.message("ruedo/world", state(t, 10 * t, 0, 0, 2));
      hand.handler.message("ruedo/world", state(t, 10 * t + 1, 0, 1, 2));
    }
    seen.length = 0;
    rewind.show(1.5);
    expect(seen.map(([, , x]) => x)).toEqual([10, 11]);
    rewind.command("p3at/velocity", new Uint8Array());
    expect(hand.sent).toEqual(["p3at/velocity"]);
  });
});
