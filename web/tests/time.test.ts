// The time line: events around a moment, and replay.
import { describe, expect, it } from "vitest";
import { eventAfter, eventBefore, loopedTo, shownOf } from "../src/state/time";

const at = (t: number) => ({ t, kind: "goal", robot: "", text: String(t) });

describe("the time line", () => {
  it("knows the events before and after a moment, in whatever order they came", () => {
    const events = [at(1), at(4), at(2.5), at(2.5), at(9)];
    expect(eventAfter(events, 1)?.t).toBe(2.5);
    expect(eventAfter(events, 2.5)?.t).toBe(4);
    expect(eventAfter(events, 9)).toBeNull();
    expect(eventBefore(events, 9)?.t).toBe(4);
    expect(eventBefore(events, 1)).toBeNull();
    expect(eventBefore([], 1)).toBeNull();
  });

  it("restarts at the end of the loop, if it was playing", () => {
    const whole = { loop: true, marks: { begin: null, end: null } },
      part = { loop: true, marks: { begin: 2, end: 3 } };
    const shown = (now: number) => ({ begin: 0, end: 10, now, speed: 1, playing: true });
    expect(loopedTo(whole, shown(9.9), true)).toBeNull();
    expect(loopedTo(whole, shown(10), true)).toBe(0);
    expect(loopedTo(whole, shown(10), false)).toBeNull();
    expect(loopedTo({ ...whole, loop: false }, shown(10), true)).toBeNull();
    expect(loopedTo(part, shown(2.9), true)).toBeNull();
    expect(loopedTo(part, shown(3), true)).toBe(2);
    expect(loopedTo({ loop: true, marks: { begin: 12, end: null } }, shown(10), true)).toBeNull();
  });

  it("is there for a log, and for a live run that has a past", () => {
    const playback = { begin: 1, end: 5, now: 2, speed: 1, playing: false, jumps: 0 },
      nothing = { playback: null, past: null, kept: { begin: 3, end: 3.1 } };
    const live = {
      mode: "live",
      title: "",
      version: "",
      world: "",
      info: "",
      fault: "",
      save: "",
      compared: "",
    } as const;
    expect(shownOf({ ...nothing, hello: { ...live, mode: "log" }, playback })).toBe(playback);
    expect(shownOf({ ...nothing, hello: live })).toBeNull();
    expect(shownOf({ ...nothing, hello: live, kept: { begin: 3, end: 7 } })).toMatchObject({
      now: 7,
      playing: true,
    });
  });
});
