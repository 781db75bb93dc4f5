// The store, the clock, which channels are wanted, and the text about the run.
import { displayFor, displayKey, displaysOf } from "../src/state/display";
import { beforeEach, describe, expect, it, vi } from "vitest";
import { Clock, clockText } from "../src/state/clock";
import { shownRobots, stateWords, type PageState } from "../src/state/page";
import { Store } from "../src/state/store";
import { wantedChannels } from "../src/state/wanted";
import type { World } from "../src/state/world";
import { decimals } from "../src/widgets/elements";

const kTypes = [
  "pose_t",
  "odometry_t",
  "planar_lidar_t",
  "sonar_t",
  "image_t",
  "contact_t",
  "motion_status_t",
  "imu_t",
];

function worldOf(robots: string[]): World {
  const own = [
    ["ruedo/tick", "tick_t"],
    ["ruedo/world", "world_state_t"],
    ["ruedo/reply", "reply_t"],
    ["ruedo/info", "world_info_t"],
  ].map(([name, type]) => ({ name, type, robot: "", input: false }));
  const theirs = robots.flatMap((robot) => [
    ...kTypes.map((type) => ({ name: `${robot}/${type}`, type, robot, input: false })),
    { name: `${robot}/velocity`, type: "velocity_command_t", robot, input: true },
  ]);
  return {
    robots: robots.map((name) => ({ name })),
    channels: [...own, ...theirs],
  } as unknown as World;
}

function state(more: Partial<PageState> = {}): PageState {
  return {
    link: "open",
    hello: {
      mode: "live",
      title: "",
      version: "",
      world: "",
      info: "ruedo/info",
      fault: "",
      save: "",
      compared: "",
    },
    controlled: true,
    world: worldOf(["a"]),
    scene: null,
    complete: true,
    robot: 0,
    paused: false,
    time_s: 0,
    factor: null,
    playback: null,
    past: null,
    kept: { begin: 0, end: 0 },
    span: null,
    displays: displaysOf(null),
    comparison: null,
    events: [],
    eventKind: "",
    warnings: [],
    loop: false,
    marks: { begin: null, end: null },
    layers: new Set(),
    mode: "orbit",
    drawn: false,
    reduced: false,
    theme: "dark",
    selected: "",
    tool: "select",
    handle: "translate",
    snap_m: 0.1,
    edits: { undo: null, redo: null, changes: 0 },
    saved: 0,
    tab: "World",
    shown: new Set(["World"]),
    panel: true,
    ...more,
  };
}

describe("the store", () => {
  it("notifies the watchers of a change, and no others", () => {
    const store = new Store({ a: 1, b: "x" }),
      a: number[] = [],
      both: string[] = [];
    store.watch(["a"], (now) => a.push(now.a));
    store.watch(["a", "b"], (now) => both.push(`${now.a}${now.b}`));
    store.set({ b: "y" });
    store.set({ b: "y" });
    store.set({ a: 2, b: "z" });
    expect(a).toEqual([1, 2]);
    expect(both).toEqual(["1x", "1y", "2z"]);
  });
});

describe("the clock", () => {
  it("has the decimals of a step, two at least", () => {
    expect(
      [
        [1.5, 10_000],
        [1.5, 5000],
        [1.5, 100_000],
        [0.0625, 500],
        [2, 33_333],
        [1, 0],
      ].map(([t, step]) => clockText(t!, step!)),
    ).toEqual(["1.50 s", "1.500 s", "1.50 s", "0.0625 s", "2.000000 s", "1.00 s"]);
  });

  let forgotten = 0;
  const clockOf = (page: Store<PageState>) =>
    new Clock(page, () => {
      ++forgotten;
    });
  beforeEach(() => {
    forgotten = 0;
    vi.useFakeTimers({ now: 5_000_000, toFake: ["performance", "Date"] });
  });

  it("goes back for a state of another epoch or another past, and for nothing else", () => {
    const page = new Store(state()),
      clock = clockOf(page);
    clock.tell(3, 0, true);
    clock.tell(2.9, 0); // came late
    expect(page.now.time_s).toBe(3);
    clock.tell(0, 1); // no state: its epoch is not known yet
    expect(page.now.time_s).toBe(3);
    clock.tell(2.6, 0, true); // a state that came late
    expect([page.now.time_s, forgotten]).toEqual([3, 1]);
    clock.tell(2, 0, true); // a reset of the time
    expect([page.now.time_s, forgotten]).toEqual([2, 2]);
    clock.tell(0, 1, true);
    expect([page.now.time_s, clock.epoch, forgotten]).toEqual([0, 1, 3]);
  });

  it("goes back by the smallest requested time, when the state has arrived", () => {
    const page = new Store(state()),
      clock = clockOf(page);
    clock.tell(3, 0, true);
    for (const ask of [() => clock.jump(), () => clock.move()]) {
      ask();
      clock.tell(2.9, 0); // no state
      expect(page.now.time_s).toBe(3);
      clock.tell(2.99, 0, true);
      expect(page.now.time_s).toBe(2.99);
      clock.tell(2.98, 0, true); // came late
      expect(page.now.time_s).toBe(2.99);
      clock.tell(3, 0, true);
    }
  });

  it("measures sim time per real time over a second", () => {
    const page = new Store(state()),
      clock = clockOf(page);
    clock.tell(0, 0, true);
    vi.advanceTimersByTime(500);
    clock.tell(2, 0);
    expect(page.now.factor).toBe(null);
    vi.advanceTimersByTime(1500);
    clock.tell(8, 0);
    expect(page.now.factor).toBeCloseTo(4);
  });
});

