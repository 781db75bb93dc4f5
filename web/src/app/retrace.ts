// After a jump to another moment: trails and standard plots, of what was before it.
import { shownOf } from "../state/time";
import { shownRobots } from "../state/page";
import type { World } from "../state/world";
import { kWindow_s } from "../widgets/plots";
import type { RobotPages } from "../ui/robot";
import type { History } from "../wire/protocol";
import type { Model } from "./model";
import type { SceneView } from "./scene_view";

const kPose = ["utime", "pos[0]", "pos[1]", "pos[2]", "vel[0]", "rotation_rate[2]"],
  kTurn = [0, 1, 2, 3].map((i) => `orientation[${i}]`),
  kOdometry = ["utime", "x", "y", "theta", "v", "omega"];
const kMostKept = 16; // histories of a log
const kShortest_s = 0.1;

export class Retrace {
  private readonly kept = new Map<string, Promise<History>>();
  private busy = false;
  private again = false;

  constructor(
    private readonly model: Model,
    private readonly scene: SceneView,
    private readonly pages: RobotPages,
  ) {
    model.onForget((reset) => {
      if (!reset) this.begin();
    });
    model.page.watch(["robot", "scene"], ({ hello, past }) => {
      if (hello?.mode === "log" || past) this.begin();
    });
    model.page.watch(["hello"], () => this.kept.clear());
  }

  // One after the other; of the requests made meanwhile, only the last.
  private begin(): void {
    this.again = true;
    if (this.busy) return;
    this.busy = true;
    void this.work().finally(() => (this.busy = false));
  }

  private async work(): Promise<void> {
    while (this.again) {
      this.again = false;
      const { page } = this.model,
        { world } = page.now,
        shown = shownOf(page.now);
      // Where a log begins there is nothing to look for yet.
      if (!world || !shown || shown.now - shown.begin < kShortest_s) return;
      for (const name of shownRobots(page.now)) await this.robot(world, name);
    }
  }

  private async robot(world: World, name: string): Promise<void> {
    const ownPose = (device: string) =>
      !device ||
      world.devices.some((d) => d.robot === name && d.name === device && d.kind === "pose");
    const of = (type: string) =>
      world.channels.find(
        (c) =>
          c.robot === name &&
          c.type === type &&
          !c.input &&
          (type !== "pose_t" || ownPose(c.device)),
      )?.name;
    const [poses, odometry] = await Promise.all([
      this.history(of("pose_t"), [...kPose, ...kTurn]),
      this.history(of("odometry_t"), kOdometry),
    ]);
    const { now, world: shown } = { ...shownOf(this.model.page.now)!, ...this.model.page.now };
    if (shown !== world || this.again) return; // another moment has been requested since
    const until = (history: History) => {
      const count = history.times.filter((time_s) => time_s <= now + 1e-9).length;
      return history.columns.map((column) => column.slice(0, count));
    };
    this.show(world, name, until(poses), until(odometry));
  }

  private show(world: World, name: string, pose: number[][], odometry: number[][]): void {
    const [, x = [], y = [], z = []] = pose,
      [, ox = [], oy = []] = odometry;
    this.scene.overlays.of.get(name)?.retrace(
      x.map((_, i) => [x[i]!, y[i]!, z[i]!]),
      ox.map((_, i) => [ox[i]!, oy[i]!]),
    );
    if (world.robots[this.model.page.now.robot]?.name !== name) return;
    this.pages.retrace(
      lately(pose).map(([utime, x, y, , v, omega, ...q]) => ({
        time_s: utime! * 1e-6,
        x: x!,
        y: y!,
        heading: yawOf(q),
        v: v!,
        omega: omega!,
      })),
      lately(odometry).map(([utime, x, y, theta, v, omega]) => ({
        time_s: utime! * 1e-6,
        x: x!,
        y: y!,
        theta: theta!,
        v: v!,
        omega: omega!,
      })),
    );
  }

  // Nothing where the channel has none. A log's does not change.
  private history(channel: string | undefined, paths: string[]): Promise<History> {
    const nothing: History = { every: 1, times: [], columns: paths.map(() => []) };
    if (!channel) return Promise.resolve(nothing);
    const ask = () => this.model.link.history(channel, paths).catch(() => nothing);
    if (this.model.page.now.hello?.mode !== "log") return ask();
    if (!this.kept.has(channel) && this.kept.size >= kMostKept) this.kept.clear();
    const kept = this.kept.get(channel) ?? ask();
    this.kept.set(channel, kept);
    return kept;
  }
}

// The rows of what the standard plots show, by their first column, utime.
function lately(columns: number[][]): number[][] {
  const times = columns[0]!,
    from = (times.at(-1) ?? 0) - kWindow_s * 1e6,
    rows: number[][] = [];
  times.forEach((utime, row) => {
    if (utime >= from) rows.push(columns.map((column) => column[row]!));
  });
  return rows;
}

const yawOf = ([w, x, y, z]: number[]) =>
  Math.atan2(2 * (w! * z! + x! * y!), 1 - 2 * (y! ** 2 + z! ** 2));
