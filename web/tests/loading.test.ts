// Loading: every order in which the parts can arrive has the same result.
import { describe, expect, it } from "vitest";
import type { world_info_t } from "../generated/messages";
import { Loading } from "../src/state/loading";
import type { Hello } from "../src/wire/protocol";

const kHello: Hello = {
  mode: "live",
  title: "w",
  version: "1",
  world: "",
  info: "ruedo/info",
  fault: "",
  save: "",
  compared: "",
};

function info(robots: string[], more: Partial<world_info_t> = {}): world_info_t {
  return {
    utime: 0n,
    run_id: 1n,
    epoch: 0,
    part: 0,
    nparts: 1,
    version: "1",
    world: "w",
    seed: 1n,
    step_us: 5000n,
    features: 0n,
    paused: false,
    robots: robots.map((name) => ({ name })),
    devices: [],
    channels: robots.map((name) => ({ name: `${name}/pose` })),
    bodies: [],
    ...more,
  } as unknown as world_info_t;
}

// A page with a scene on a server whose answers the test releases.
function page() {
  const told: string[] = [],
    waiting: { answer: () => void; fail: () => void }[] = [];
  const server = { scene: "scene" as string | null };
  const loading = new Loading<string>({
    fetchScene: () => {
      const scene = server.scene;
      return new Promise((resolve, reject) =>
        waiting.push({ answer: () => resolve(scene), fail: () => reject(new Error("no")) }),
      );
    },
    greeted: () => told.push("greeted"),
    running: (world) => told.push(`runs ${world.robots.map((r) => r.name).join()}`),
    complete: (world, scene) => told.push(`${world.robots.map((r) => r.name).join()} in ${scene}`),
    failed: (words) => told.push(`failed: ${words}`),
  });
  const settle = () => new Promise((resolve) => setTimeout(resolve));
  return { loading, told, waiting, server, settle, last: () => told[told.length - 1] };
}

describe("the order of loading", () => {
  it("is complete when world and scene are there, whichever is last", async () => {
    for (const sceneFirst of [true, false]) {
      const { loading, told, waiting, settle, last } = page();
      loading.onHello(kHello);
      if (!sceneFirst) loading.onInfo(info(["a"]));
      expect(loading.complete).toBe(false);
      expect(told.some((line) => line.includes(" in "))).toBe(false);
      waiting[0]!.answer();
      await settle();
      if (sceneFirst) loading.onInfo(info(["a"]));
      expect(loading.complete).toBe(true);
      expect(last()).toBe("a in scene");
      expect(told.filter((line) => line.includes(" in "))).toHaveLength(1);
    }
  });

  it("accepts no world before the greeting", () => {
    const { loading, told } = page();
    loading.onInfo(info(["a"]));
    expect(told).toEqual([]);
  });

  it("can be steered before the scene is there", () => {
    const { loading, last } = page();
    loading.onHello(kHello);
    loading.onInfo(info(["a"]));
    expect(last()).toBe("runs a");
  });

  it("shows the scene that was requested last, though an older one arrives after it", async () => {
    const { loading, waiting, server, settle, last, told } = page();
    loading.onHello(kHello);
    loading.onInfo(info(["a"]));
    server.scene = "newer";
    void loading.onScene();
    waiting[1]!.answer();
    await settle();
    waiting[0]!.answer();
    await settle();
    expect(last()).toBe("a in newer");
    expect(told.filter((line) => line.includes(" in "))).toHaveLength(1);
  });

  it("is sent again when a robot was added, and not without a change", async () => {
    const { loading, waiting, settle, told } = page();
    loading.onHello(kHello);
    loading.onInfo(info(["a"]));
    waiting[0]!.answer();
    await settle();
    loading.onInfo(info(["a"], { utime: 5n, paused: true }));
    loading.onInfo(info(["a", "b"]));
    expect(told.filter((line) => line.includes(" in "))).toEqual(["a in scene", "a,b in scene"]);
  });

  it("tries once more, and continues without a scene", async () => {
    const { loading, waiting, settle, told } = page();
    loading.onHello(kHello);
    loading.onInfo(info(["a"]));
    waiting[0]!.fail();
    await settle();
    expect(loading.complete).toBe(false);
    waiting[1]!.fail();
    await settle();
    expect(told.slice(-2)).toEqual(["failed: no", "a in null"]);
  });

  it("restarts with another connection", async () => {
    const { loading, waiting, settle, last } = page();
    loading.onHello(kHello);
    loading.onInfo(info(["a"]));
    waiting[0]!.answer();
    await settle();
    loading.onHello(kHello);
    expect(loading.complete).toBe(false);
    waiting[1]!.answer();
    await settle();
    expect(loading.complete).toBe(false); // the known world may be the previous one
    loading.onInfo(info(["c"], { run_id: 2n }));
    expect(last()).toBe("c in scene");
  });

  it("puts a world together from its parts, in their order only", () => {
    const { loading, last, told } = page();
    loading.onHello(kHello);
    loading.onInfo(info(["b"], { part: 1, nparts: 2 }));
    expect(told).toEqual(["greeted"]);
    loading.onInfo(info(["a"], { part: 0, nparts: 2 }));
    loading.onInfo(info(["b"], { part: 1, nparts: 2 }));
    expect(last()).toBe("runs a,b");
  });
});
