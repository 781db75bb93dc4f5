// The path that a robot has been sent along, on the floor.
import * as THREE from "three";
import type { Planar } from "../state/go_to";
import { kOnTop, putOnTop } from "./on_top";
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
      ...kOnTop,
    }),
  );

  constructor(private readonly stage: Stage) {
    for (const object of [this.line, this.ends]) {
      object.visible = false;
      putOnTop(object);
      stage.scene.add(object);
    }
  }

  // from: the robot's position.
  show(from: Planar | null, points: readonly Planar[]): void {
    const at = ({ x, y, z }: Planar) => new THREE.Vector3(x, y, (z ?? 0) + kAbove_m);
    this.line.visible = this.ends.visible = points.length > 0;
    if (points.length > 0) {
      draw(this.line, [...(from ? [from] : []), ...points].map(at));
      draw(this.ends, points.map(at));
    }
    this.stage.touch();
  }
}

const kColour = 0x35c2ad,
  kPaint = new THREE.LineBasicMaterial({ color: kColour, ...kOnTop });

// A geometry keeps the number of its first points.
function draw(object: THREE.Line | THREE.Points, points: THREE.Vector3[]): void {
  object.geometry.dispose();
  object.geometry = new THREE.BufferGeometry().setFromPoints(points);
}
