// Changes of the world, as requests that any client could make. Each can be undone.
import type { Box3 } from "three";
import { request_t } from "../../generated/messages";
import type { Control } from "../control";
import type { ModelDescription } from "../wire/description";
import type { Page, Thing } from "../state/page";
import type { Poses } from "../state/poses";
import { chosen } from "../widgets/confirm";
import { toast } from "../widgets/elements";
import { encode } from "../wire/lcm";
import { History } from "./history";
import { poseNow, samePose, type Pose7 } from "./pose";
import { scaled, withDoor, type Door, type Size } from "./sdf";

const kCopyAside_m = 0.1, // between a model and its copy
  kTouch_m = 1e-3; // things that touch leave room
const kRest_m = 2e-4; // smaller motions between two looks count as rest
const kLook_ms = 250; // between two looks while settling
const kLongestSettling_s = 10; // of sim time
const kLookForPose_ms = 20;
const kLongestWait_ms = 10_000; // for a new model's pose

export class Editor {
  readonly history: History;
  // names of placed models that may not be in the scene yet
  private readonly given = new Set<string>();
  // those of removed models that are still in the scene
  private readonly gone = new Set<string>();

  // box: around a model's visible shapes; empty if it has none.
  constructor(
    private readonly page: Page,
    private readonly poses: Poses,
    private readonly control: Control,
    private readonly box: (model: ModelDescription) => Box3,
  ) {
    this.history = new History((edits) => page.set({ edits }));
    page.watch(["scene"], ({ scene, selected }) => {
      this.gone.clear();
      if (selected && scene && !this.given.has(selected) && !this.find(selected))
        page.set({ selected: "" });
    });
  }

  // The existing models.
  get models(): ModelDescription[] {
    return this.page.now.scene?.models.filter(({ name }) => name !== "") ?? [];
  }
  find(name: string): ModelDescription | undefined {
    return this.models.find((model) => model.name === name);
  }
  pose(name: string): Pose7 | null {
    const model = this.find(name);
    return model && !this.gone.has(name) ? poseNow(model, this.poses) : null;
  }

  // ---- changes

  move(name: string, to: Pose7): Promise<boolean> {
    const from = this.pose(name);
    if (!from || samePose(from, to)) return Promise.resolve(false);
    return this.history.do({
      name: `move ${name}`,
      apply: () => this.setPose(name, to),
      revert: () => this.setPose(name, from),
    });
  }

  // On the ground at that point, or at a pose.
  add({ name: base, model, text }: Thing, to: Pose7, onGround: boolean): Promise<boolean> {
    const name = this.unusedName(base);
    this.given.add(name);
    return this.history.do({
      name: `place ${name}`,
      apply: () => this.spawn(name, { model, text }, to, onGround),
      revert: () => this.take(name),
    });
  }

  async remove(name: string): Promise<boolean> {
    const from = await this.knownPose(name),
      text = await this.text(name);
    if (!from || text === null) return false;
    return this.history.do({
      name: `delete ${name}`,
      apply: () => this.take(name),
      revert: () => this.spawn(name, { model: "", text }, from, false),
    });
  }

  // Beside it, where there is room, as near as possible.
  async duplicate(name: string): Promise<boolean> {
    const from = await this.knownPose(name),
      text = await this.text(name);
    if (!from || text === null) return false;
    const copy = this.unusedName(name);
    let to: Pose7 | null = null; // where it found room
    this.given.add(copy);
    const good = await this.history.do({
      name: `duplicate ${name}`,
      apply: async () => {
        for (const [x, y] of to ? [] : this.roomBeside(name)) {
          const there = [from[0]! + x, from[1]! + y, ...from.slice(2)];
          if (!(await this.spawn(copy, { model: "", text }, there, false, true))) continue;
          to = there;
          return true;
        }
        if (to) return this.spawn(copy, { model: "", text }, to, false);
        toast(`There is no room for a copy of ${name} beside it.`, "error");
        return false;
      },
      revert: () => this.take(copy),
    });
    if (good) this.page.set({ selected: copy });
    else this.given.delete(copy);
    return good;
  }

