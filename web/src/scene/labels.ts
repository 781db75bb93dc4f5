// Names over robots and models, as text over the view.
import * as THREE from "three";
import type { Page } from "../state/page";
import { h } from "../widgets/elements";
import type { Stage } from "./stage";

const kMost = 60; // the nearest
const kOver_m = 0.15; // above the top of the named thing

interface Label {
  element: HTMLElement;
  model: number;
  above: number; // m, above the model's frame
}

export class Labels {
  private readonly place = h("div", { class: "labels", "aria-hidden": "true" });
  private labels: Label[] = [];
  private isMade = false;
  private readonly at = new THREE.Vector3();
  private readonly matrix = new THREE.Matrix4();

  constructor(
    view: HTMLElement,
    private readonly page: Page,
    private readonly stage: Stage,
  ) {
    view.append(this.place);
    page.watch(["scene", "layers"], () => {
      this.isMade = false;
    });
  }

  // Poses of moving things are known from the first state on.
  private get isReady(): boolean {
    const models = this.page.now.scene?.models ?? [];
    return this.stage.poses.size > 0 || models.every(({ body }) => body < 0);
  }

  private make(): void {
    const { scene, layers } = this.page.now;
    this.labels = [];
    this.isMade = true;
    if (scene && layers.has("labels")) {
      scene.models.forEach((model, index) => {
        const box = model.name ? this.stage.bodies.boxOf(model) : null;
        if (!box || box.isEmpty() || this.labels.length >= kMost) return;
        this.stage.bodies.modelAt(model, this.matrix);
        const above = box.max.z - this.matrix.elements[14]! + kOver_m;
        this.labels.push({ element: h("span", {}, model.name), model: index, above });
      });
    }
    this.place.replaceChildren(...this.labels.map(({ element }) => element));
  }

  // Once a frame.
  follow(): void {
    if (!this.isMade && this.isReady) this.make();
    const { clientWidth: width, clientHeight: height } = this.place,
      { scene } = this.page.now;
    for (const { element, model, above } of scene && this.isMade ? this.labels : []) {
      this.stage.bodies.modelAt(scene!.models[model]!, this.matrix);
      this.at.setFromMatrixPosition(this.matrix);
      this.at.z += above;
      this.at.project(this.stage.view.camera);
      element.hidden = this.at.z > 1 || Math.abs(this.at.x) > 1 || Math.abs(this.at.y) > 1;
      const x = ((this.at.x + 1) / 2) * width,
        y = ((1 - this.at.y) / 2) * height;
      element.style.transform = `translate(-50%, -100%) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }
}
