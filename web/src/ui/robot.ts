// The panel's pages about one robot: state, pictures, ranges, motion primitives, and plots.
import {
  image_t,
  motion_status_t,
  type collisions_t,
  type contact_t,
  type device_info_t,
  type imu_t,
  type joint_state_t,
  type odometry_t,
  type planar_lidar_t,
  type pose_t,
  type robot_info_t,
  type sonar_t,
} from "../../generated/messages";
import { textOf } from "../widgets/text";
import { decimals, h, say } from "../widgets/elements";
import { JointTable, type JointActions } from "./joints";
import { makeMoveForm } from "./move_form";
import type { Move } from "../state/go_to";
import { inWorld, type Heading } from "./odometry";
import { kWindow_s, PolarPlot, TimePlot } from "../widgets/plots";
import { XYPlot } from "../widgets/xy_plot";
import { kReasons } from "../state/go_to";
import { Picture, type Source } from "../widgets/picture";

// At earlier moments; time_s: sim time.
export interface PastPose {
  time_s: number;
  x: number; // m
  y: number;
  heading: number; // rad
  v: number; // m/s
  omega: number; // rad/s
}
export type PastOdometry = Pick<odometry_t, "x" | "y" | "theta" | "v" | "omega"> & {
  time_s: number;
};

const kStates = ["idle", "running", "done", "ended", "refused"];
const kFacts = ["drive", "pose", "speed", "odometry", "odometry error", "motion", "runs into"];
const kLevel_m = 0.5; // smaller heights, up or down, are not shown
const fixed = (value: number) => decimals(value, 3);

const kKinds: Record<number, string> = {
  1: "advance",
  2: "rotate",
  3: "heading",
  4: "arc",
  5: "stop",
  [motion_status_t.KIND_VELOCITY]: "velocity",
  [motion_status_t.KIND_WHEELS]: "wheels",
};
const shortly = (values: Iterable<number>) => [...values].map((v) => decimals(v, 2)).join(", ");
const degrees = (rad: number) => `${decimals((rad * 180) / Math.PI, 1)}°`;
const heading = (rad: number) => degrees(wrap(rad)); // all headings in the same range, -180 to 180
const yawOf = (q: ArrayLike<number>) =>
  Math.atan2(2 * (q[0]! * q[3]! + q[1]! * q[2]!), 1 - 2 * (q[2]! ** 2 + q[3]! ** 2));
const wrap = (angle: number) => Math.atan2(Math.sin(angle), Math.cos(angle));

export class RobotPages {
  readonly facts = h("dl", { class: "facts", id: "facts" });
  readonly statePage: HTMLElement;
  readonly plotPage: HTMLElement;
  private readonly pictures = new Map<string, Picture>();
  private readonly pictureList = h("div");
  private readonly jointTable: JointTable;
  readonly extras = h("div"); // for further views of the robot
  private readonly motions: HTMLElement;
  private readonly ranges: HTMLElement;
  private readonly about: HTMLElement; // the whole page
  private readonly none = h("p", { class: "dim" }, "This world has no robot.");
  private order: string[] = []; // of the facts
  private readonly values = new Map<string, HTMLElement>();
  private readonly polar = new PolarPlot();
  private readonly speed = new TimePlot("Velocity profile", "m/s, rad/s", [
    { label: "v true, m/s", colour: "--true" },
    { label: "v odometry", colour: "--odometry", dash: [5, 3] },
    { label: "ω true, rad/s", colour: "--sonar", scale: "w" },
    { label: "ω odometry", colour: "--rays", scale: "w", dash: [5, 3] },
  ]);
  private readonly path = new XYPlot(
    "Path",
    ["x, m", "y, m"],
    [
      { label: "true", colour: "--true" },
      { label: "odometry", colour: "--odometry", dash: [5, 3] },
    ],
    true,
    kWindow_s,
  );
  private readonly error = new TimePlot("Odometry error", "m, degrees", [
    { label: "distance, m", colour: "--rays" },
    { label: "heading, °", colour: "--sonar", scale: "w" },
  ]);
  // Sends the robot to clicked points.
  readonly goButton = h(
    "button",
    { id: "go", title: "with Shift, further points; Esc leaves it" },
    "Go to a click (G)",
  );
  private start: Heading | null = null; // the pose of odom in the world; null if unknown
  private truth: pose_t | null = null;
  private reckoned: odometry_t | null = null;

