// The frames of a robot as a tree: world, odom and base_link, below it the frame of each device and
// of each link that moves relative to it.
import type { Page } from "../state/page";
import type { Stage } from "../scene/stage";
import * as THREE from "three";
import { matrixOf } from "../scene/matrix";
import { decimals, h, say } from "../widgets/elements";

const kNoFrame = new Set(["odometry", "pose", "motion", "collisions", "joints"]);
const kMostLinks = 200;
const kPeriod_ms = 200;

const number = (value: number, unit: string) => `${decimals(value, 3)} ${unit}`;

// "1.000 m, 0.000 m, 0.200 m, turned 90.0°"
export function poseWords(position: ArrayLike<number>, orientation: ArrayLike<number>): string {
  const [w, x, y, z] = [0, 1, 2, 3].map((i) => orientation[i]!) as [number, number, number, number];
  const yaw = Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    pitch = Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x)))),
    roll = Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  const turns = Object.entries({ roll, pitch, yaw })
    .filter(([, angle]) => Math.abs(angle) > 5e-4)
    .map(([name, angle]) => `${name} ${((angle * 180) / Math.PI).toFixed(1)}°`);
  const place = [0, 1, 2].map((i) => number(position[i]!, "m")).join(", ");
  return [place, ...turns].join(", ");
}

export class FrameTree {
  readonly element = h("details", { id: "tf" }, h("summary", {}, "Frames"));
  private readonly list = h("ul", { class: "frames" });
  private readonly basePose = h("span", { class: "dim" });
  private readonly matrix = new THREE.Matrix4();
  private readonly position = new THREE.Vector3();
  private readonly rotation = new THREE.Quaternion();
  private readonly scale = new THREE.Vector3();
  private readonly body = new THREE.Matrix4();
  private links: { body: number; pose: HTMLElement }[] = [];
  private shown_ms = 0;

  constructor(
    private readonly page: Page,
    private readonly stage: Stage,
  ) {
    this.element.append(this.list);
    page.watch(["world", "scene", "robot"], () => this.make());
  }

  private make(): void {
    const { world, scene, robot: at } = this.page.now,
      robot = world?.robots[at],
      base = scene?.bases.find((each) => each.robot === robot?.name);
    const item = (name: string, pose: Node | string, ...below: HTMLElement[]) =>
      h("li", {}, h("b", {}, name), " ", pose, below.length > 0 && h("ul", {}, ...below));
    if (!robot) return this.list.replaceChildren();
    const devices = world!.devices
      .filter(({ robot: of, kind }) => of === robot.name && !kNoFrame.has(kind))
      .map(({ name, position, orientation }) =>
        item(
          `${robot.name}/${name}`,
          h("span", { class: "dim" }, poseWords(position, orientation)),
        ),
      );
    const moving = (world!.bodies ?? [])
      .filter(
        ({ name, index }) =>
          name.startsWith(`${robot.name}/`) && index >= 0 && index !== (base?.body ?? -1),
      )
      .slice(0, kMostLinks);
    this.links = moving.map(({ index }) => ({ body: index, pose: h("span", { class: "dim" }) }));
    const links = moving.map(({ name }, i) => item(name, this.links[i]!.pose));
    const start = base ? poseWords(base.start.slice(0, 3), base.start.slice(3)) : "";
    this.list.replaceChildren(
      item(
        "world",
        "",
        item(`${robot.name}/odom`, h("span", { class: "dim" }, start)),
        item(`${robot.name}/base_link`, this.basePose, ...devices, ...links),
      ),
    );
  }

  // Once a frame: the poses of base_link and of the links in it.
  follow(at_ms: number): void {
    if (!(this.element as HTMLDetailsElement).open || at_ms - this.shown_ms < kPeriod_ms) return;
    this.shown_ms = at_ms;
    const { world, scene, robot } = this.page.now,
      name = world?.robots[robot]?.name;
    if (
      !this.stage.bodies.base(
        scene?.bases.findIndex((base) => base.robot === name) ?? -1,
        this.matrix,
      )
    )
      return;
    say(this.basePose, this.words(this.matrix));
    this.matrix.invert();
    const { poses } = this.stage;
    for (const { body, pose } of this.links) {
      if (!poses.known[body]) continue;
      matrixOf(poses.now, 7 * body, this.body).premultiply(this.matrix);
      say(pose, this.words(this.body));
    }
  }

  private words(matrix: THREE.Matrix4): string {
    matrix.decompose(this.position, this.rotation, this.scale);
    const { x, y, z, w } = this.rotation;
    return poseWords(this.position.toArray(), [w, x, y, z]);
  }
}
