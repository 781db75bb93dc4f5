// Messages are passed to the views that show them.
import { describe, expect, it, vi } from "vitest";
import { kTypes } from "../generated/messages";
import { Store } from "../src/state/store";
import type { PageState } from "../src/state/page";
import type { World } from "../src/state/world";
import { encode, fingerprint, type TypeName } from "../src/wire/lcm";
import { Router, routesOf, type Views } from "../src/app/router";

const channel = (
  name: string,
  type: string,
  robot = "",
  device = "",
  hash = fingerprint(type),
) => ({ name, type, robot, device, fingerprint: hash, input: false });

const kWorld = {
  robots: [{ name: "a" }, { name: "b" }],
  devices: [
    { robot: "a", name: "bumper" },
    { robot: "b", name: "bumper" },
    { robot: "b", name: "pose", kind: "pose" },
    { robot: "b", name: "p3d", kind: "body_pose" },
    { robot: "b", name: "gps", kind: "navsat" },
  ],
  channels: [
    channel("ruedo/tick", "tick_t"),
    channel("a/pose", "pose_t", "a", "pose"),
    channel("b/pose", "pose_t", "b", "pose"),
    channel("b/bumper", "contact_t", "b", "bumper"),
    channel("b/p3d", "pose_t", "b", "p3d"),
    channel("b/gps", "navsat_t", "b", "gps"),
    channel("a/odd", "pose_t", "a", "odd", 7n),
    channel("renamed", "odometry_t", "b", "odometry"),
  ],
} as unknown as World;

const kPose = encode("pose_t", {
  utime: 1n,
  pos: new Float64Array(3),
  vel: new Float64Array(3),
  orientation: new Float64Array([1, 0, 0, 0]),
  rotation_rate: new Float64Array(3),
  accel: new Float64Array(3),
});

function made(complete = true) {
  const called: string[] = [];
  const note = (name: string) =>
    new Proxy(
      {},
      {
        get:
          (_, method) =>
          (...given: unknown[]) =>
            void called.push(
              `${name}.${String(method)}${typeof given[0] === "number" ? ` ${String(given[0])}` : ""}`,
            ),
      },
    );
  const views = {
    loading: note("loading"),
    session: note("session"),
    poses: note("poses"),
    clock: note("clock"),
    stage: { bodies: note("bodies") },
    pages: note("pages"),
    channels: note("channels"),
    overlays: {
      of: new Map([
        ["a", note("overlay a")],
        ["b", note("overlay b")],
      ]),
    },
  } as unknown as Views;
  const page = new Store({ world: kWorld, complete, robot: 1 } as PageState);
  return { router: new Router(page, views), called, views, page };
}

describe("routes", () => {
  it("are of types that both sides know alike", () => {
    expect([...routesOf(kWorld).keys()]).toEqual([
      "ruedo/tick",
      "a/pose",
      "b/pose",
      "b/bumper",
      "b/p3d",
      "b/gps",
      "renamed",
    ]);
  });
});

describe("a message", () => {
  it("of a robot goes to its overlay, and to the panel when it is the chosen one", () => {
    const { router, called } = made();
    router.onMessage("a/pose", kPose);
    router.onMessage("b/pose", kPose);
    expect(called).toEqual([
      "channels.message",
      "overlay a.pose",
      "channels.message",
      "overlay b.pose",
      "pages.pose",
    ]);
  });

  it("of a device that the page does not know is shown as values, and is no robot's pose", () => {
    const { router, called } = made();
    router.onMessage("b/p3d", kPose);
    const velocity = new Float64Array(3);
    const place = { utime: 1n, latitude_deg: 47, longitude_deg: 8, altitude: 400, velocity };
    router.onMessage("b/gps", encode("navsat_t", place));
    expect(called.filter((call) => !call.startsWith("channels"))).toEqual([
      "pages.other",
      "pages.other",
    ]);
  });

  it("goes by its channel's robot, whatever the channel's name", () => {
    const { router, called } = made();
    const none = new Float64Array();
    router.onMessage(
      "renamed",
      encode("odometry_t", {
        utime: 1n,
        x: 0,
        y: 0,
        theta: 0,
        v: 0,
        omega: 0,
        n: 0,
        angle: none,
        rate: none,
        ticks: [],
      } as never),
    );
    expect(called).toContain("overlay b.odometer");
    expect(called).toContain("bodies.turnWheels 1");
  });

  it("of the run wait until all is loaded; loaded files and replies do not", () => {
    const { router, called } = made(false);
    router.onMessage("a/pose", kPose);
    router.onMessage("ruedo/tick", encodeEmpty("tick_t"));
    router.onMessage("ruedo/info", encodeEmpty("world_info_t"));
    router.onMessage("ruedo/reply", encodeEmpty("reply_t"));
    expect(called.filter((call) => !call.startsWith("channels"))).toEqual([
      "loading.onInfo",
      "session.onReply",
    ]);
  });

  it("that is cut or of no known type harms nothing", () => {
    const { router, called } = made(),
      warn = vi.spyOn(console, "warn").mockImplementation(() => undefined);
    router.onMessage("b/pose", kPose.subarray(0, 40));
    router.onMessage("b/pose", new Uint8Array());
    router.onMessage("stranger", new Uint8Array([1, 2, 3]));
    expect(called.filter((call) => !call.startsWith("channels"))).toEqual([]);
    expect(warn).toHaveBeenCalled();
    warn.mockRestore();
  });
});

// Zeros and empty texts; arrays have no elements.
function encodeEmpty(name: TypeName): Uint8Array {
  const value: Record<string, unknown> = {};
  for (const field of kTypes[name]!) {
    value[field.name] =
      field.sizes.length > 0
        ? []
        : field.type === "string"
          ? ""
          : field.type === "int64_t"
            ? 0n
            : field.type === "boolean"
              ? false
              : 0;
  }
  return encode(name, value as never);
}