describe("wanted channels", () => {
  const of = (robot: string, ...types: string[]) => types.map((type) => `${robot}/${type}`);
  const own = ["ruedo/info", "ruedo/tick", "ruedo/world", "ruedo/reply", "ruedo/markers"];

  it("none before the greeting, then the world, and messages of the run when all is loaded", () => {
    expect([...wantedChannels(state({ hello: null }), [])]).toEqual([]);
    expect([...wantedChannels(state({ world: null }), [])]).toEqual(["ruedo/info", "ruedo/reply"]);
    expect([...wantedChannels(state({ complete: false }), [])].sort()).toEqual([
      "ruedo/info",
      "ruedo/reply",
    ]);
    expect([...wantedChannels(state(), [])].sort()).toEqual([...own, "a/odometry_t"].sort());
  });

  it("are those of the layers and of the open page", () => {
    const wanted = (more: Partial<PageState>) =>
      [...wantedChannels(state(more), [])].filter((name) => name.startsWith("a/")).sort();
    expect(wanted({ layers: new Set(["rays"]) })).toEqual(of("a", "odometry_t", "planar_lidar_t"));
    expect(wanted({ layers: new Set(["sonar", "trail", "contacts", "frames"]) })).toEqual(
      of("a", "contact_t", "odometry_t", "pose_t", "sonar_t"),
    );
    expect(wanted({ shown: new Set(["Plots"]) })).toEqual(of("a", "odometry_t", "pose_t"));
    expect(wanted({ shown: new Set(["Robot", "Plots"]) })).toEqual(of("a", ...[...kTypes].sort()));
    expect(wanted({ shown: new Set() })).toEqual(of("a", "odometry_t"));
  });

  it("are of all robots while these are few, else of the chosen one", () => {
    const few = state({ world: worldOf(["a", "b", "c", "d"]), robot: 1 }),
      many = state({ world: worldOf(["a", "b", "c", "d", "e"]), robot: 1 });
    expect([shownRobots(few), shownRobots(many)]).toEqual([["a", "b", "c", "d"], ["b"]]);
    expect([...wantedChannels(few, [])].filter((name) => name.endsWith("odometry_t"))).toHaveLength(
      4,
    );
    expect([...wantedChannels(many, [])].filter((name) => name.endsWith("odometry_t"))).toEqual([
      "b/odometry_t",
    ]);
  });

  it("are those whose values are opened, too", () => {
    expect(wantedChannels(state(), ["a/image_t"]).has("a/image_t")).toBe(true);
  });
});

it("the notes about the run", () => {
  const log = {
      mode: "log",
      title: "",
      version: "",
      world: "",
      info: "",
      fault: "",
      save: "",
      compared: "",
    } as const,
    playback = { begin: 0, end: 1, now: 0, speed: 1, playing: true, jumps: 0 };
  expect(stateWords(state({ link: "lost" }))).toEqual(["no connection", false]);
  expect(stateWords(state({ link: "ended" }))).toEqual(["ended", false]);
  expect(stateWords(state({ world: null }))).toEqual(["connected", true]);
  expect(stateWords(state())).toEqual(["running", true]);
  expect(stateWords(state({ paused: true }))).toEqual(["paused", false]);
  expect(stateWords(state({ hello: log, playback }))).toEqual(["log", null]);
  expect(stateWords(state({ hello: log, playback: { ...playback, playing: false } }))).toEqual([
    "log, paused",
    null,
  ]);
});

describe("how a layer is drawn", () => {
  const usual = displayFor(new Map(), "points", "a");
  it("is that of the robot, else that of all, else the usual", () => {
    const displays = displaysOf(
      JSON.stringify([
        [displayKey("points", ""), { ...usual, size: 2 }],
        [displayKey("points", "a"), { ...usual, decay_s: 5 }],
      ]),
    );
    expect(displayFor(displays, "points", "a").decay_s).toBe(5);
    expect(displayFor(displays, "points", "b")).toEqual({ ...usual, size: 2 });
    expect(displayFor(displays, "contacts", "a")).toEqual(usual);
    expect(displayFor(new Map(), "points", "b")).toEqual(usual);
    expect(displayFor(new Map(), "clouds", "b")).toEqual({ ...usual, colouring: "range" });
  });
  it("refuses values out of its limits", () => {
    for (const wrong of [{ opacity: 2 }, { decay_s: -1 }, { size: null }, { colouring: "x" }])
      expect(displaysOf(JSON.stringify([["a", { ...usual, ...wrong }]])).size).toBe(0);
    expect(displaysOf("{").size).toBe(0);
  });
});

it("a number that is shown as zero has no sign", () => {
  expect([-4e-4, 4e-4, -6e-4, -0].map((value) => decimals(value, 3))).toEqual([
    "0.000",
    "0.000",
    "-0.001",
    "0.000",
  ]);
  expect([decimals(-0.4, 0), decimals(-10.04, 1)]).toEqual(["0", "-10.0"]);
});
