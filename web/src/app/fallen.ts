// Reports robots that have left the world, each once: below everything in it, or with a pose that
// is not finite.
import type { Poses } from "../state/poses";
import type { Page } from "../state/page";
import { toast } from "../widgets/elements";

const kLook_ms = 1000,
  kBelow_m = 20; // below the lowest thing

export class Fallen {
  private readonly told = new Set<string>();
  private looked_ms = 0;

  constructor(
    private readonly page: Page,
    private readonly poses: Poses,
  ) {
    page.watch(["hello"], () => this.told.clear());
  }

  // After a reset, for one.
  forget(): void {
    this.told.clear();
  }

  // Once a frame.
  look(at_ms: number): void {
    const { scene } = this.page.now;
    if (!scene || at_ms - this.looked_ms < kLook_ms) return;
    this.looked_ms = at_ms;
    for (const { robot, body } of scene.bases) {
      if (body < 0 || !this.poses.known[body] || this.told.has(robot)) continue;
      const z = this.poses.to[7 * body + 2]!;
      if (z > Math.min(scene.low[2]!, scene.floor) - kBelow_m) continue;
      this.told.add(robot);
      const place = Number.isFinite(z) ? `at a height of ${metres(z)}` : "nowhere";
      toast(
        `${robot} has fallen out of the world: it is ${place}. Reset the run, or move it.`,
        "error",
      );
    }
  }
}

const metres = (z: number) => (z < -10_000 ? `${(z / 1000).toFixed(0)} km` : `${z.toFixed(0)} m`);