  // Ways from a model to places for a copy, the nearest first: those where the boxes around other
  // models are not met, and then the others, which the server may refuse.
  private roomBeside(name: string): [x: number, y: number][] {
    const model = this.find(name),
      box = model && this.box(model);
    if (!box || box.isEmpty()) return [[kCopyAside_m, 0]];
    const others = this.models
      .filter((other) => other !== model)
      .map((other) => this.box(other).expandByScalar(-kTouch_m));
    const [w, d] = [box.max.x - box.min.x + kCopyAside_m, box.max.y - box.min.y + kCopyAside_m];
    const ways = [1, 2, 3, 4].flatMap((n): [number, number][] => [
      [n * w, 0],
      [0, n * d],
      [-n * w, 0],
      [0, -n * d],
    ]);
    const isFree = ([x, y]: [number, number]) => {
      const there = box.clone();
      for (const corner of [there.min, there.max]) {
        corner.x += x;
        corner.y += y;
      }
      return !others.some((other) => !other.isEmpty() && other.intersectsBox(there));
    };
    const free = ways.filter(isFree),
      near = (a: number[], b: number[]) => Math.hypot(a[0]!, a[1]!) - Math.hypot(b[0]!, b[1]!);
    // a fixed model is not refused anywhere: rather far away than in a wall
    return [...free.sort(near), ...(model.fast && free.length > 0 ? [] : ways.sort(near))];
  }

  async rename(name: string, to: string): Promise<boolean> {
    const text = await this.text(name);
    if (text === null || to === name) return false;
    if (to === "" || this.find(to)) {
      toast(to === "" ? "A model has a name." : `There is a model called ${to} already.`, "error");
      return false;
    }
    const exchange = async (old: string, fresh: string) => {
      const pose = await this.knownPose(old);
      if (!pose) return false;
      this.given.add(fresh);
      if (!(await this.withdraw(old))) return false;
      const good = await this.spawn(fresh, { model: "", text }, pose, false);
      if (!good) await this.spawn(old, { model: "", text }, pose, false);
      this.given.delete(good ? old : fresh);
      if (good) this.page.set({ selected: fresh });
      return good;
    };
    return this.history.do({
      name: `rename ${name}`,
      apply: () => exchange(name, to),
      revert: () => exchange(to, name),
    });
  }

  // Replaces a model by what a function makes of its text.
  change(name: string, what: string, by: (xml: string) => string): Promise<boolean> {
    return this.rewrite(name, `${what} ${name}`, by);
  }

  // Models on the ground stay on the ground.
  async scale(name: string, factor: Size): Promise<boolean> {
    const pose = await this.knownPose(name),
      model = this.find(name),
      low = model ? this.box(model).min.z : 0;
    const raise = pose && Number.isFinite(low) ? (pose[2]! - low) * (factor[2] - 1) : 0;
    return this.rewrite(name, `scale ${name}`, (text) => scaled(text, factor), raise);
  }

  // at: a point in the model's frame.
  door(name: string, at: [x: number, y: number], door: Door): Promise<boolean> {
    return this.rewrite(name, `door in ${name}`, (text) => withDoor(text, at, door));
  }

  // Runs the physics until nothing moves any more.
  settle(): Promise<boolean> {
    let before = new Map<string, Pose7>();
    return this.history.do({
      name: "settle",
      apply: async () => {
        before = new Map();
        for (const { name, fast, path } of this.models) {
          if (fast || path) continue;
          const pose = await this.knownPose(name);
          if (!pose) return false;
          before.set(name, pose);
        }
        if (!(await this.control.request(request_t.RESUME))) return false;
        await this.rest();
        return this.control.request(request_t.PAUSE);
      },
      revert: async () => {
        let good = true;
        for (const [name, pose] of before) {
          const now = await this.knownPose(name);
          if (now && !samePose(now, pose, 1e-4)) good = (await this.setPose(name, pose)) && good;
        }
        return good;
      },
    });
  }

  async save(): Promise<boolean> {
    const answer = await this.write("");
    if (typeof answer === "string") return this.tell(answer);
    if (!/another program/.test(answer.message)) return this.refused(answer);
    const file = this.page.now.hello?.save ?? "";
    const how = await chosen(`Overwrite ${file}?`, `${answer.message}.`, [
      ["copy", "Save a copy"],
      ["overwrite", "Overwrite"],
    ]);
    if (how === "copy") return this.saveCopy();
    const again = how === "overwrite" ? await this.write("overwrite") : null;
    if (again instanceof Error) return this.refused(again);
    return again !== null && this.tell(again);
  }

  // Beside the file, by a name that the server finds.
  async saveCopy(): Promise<boolean> {
    const answer = await this.write("copy");
    if (answer instanceof Error) return this.refused(answer);
    toast(`Saved a copy as ${answer}.`);
    return true;
  }

  // The server's reply, or the reason why there is none.
  private async write(how: "" | "overwrite" | "copy"): Promise<string | Error> {
    const { changes } = this.page.now.edits,
      body = how ? encode("name_request_t", { name: how }) : undefined;
    try {
      const { text } = await this.control.session.ask(request_t.SAVE, body);
      if (how !== "copy") this.page.set({ saved: changes });
      return text;
    } catch (error) {
      return error as Error;
    }
  }
  private tell(note: string): true {
    toast(note ? `Saved; but ${note}.` : `Saved to ${this.page.now.hello?.save}.`);
    return true;
  }
  private refused({ message }: Error): false {
    toast(message, "error");
    return false;
  }

