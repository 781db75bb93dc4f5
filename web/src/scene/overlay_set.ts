// The overlays of the robots whose sensors are drawn, and the ring around the chosen one.
import * as THREE from "three";
import { displayFor } from "../state/display";
import { shownRobots, type Page } from "../state/page";
import { RobotOverlay } from "./overlays";
import type { Stage } from "./stage";

export class OverlaySet {
  readonly of = new Map<string, RobotOverlay>(); // by the robot's name
  private readonly marker: THREE.Mesh;
  private readonly base = new THREE.Matrix4();

  constructor(
    private readonly page: Page,
    private readonly stage: Stage,
  ) {
    this.marker = new THREE.Mesh(
      new THREE.RingGeometry(0.38, 0.44, 48),
      new THREE.MeshBasicMaterial({
        color: 0x35c2ad,
        transparent: true,
        opacity: 0.9,
        depthWrite: false,
        toneMapped: false,
      }),
    );
    this.marker.visible = false;
    stage.scene.add(this.marker);
    page.watch(["world", "scene", "robot"], () => this.make());
    page.watch(["layers"], () => stage.touch());
    page.watch(["displays"], () => {
      this.style();
      stage.touch();
    });
  }

  // An overlay and its trails last as long as their robot.
  private make(): void {
    const { world, scene } = this.page.now,
      before = new Map(this.of);
    this.of.clear();
    for (const name of shownRobots(this.page.now)) {
      const start = scene
        ? scene.bases.find(({ robot }) => robot === name)?.start
        : [0, 0, 0, 1, 0, 0, 0];
      if (!start) continue; // it has just been added and is not in the scene yet
      const devices = world!.devices.filter((device) => device.robot === name);
      const key = [
        ...start,
        ...devices.flatMap((d) => [d.name, d.kind, ...d.position, ...d.orientation]),
      ].join();
      const old = before.get(name),
        overlay = old?.key === key ? old : new RobotOverlay(devices, start, key);
      if (overlay !== old) this.stage.scene.add(overlay.group);
      else before.delete(name);
      this.of.set(name, overlay);
    }
    this.style();
    for (const overlay of before.values()) {
      this.stage.scene.remove(overlay.group);
      overlay.dispose();
    }
    this.stage.touch();
  }

  private style(): void {
    for (const [name, overlay] of this.of)
      overlay.style((layer) => displayFor(this.page.now.displays, layer, name), this.of.size);
  }

  // Moves them with the robots; true if there is something to draw.
  place(): boolean {
    const { world, scene, robot, layers } = this.page.now,
      chosen = world?.robots[robot]?.name;
    let changed = false;
    for (const [name, overlay] of this.of) {
      if (
        !this.stage.bodies.base(
          scene?.bases.findIndex((base) => base.robot === name) ?? -1,
          this.base,
        )
      )
        continue;
      changed = overlay.place(this.base, layers) || changed;
      if (name !== chosen) continue;
      this.marker.visible = world!.robots.length > 1;
      this.marker.position.setFromMatrixPosition(this.base);
      this.marker.position.z += 0.015;
    }
    return changed;
  }

  forget(): void {
    for (const overlay of this.of.values()) overlay.forget();
  }
}
