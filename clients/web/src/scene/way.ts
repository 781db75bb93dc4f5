// The way that a robot has been sent, on the floor.
import * as THREE from "three";
import type { Planar } from "../state/go_to";
import type { Stage } from "./stage";

const kAbove_m = 0.03;

export class Way {
  private readonly line = new THREE.Line(new THREE.BufferGeometry(), kPaint);
  private readonly ends = new THREE.Points(
    new THREE.BufferGeometry(),
    new THREE.PointsMaterial({
      color: kColour,
      size: 10,
      sizeAttenuation: false,
      depthTest: false,
      toneMapped: false,
      fog: false,
    }),
  );

  constructor(private readonly stage: Stage) {
    for (const object of [this.line, this.ends]) {
      object.visible = false;
      object.frustumCulled = false;
      stage.scene.add(object);
    }
  }

  // from: the robot.
  show(from: Planar | null, points: readonly Planar[]): void {
    const at = ({ x, y }: Planar) => new THREE.Vector3(x, y, kAbove_m);
    this.line.visible = this.ends.visible = points.length > 0;
    if (points.length > 0) {
      this.line.geometry.setFromPoints([...(from ? [from] : []), ...points].map(at));
      this.ends.geometry.setFromPoints(points.map(at));
    }
    this.stage.touch();
  }
}

const kColour = 0x35c2ad,
  kPaint = new THREE.LineBasicMaterial({
    color: kColour,
    depthTest: false,
    toneMapped: false,
    fog: false,
  });
