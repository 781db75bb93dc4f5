// Changes of the world, as requests that any client could make. Each can be undone.
import type { Box3 } from "three";
import { request_t } from "../../generated/messages";
import type { Control } from "../control";
import type { ModelDescription } from "../wire/description";
import type { Page, Thing } from "../state/page";
import type { Poses } from "../state/poses";
import { toast } from "../widgets/elements";
import { encode } from "../wire/lcm";
import { History } from "./history";
import { poseNow, samePose, type Pose7 } from "./pose";
import { scaled, withDoor, type Door, type Size } from "./sdf";

const kCopyAside_m = 0.1; // between a model and its copy
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

  async duplicate(name: string): Promise<boolean> {
    const from = await this.knownPose(name),
      text = await this.text(name);
    if (!from || text === null) return false;
    const copy = this.unusedName(name),
      to = [from[0]! + this.width(name) + kCopyAside_m, ...from.slice(1)];
    this.given.add(copy);
    const good = await this.history.do({
      name: `duplicate ${name}`,
      apply: () => this.spawn(copy, { model: "", text }, to, false),
      revert: () => this.take(copy),
    });
    if (good) this.page.set({ selected: copy });
    return good;
  }

  private width(name: string): number {
    const model = this.find(name),
      box = model && this.box(model);
    return box && !box.isEmpty() ? box.max.x - box.min.x : 0;
  }

  // What stands on the ground stays on the ground.
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
    const { changes } = this.page.now.edits,
      reply = await this.control.ask(request_t.SAVE);
    if (!reply) return false;
    this.page.set({ saved: changes });
    toast(reply.text ? `Saved; but ${reply.text}.` : `Saved to ${this.page.now.hello?.save}.`);
    return true;
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
  ): Promise<boolean> {
    return this.control.request(
      request_t.SPAWN,
      encode("spawn_request_t", { name, model, text, on_ground: onGround, ...placeOf(pose) }),
    );
  }

  private take(name: string): Promise<boolean> {
    this.given.delete(name);
    return this.withdraw(name);
  }

  private async withdraw(name: string): Promise<boolean> {
    const body = this.find(name)?.body ?? -1,
      good = await this.control.request(request_t.REMOVE, encode("name_request_t", { name }));
    if (good) {
      this.gone.add(name);
      this.poses.forget(body); // which the next model may have
    }
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

  // The request that SPAWNs that model again; null, with a note, if there is none.
  private async text(name: string): Promise<string | null> {
    const index = this.page.now.scene?.models.findIndex((model) => model.name === name) ?? -1;
    const answer = index >= 0 ? await fetch(`/scene/models/${index}`).catch(() => null) : null;
    if (answer?.ok) return answer.text();
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