  constructor(move: (command: Move) => unknown, stop: () => void, joints: JointActions) {
    this.jointTable = new JointTable(joints);
    this.motions = h(
      "section",
      { id: "motions" },
      h("h2", {}, "Motion primitive"),
      makeMoveForm(move, h("button", { click: stop, title: "stop (X)" }, "Stop"), this.goButton),
    );
    this.ranges = h("section", { id: "ranges" }, h("h2", {}, "Ranges"), this.polar.element);
    this.about = h(
      "div",
      {},
      this.facts,
      this.jointTable.element,
      this.motions,
      this.ranges,
      h("h2", {}, "Pictures"),
      this.pictureList,
      this.extras,
    );
    this.statePage = h("section", {}, this.none, this.about);
    this.plotPage = h("section", {}, this.speed.element, this.path.element, this.error.element);
    this.showNone(true);
  }

  // Shows a note if there is no robot to show.
  showNone(none: boolean): void {
    this.none.hidden = !none;
    this.about.hidden = this.plotPage.hidden = none;
  }

  // Whether the robot accepts motion primitives.
  showMotions(can: boolean): void {
    this.motions.hidden = !can;
  }

  // The pose where odometry begins; undefined if unknown.
  beginAt(start: number[] | undefined): void {
    this.start = start ? [start[0]!, start[1]!, yawOf(start.slice(3))] : null;
  }

  show(robot: robot_info_t, devices: device_info_t[]): void {
    this.values.clear();
    this.jointTable.clear();
    this.facts.replaceChildren();
    this.pictures.clear();
    this.truth = this.reckoned = null;
    this.polar.clear();
    for (const plot of this.plots) plot.clear();
    this.ranges.hidden = true; // until ranges arrive
    this.order = [...kFacts, ...devices.map(({ name }) => name)];
    this.fact("drive", `${robot.model}, ${robot.drive || "no drive"}`);
    const cameras = devices.filter((d) => d.kind === "camera");
    this.pictureList.replaceChildren(
      cameras.length === 0 ? h("p", { class: "dim" }, "This robot has no camera.") : "",
    );
  }

  // Clears the plots.
  forget(): void {
    this.truth = this.reckoned = null;
    for (const plot of this.plots) plot.clear();
  }
  private get plots() {
    return [this.speed, this.path, this.error];
  }

  private fact(name: string, text: string): void {
    let value = this.values.get(name);
    if (!value) {
      value = h("dd", { "data-fact": name });
      this.values.set(name, value);
      // Always in the same order, whichever arrives first
      const at = this.order.indexOf(name),
        next = [...this.facts.children].find(
          (term) => term.localName === "dt" && this.order.indexOf(term.textContent) > at,
        );
      this.facts.insertBefore(h("dt", {}, name), next ?? null);
      this.facts.insertBefore(value, next ?? null);
    }
    say(value, text);
  }

  pose(m: pose_t): void {
    this.truth = m;
    const t = Number(m.utime) * 1e-6;
    const [x, y, z] = m.pos as unknown as [number, number, number];
    this.fact(
      "pose",
      `${fixed(x)} m, ${fixed(y)} m, ${heading(yawOf(m.orientation))}` +
        (Math.abs(z) > kLevel_m ? `, at a height of ${fixed(z)} m` : ""),
    );
    this.fact("speed", `${fixed(m.vel[0]!)} m/s, ${fixed(m.rotation_rate[2]!)} rad/s`);
    this.plotPose(t, x, y, m.vel[0]!, m.rotation_rate[2]!);
    this.compare();
  }

  odometry(m: odometry_t): void {
    const t = Number(m.utime) * 1e-6;
    this.fact("odometry", `${fixed(m.x)} m, ${fixed(m.y)} m, ${heading(m.theta)}`);
    this.plotOdometry(t, m);
    this.reckoned = m;
    this.compare();
  }

  private plotPose(time_s: number, x: number, y: number, v: number, omega: number): void {
    this.speed.add(0, time_s, v);
    this.speed.add(2, time_s, omega);
    this.path.add(0, time_s, x, y);
  }
  private plotOdometry(
    time_s: number,
    m: Pick<odometry_t, "x" | "y" | "theta" | "v" | "omega">,
  ): void {
    this.speed.add(1, time_s, m.v);
    this.speed.add(3, time_s, m.omega);
    if (!this.start) return;
    const [x, y] = inWorld(m, this.start);
    this.path.add(1, time_s, x, y);
  }

  // Plots what was before the shown moment. Both in the order of their times.
  retrace(poses: readonly PastPose[], odometry: readonly PastOdometry[]): void {
    for (const plot of this.plots) plot.clear();
    let next = 0;
    for (const pose of poses) {
      for (; next < odometry.length && odometry[next]!.time_s <= pose.time_s; ++next) {
        const reckoned = odometry[next]!;
        this.plotOdometry(reckoned.time_s, reckoned);
        if (reckoned.time_s === pose.time_s) this.plotError(pose.time_s, reckoned, pose);
      }
      this.plotPose(pose.time_s, pose.x, pose.y, pose.v, pose.omega);
    }
    for (const reckoned of odometry.slice(next)) this.plotOdometry(reckoned.time_s, reckoned);
  }

