// The coordinates under the pointer, and the distance between two clicked points.
import * as THREE from "three";
import type { Page } from "../state/page";
import { h, say } from "../widgets/elements";
import { kOnTop, putOnTop } from "./on_top";
import type { Picker } from "./picker";
import type { Stage } from "./stage";

const kLook_ms = 60, // between two looks at what is under the pointer
  kLookShare = 0.2; // of the time that looks may take at most
const kLevel_m = 0.005; // of a height that is not shown
const number = (value: number) => value.toFixed(2);
const placeWords = ({ x, y, z }: THREE.Vector3) =>
  [x, y, ...(Math.abs(z) < kLevel_m ? [] : [z])].map(number).join(", ") + " m";

export class Measure {
  readonly readout = h("div", { class: "readout", id: "coordinates" });
  private from: THREE.Vector3 | null = null;
  private words = "";
  private nextLook_ms = 0;
  private readonly line = new THREE.Line(
    new THREE.BufferGeometry(),
    new THREE.LineBasicMaterial({ color: 0xffd24a, ...kOnTop }),
  );

  constructor(
    page: Page,
    private readonly stage: Stage,
  ) {
    this.line.visible = false;
    putOnTop(this.line);
    stage.scene.add(this.line);
    page.watch(["tool"], ({ tool }) => {
      this.from = null;
      if (tool === "measure") return;
      this.words = "";
      this.line.visible = false;
      stage.touch();
    });
  }

  // Tells what is under the pointer of that canvas.
  listen(canvas: HTMLElement, picker: Picker): void {
    canvas.addEventListener("pointermove", ({ buttons, clientX, clientY }) => {
      if (buttons === 0) this.look(clientX, clientY, picker);
    });
    canvas.addEventListener("pointerleave", () => say(this.readout, this.words));
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

  // Tells what is under that point of the page.
  look(x: number, y: number, picker: Picker): void {
    const begun_ms = performance.now();
    if (begun_ms < this.nextLook_ms) return;
    const point = picker.point(x, y),
      end_ms = performance.now();
    this.nextLook_ms = end_ms + Math.max(kLook_ms, (end_ms - begun_ms) / kLookShare);
    if (point && this.from) this.draw(point);
    else if (point && !this.words) say(this.readout, placeWords(point));
  }
}
