// The coordinates under the pointer, and the distance between two clicked points.
import * as THREE from "three";
import type { Page } from "../state/page";
import { h, say } from "../widgets/elements";
import type { Stage } from "./stage";

const kLook_ms = 60; // between two looks at what is under the pointer
const number = (value: number) => value.toFixed(2);

export class Measure {
  readonly readout = h("div", { class: "readout", id: "coordinates" });
  private from: THREE.Vector3 | null = null;
  private words = "";
  private looked_ms = 0;
  private readonly line = new THREE.Line(
    new THREE.BufferGeometry(),
    new THREE.LineBasicMaterial({
      color: 0xffd24a,
      depthTest: false,
      toneMapped: false,
      fog: false,
    }),
  );

  constructor(
    private readonly page: Page,
    private readonly stage: Stage,
    canvas: HTMLElement,
  ) {
    this.line.visible = false;
    this.line.frustumCulled = false;
    stage.scene.add(this.line);
    canvas.addEventListener("pointermove", (event) => this.look(event));
    canvas.addEventListener("pointerleave", () => say(this.readout, this.words));
    page.watch(["tool"], ({ tool }) => {
      this.from = null;
      if (tool === "measure") return;
      this.words = "";
      this.line.visible = false;
      stage.touch();
    });
  }

  // Adds a point: the first one, then the second.
  click(point: THREE.Vector3): void {
    if (!this.from) {
      this.from = point.clone();
      this.draw(point);
      return;
    }
    this.draw(point);
    this.from = null;
  }

  private draw(to: THREE.Vector3): void {
    const { from } = this;
    if (!from) return;
    this.line.geometry.setFromPoints([from, to]);
    this.line.visible = true;
    const level = Math.hypot(to.x - from.x, to.y - from.y);
    this.words = `${number(from.distanceTo(to))} m (level ${number(level)}, up ${number(to.z - from.z)})`;
    say(this.readout, this.words);
    this.stage.touch();
  }

  private look(event: PointerEvent): void {
    if (event.buttons !== 0 || event.timeStamp - this.looked_ms < kLook_ms) return;
    this.looked_ms = event.timeStamp;
    const measuring = this.page.now.tool === "measure";
    const point = measuring
      ? this.stage.picker.point(event.clientX, event.clientY)
      : this.stage.picker.ground(event.clientX, event.clientY);
    if (point && this.from) this.draw(point);
    else if (point && !this.words) say(this.readout, `${number(point.x)}, ${number(point.y)} m`);
  }
}