  // Compares odometry with the pose of the same moment, whichever arrives last.
  private compare(): void {
    const { truth, reckoned } = this;
    if (!this.start || !truth || !reckoned || truth.utime !== reckoned.utime) return;
    const [x, y] = truth.pos as unknown as [number, number],
      pose = { x, y, heading: yawOf(truth.orientation) };
    const [away, turn] = this.plotError(Number(truth.utime) * 1e-6, reckoned, pose)!;
    this.fact("odometry error", `${away.toFixed(3)} m, ${degrees(turn)}`);
  }

  // m, rad
  private plotError(
    time_s: number,
    reckoned: Pick<odometry_t, "x" | "y" | "theta">,
    truth: { x: number; y: number; heading: number },
  ): [away: number, turn: number] | null {
    if (!this.start) return null;
    const [x, y, heading] = inWorld(reckoned, this.start),
      away = Math.hypot(x - truth.x, y - truth.y),
      turn = wrap(heading - truth.heading);
    this.error.add(0, time_s, away);
    this.error.add(1, time_s, (turn * 180) / Math.PI);
    return [away, turn];
  }

  onMotion: (m: motion_status_t) => void = () => undefined;
  motion(m: motion_status_t): void {
    this.onMotion(m);
    const kind = kKinds[m.kind] ?? "",
      unit = m.kind === 1 ? "m" : "rad";
    const far =
      m.kind >= 1 && m.kind <= 4
        ? ` · ${m.done.toFixed(2)} of ${(m.done + m.remaining).toFixed(2)} ${unit}`
        : "";
    this.fact(
      "motion",
      `${kind} ${kStates[m.state] ?? ""}${far}${m.reason ? ` (${kReasons[m.reason] ?? m.reason})` : ""}`.trim(),
    );
  }
  imu(device: device_info_t, m: imu_t): void {
    this.fact(
      device.name,
      [
        `${shortly(m.linear_acceleration)} m/s²`,
        `${shortly(m.angular_velocity)} rad/s`,
        m.orientation.some((v) => v !== 0) ? `heading ${heading(yawOf(m.orientation))}` : "",
      ]
        .filter(Boolean)
        .join(" · "),
    );
  }
  joints(m: joint_state_t): void {
    this.jointTable.show(m);
  }
  // For a device of an unknown type: its members by name.
  other(device: device_info_t, m: object): void {
    const shown = (value: unknown) =>
      typeof value === "number" ? String(Number(value.toPrecision(9))) : textOf(value, 1);
    const members = Object.entries(m).filter(([name]) => name !== "utime" && name !== "n");
    this.fact(
      device.name,
      members.map(([name, value]) => `${name.replaceAll("_", " ")} ${shown(value)}`).join(" · "),
    );
  }
  contact(device: device_info_t, m: contact_t): void {
    this.fact(
      device.name,
      m.pressed
        ? `touches ${[...new Set(m.points.map((p) => p.body))].join(", ") || "something"}`
        : "free",
    );
  }
  collisions(m: collisions_t): void {
    const touched = [...new Set(m.points.map((p) => p.body))].join(", ");
    const blocked = m.blocked_by ? ` · blocked by ${m.blocked_by}` : "";
    this.fact("runs into", (touched || "nothing") + blocked);
  }
  scan(device: device_info_t, m: planar_lidar_t): void {
    this.ranges.hidden = false;
    this.polar.scan(device, m);
    const nearest = m.ranges.reduce(
      (least, r) => (Number.isFinite(r) && r < least ? r : least),
      Infinity,
    );
    this.fact(
      device.name,
      `${m.ranges.length} rays, nearest ${Number.isFinite(nearest) ? `${nearest.toFixed(2)} m` : "nothing"}`,
    );
  }
  sonar(device: device_info_t, m: sonar_t): void {
    this.ranges.hidden = false;
    this.polar.sonar(device, m);
  }
  camera(name: string, m: image_t, source: Source): void {
    let picture = this.pictures.get(name);
    if (!picture) {
      picture = new Picture(name);
      this.pictures.set(name, picture);
      this.pictureList.append(picture.element);
    }
    picture.show(m, source);
  }

  draw(): void {
    if (this.statePage.isConnected) this.polar.draw();
    if (this.plotPage.isConnected) for (const plot of this.plots) plot.draw();
  }
  restyle(): void {
    this.polar.restyle();
    for (const plot of this.plots) plot.restyle();
  }
}
