// The editor beside a server that is slow to tell where the bodies are.
import { Box3, Vector3 } from "three";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { request_t } from "../generated/messages";
import type { Control } from "../src/control";
import { Editor } from "../src/edit/editor";
import { boxModel } from "../src/edit/sdf";
import type { PageState } from "../src/state/page";
import { Poses } from "../src/state/poses";
import { Store } from "../src/state/store";
import type { Description, ModelDescription } from "../src/wire/description";
import { decode } from "../src/wire/lcm";
import { stateOf } from "./told";

// A box of 1 m, whose frame is in its middle, and a server that tells of states and scenes when it
// is asked to.
function standing() {
  const page = new Store({ link: "open", scene: null, selected: "", time_s: 0 } as PageState),
    poses = new Poses(),
    asked: [kind: number, z: number][] = [];
  let body = 0;
  const show = () =>
    page.set({
      scene: {
        models: [{ name: "box", body, pose: [0, 0, 0, 1, 0, 0, 0], fast: false, path: false }],
      } as unknown as Description,
    });
  const tell = (z: number) => poses.add(stateOf(body, [0, 0, z]), 0);
  const control = {
    request: (kind: number, data?: Uint8Array) => {
      const type = kind === request_t.SPAWN ? "spawn_request_t" : "set_pose_request_t",
        placed = kind === request_t.SPAWN || kind === request_t.SET_POSE;
      asked.push([kind, placed ? decode(type, data!).position[2]! : NaN]);
      return Promise.resolve(true);
    },
  } as unknown as Control;
  const half = new Vector3(0.5, 0.5, 0.5);
  const box = (model: ModelDescription) => {
    const z = poses.to[7 * model.body + 2]!;
    return new Box3(half.clone().negate(), half.clone()).translate(new Vector3(0, 0, z));
  };
  show();
  tell(0.5);
  const exchanged = (by: number) => {
    body = by;
    show();
  };
  return { editor: new Editor(page, poses, control, box), asked, exchanged, tell };
}

describe("an edit beside a slow server", () => {
  beforeEach(() => {
    vi.useFakeTimers({ toFake: ["setTimeout", "performance"] });
    vi.stubGlobal("fetch", () => Promise.resolve(new Response(boxModel("box", [1, 1, 1]))));
  });
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });
  const aWhile = () => vi.advanceTimersByTimeAsync(100);

  // In the old one's place in the list, or in another.
  it.each([0, 1])("takes a scaled model back to where it stood, as body %i", async (body) => {
    const { editor, asked, exchanged, tell } = standing();
    await editor.scale("box", [2, 2, 2]);
    expect(asked.at(-1)).toEqual([request_t.SPAWN, 1.0]);
    const undone = editor.history.undo();
    await aWhile();
    exchanged(body);
    await aWhile();
    tell(1.0);
    await aWhile();
    expect(await undone).toBe(true);
    expect(asked.at(-1)).toEqual([request_t.SPAWN, 0.5]);
  });

  it("settles from where a new model is", async () => {
    const { editor, asked, exchanged, tell } = standing();
    await editor.scale("box", [2, 2, 2]);
    exchanged(1);
    void editor.settle();
    await aWhile();
    expect(asked.at(-1)![0]).toBe(request_t.SPAWN);
    tell(1.0);
    await aWhile();
    expect(asked.at(-1)![0]).toBe(request_t.RESUME);
  });
});
