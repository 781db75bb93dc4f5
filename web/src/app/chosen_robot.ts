// The chosen robot: followed by the camera, shown in the panel, and sent to clicked points.
import type { robot_info_t } from "../../generated/messages";
import { GoTo, kReasons, type PlanarPose } from "../state/go_to";
import { toggleGoing } from "../state/choices";
import type { RobotPages } from "../ui/robot";
import { toast } from "../widgets/elements";
import type { Model } from "./model";
import type { SceneView } from "./scene_view";

export class ChosenRobot {
  readonly trip: GoTo;
  private shown = ""; // run and name of the robot in the panel

  constructor(
    private readonly model: Model,
    private readonly scene: SceneView,
    private readonly pages: RobotPages,
  ) {
    this.trip = new GoTo({
      pose: () => this.pose(),
      move: (command) => model.control.move(command),
      failed: (reason) => toast(`It does not get there: ${kReasons[reason] ?? reason}.`, "error"),
      changed: () => {
        scene.way.show(this.pose(), this.trip.points());
        model.wanted.update();
      },
    });
    pages.onMotion = (status) => this.trip.heard(status);
    pages.goButton.addEventListener("click", () => toggleGoing(model.page));
    model.wanted.add(() => (this.trip.points().length > 0 ? this.motionChannels() : []));
    model.onForget((reset) => {
      if (reset) this.trip.forget();
    });
    model.page.watch(["world", "scene", "robot"], () => this.show());
  }

  private get robot(): robot_info_t | undefined {
    const { world, robot } = this.model.page.now;
    return world?.robots[robot];
  }

  // Its index in the scene; -1 if the scene does not have it.
  private get base(): number {
    const name = this.robot?.name;
    return this.model.page.now.scene?.bases.findIndex((base) => base.robot === name) ?? -1;
  }

  private pose(): PlanarPose | null {
    return this.scene.stage.bodies.planar(this.base);
  }

  private motionChannels(): string[] {
    const name = this.robot?.name;
    return (this.model.page.now.world?.channels ?? [])
      .filter((channel) => channel.robot === name && channel.type === "motion_status_t")
      .map((channel) => channel.name);
  }

  private show(): void {
    const { world, scene } = this.model.page.now,
      { robot, base } = this;
    if (!world || !robot) return;
    this.scene.stage.view.follow(base);
    this.pages.beginAt(scene ? scene.bases[base]?.start : [0, 0, 0, 1, 0, 0, 0]);
    const key = `${world.runId} ${robot.name}`;
    if (key === this.shown) return;
    this.shown = key;
    this.trip.forget();
    this.pages.show(
      robot,
      world.devices.filter((device) => device.robot === robot.name),
    );
  }
}