  // ---- requests

  private setPose(name: string, pose: Pose7): Promise<boolean> {
    return this.control.request(
      request_t.SET_POSE,
      encode("set_pose_request_t", { name, ...placeOf(pose) }),
    );
  }

  private spawn(
    name: string,
    { model, text }: { model: string; text: string },
    pose: Pose7,
    onGround: boolean,
    quiet = false,
  ): Promise<boolean> {
    return this.control.request(
      request_t.SPAWN,
      encode("spawn_request_t", { name, model, text, on_ground: onGround, ...placeOf(pose) }),
      quiet,
    );
  }

  private take(name: string): Promise<boolean> {
    this.given.delete(name);
    return this.withdraw(name);
  }

  private async withdraw(name: string): Promise<boolean> {
    const body = this.find(name)?.body ?? -1;
    this.gone.add(name);
    const good = await this.control.request(request_t.REMOVE, encode("name_request_t", { name }));
    if (good)
      this.poses.forget(body); // which the next model may have
    else this.gone.delete(name);
    return good;
  }

  // Once it is known: a new model's comes with the next state. Null: there is no such model, or it
  // does not come.
  private async knownPose(name: string): Promise<Pose7 | null> {
    const end = performance.now() + kLongestWait_ms;
    for (;;) {
      const pose = this.pose(name),
        comes = this.given.has(name) || this.find(name);
      if (pose || !comes || this.page.now.link !== "open") return pose;
      if (performance.now() > end) {
        toast(`${name}: where it is was not heard.`, "error");
        return null;
      }
      await new Promise((resolve) => setTimeout(resolve, kLookForPose_ms));
    }
  }

  // Replaces a model by another text, raised by that much. If the new one cannot stand there, the
  // old one is restored.
  private async rewrite(
    name: string,
    what: string,
    change: (text: string) => string,
    raise = 0,
  ): Promise<boolean> {
    const old = await this.text(name);
    if (old === null) return false;
    let fresh: string;
    try {
      fresh = change(old);
    } catch (error) {
      toast(`${name}: ${(error as Error).message}.`, "error");
      return false;
    }
    const exchange = async (text: string, back: string, up: number) => {
      const pose = await this.knownPose(name);
      if (!pose) return false;
      const raised = [pose[0]!, pose[1]!, pose[2]! + up, ...pose.slice(3)];
      this.given.add(name); // it is missing for a moment
      if (!(await this.withdraw(name))) return false;
      if (await this.spawn(name, { model: "", text }, raised, false)) return true;
      await this.spawn(name, { model: "", text: back }, pose, false);
      return false;
    };
    return this.history.do({
      name: what,
      apply: () => exchange(fresh, old, raise),
      revert: () => exchange(old, fresh, -raise),
    });
  }

  // The request that SPAWNs that model again; null if there is none.
  async textOf(name: string): Promise<string | null> {
    const index = this.gone.has(name)
      ? -1
      : (this.page.now.scene?.models.findIndex((model) => model.name === name) ?? -1);
    const answer = index >= 0 ? await fetch(`/scene/models/${index}`).catch(() => null) : null;
    return answer?.ok ? (await answer.text()) || null : null;
  }

  // Likewise, with a note.
  private async text(name: string): Promise<string | null> {
    const text = await this.textOf(name);
    if (text !== null) return text;
    toast(
      `${name} has no text of its own in the file, as robots of a fleet: it can be moved, and nothing else.`,
      "error",
    );
    return null;
  }

  private unusedName(name: string): string {
    const taken = new Set([...this.models.map((model) => model.name), ...this.given]);
    if (!taken.has(name)) return name;
    const stem = name.replace(/_\d+$/, "");
    let number = 2;
    while (taken.has(`${stem}_${number}`)) ++number;
    return `${stem}_${number}`;
  }

  private async rest(): Promise<void> {
    const begun_s = this.page.now.time_s;
    let before: number[] = [],
      still = 0;
    while (this.page.now.time_s - begun_s < kLongestSettling_s && still < 3) {
      await new Promise((resolve) => setTimeout(resolve, kLook_ms));
      if (this.page.now.link !== "open") return;
      const now = [...this.poses.to],
        moved =
          now.length !== before.length ||
          now.some((value, i) => Math.abs(value - before[i]!) > kRest_m);
      still = moved || this.page.now.time_s === begun_s ? 0 : still + 1;
      before = now;
    }
  }
}

const placeOf = (pose: Pose7) => ({
  position: new Float64Array(pose.slice(0, 3)),
  orientation: new Float64Array(pose.slice(3)),
});
