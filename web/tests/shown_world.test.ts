// Which world is shown while a run goes on and the user looks back, and the requests to the link.
import { beforeEach, describe, expect, it, vi } from "vitest";
import type { Model } from "../src/app/model";
import type { SceneView } from "../src/app/scene_view";
import { ShownWorld } from "../src/app/shown_world";
import { chooseNextRobot, chooseRobot, toggleGoing } from "../src/state/choices";
import type { Page, PageState } from "../src/state/page";
import { Store } from "../src/state/store";
import { Wanted } from "../src/state/wanted";
import type { World } from "../src/state/world";
import type { SceneFiles } from "../src/wire/description";
import type { Past, Rewind } from "../src/wire/rewind";

const worldOf = (runId: number, ...robots: string[]) =>
  ({ runId, robots: robots.map((name) => ({ name })), channels: [] }) as unknown as World;
const filesOf = (version: number) => ({ description: { version } }) as unknown as SceneFiles;
const pageWith = (more: Partial<PageState> = {}): Page =>
  new Store({
    hello: { mode: "live", info: "ruedo/info" },
    world: null,
    scene: null,
    complete: false,
    robot: -1,
    past: null,
    kept: { begin: 0, end: 0 },
    layers: new Set(),
    shown: new Set(["Robot"]),
    panel: true,
    tool: "select",
    ...more,
  } as unknown as PageState);

beforeEach(() => void vi.stubGlobal("location", { hash: "" }));

describe("the world that is shown", () => {
  function made() {
    const page = pageWith(),
      shown: (number | null)[] = [],
      range = { end: 0 },
      rewind = { range, onPast: undefined as unknown as Rewind["onPast"] };
    const clock = { move: vi.fn(), jump: vi.fn() },
      markers = { clear: vi.fn() };
    const world = new ShownWorld(
      { page, clock, rewind, file: null } as unknown as Model,
      {
        markers,
        stage: {},
        show: (files: SceneFiles | null) => shown.push(files?.description.version ?? null),
      } as unknown as SceneView,
    );
    // From that time of the run on, the world is another one.
    const comes = (end: number, run: World, files: SceneFiles | null) => {
      range.end = end;
      world.take(run, files);
    };
    const lookAt = (now: number | null, end = 20) =>
      rewind.onPast(now === null ? null : ({ now, end } as Past), { begin: 0, end });
    return { page, shown, world, comes, lookAt, clock, markers };
  }

  it("is the newest; of the past the one that was there then", () => {
    const { page, shown, comes, lookAt } = made();
    comes(0, worldOf(1, "a"), filesOf(1));
    comes(10, worldOf(1, "a", "b"), filesOf(2));
    lookAt(5);
    expect([shown, page.now.world?.robots.length]).toEqual([[1, 2, 1], 1]);
    lookAt(15);
    expect(shown).toEqual([1, 2, 1, 2]);
    lookAt(null);
    expect([shown, page.now.past]).toEqual([[1, 2, 1, 2], null]);
  });

  it("stays what it is while the past is looked at and another one comes", () => {
    const { page, shown, comes, lookAt } = made();
    comes(0, worldOf(1, "a"), filesOf(1));
    lookAt(5);
    comes(10, worldOf(1, "a", "b"), filesOf(2));
    expect([shown, page.now.scene?.version]).toEqual([[1], 1]);
    lookAt(null);
    expect([shown, page.now.scene?.version]).toEqual([[1, 2], 2]);
  });

  it("is the same in another form, shapes for surfaces, at once", () => {
    const { shown, comes, lookAt, page } = made(),
      shapes = filesOf(1);
    comes(0, worldOf(1, "a"), filesOf(1));
    lookAt(5);
    comes(6, worldOf(1, "a"), shapes);
    expect([shown, page.now.scene]).toEqual([[1, 1], shapes.description]);
  });

  it("keeps the chosen robot by its name, and chooses the first where that is gone", () => {
    const { page, comes } = made();
    comes(0, worldOf(1, "a", "b"), filesOf(1));
    page.set({ robot: 1 });
    comes(1, worldOf(1, "new", "a", "b"), filesOf(2));
    expect(page.now.robot).toBe(2);
    comes(2, worldOf(1, "new", "a"), filesOf(3));
    expect(page.now.robot).toBe(0);
    comes(3, worldOf(1), filesOf(4));
    expect(page.now.robot).toBe(-1);
  });

  it("jumps where the moment is another one, and not along the way", () => {
    const { comes, lookAt, clock, markers } = made();
    const counts = () => [clock.jump, markers.clear].map(({ mock }) => mock.calls.length);
    comes(0, worldOf(1, "a"), filesOf(1));
    lookAt(5);
    lookAt(5.1);
    expect(counts()).toEqual([1, 1]);
    lookAt(9);
    expect(counts()).toEqual([2, 1]);
    lookAt(8.9);
    expect(counts()).toEqual([3, 2]);
    expect(clock.move.mock.calls.length).toBe(1); // the way from 5 to 5.1
  });
});

describe("the requests to the link", () => {
  it("is empty before the views exist, then the needs of page and views", () => {
    const want = vi.fn(),
      watchTraffic = vi.fn(),
      page = pageWith({ world: worldOf(1), complete: true }),
      wanted = new Wanted(page, { want, watchTraffic });
    let opened = ["a/image"];
    wanted.add(() => opened);
    wanted.add(() => ["a/motion"]);
    expect(want).not.toHaveBeenCalled();
    wanted.watch();
    const last = () => [...(want.mock.lastCall![0] as Set<string>)].sort();
    expect(last()).toEqual(["a/image", "a/motion", "ruedo/info", "ruedo/markers"]);
    opened = [];
    wanted.update();
    expect(last()).toEqual(["a/motion", "ruedo/info", "ruedo/markers"]);
    page.set({ complete: false });
    expect(last()).toEqual(["a/motion", "ruedo/info"]);
    page.set({ shown: new Set(["Robot", "Channels"]) });
    expect(watchTraffic).toHaveBeenLastCalledWith(true);
    page.set({ shown: new Set() });
    expect(watchTraffic).toHaveBeenLastCalledWith(false);
  });
});

describe("the choice", () => {
  it("is a robot that is there, the next one after the last is the first", () => {
    const page = pageWith({ world: worldOf(1, "a", "b"), robot: 0 });
    chooseRobot(page, 5);
    chooseRobot(page, -1);
    expect(page.now.robot).toBe(0);
    chooseNextRobot(page);
    expect(page.now.robot).toBe(1);
    chooseNextRobot(page);
    expect(page.now.robot).toBe(0);
    const none = pageWith();
    chooseNextRobot(none);
    expect(none.now.robot).toBe(-1);
  });

  it("is going to a click, or selecting", () => {
    const page = pageWith();
    toggleGoing(page);
    expect(page.now.tool).toBe("go");
    toggleGoing(page);
    expect(page.now.tool).toBe("select");
  });
});
