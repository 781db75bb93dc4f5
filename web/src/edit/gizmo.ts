// The handles at the selected model: while they are dragged only the view changes; when they are
// released, the world does.
import * as THREE from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import { matrixOf } from "../scene/matrix";
import type { Stage } from "../scene/stage";
import type { Page } from "../state/page";
import type { Editor } from "./editor";
import { poseOf } from "./pose";

const kTurnSnap_rad = Math.PI / 12,
  kScaleSnap = 0.1,
  kShortestAxis = 0.05;

export class Gizmo {
  private readonly controls: TransformControls;
  private readonly handle = new THREE.Object3D();
  private readonly begun = new THREE.Matrix4(); // of the handle, at the start of the drag

  constructor(
    private readonly page: Page,
    private readonly stage: Stage,
    private readonly editor: Editor,
    canvas: HTMLCanvasElement,
  ) {
    this.controls = new TransformControls(stage.view.camera, canvas);
    this.controls.size = 0.8;
    stage.scene.add(this.handle, this.controls.getHelper());
    this.controls.addEventListener("change", () => stage.touch());
    this.controls.addEventListener("dragging-changed", ({ value }) => {
      stage.view.controls.enabled = !value;
    });
    this.controls.addEventListener("mouseDown", () => this.begun.copy(this.handle.matrix));
    this.controls.addEventListener("objectChange", () => this.preview());
    this.controls.addEventListener("mouseUp", () => void this.commit());
    page.watch(["selected", "scene", "tool", "shown", "controlled"], () => this.attach());
    page.watch(["handle"], ({ handle }) => {
      this.controls.setMode(handle);
      stage.touch();
    });
    page.watch(["snap_m"], ({ snap_m }) => {
      this.controls.setTranslationSnap(snap_m || null);
      this.controls.setRotationSnap(snap_m ? kTurnSnap_rad : null);
      this.controls.setScaleSnap(snap_m ? kScaleSnap : null);
    });
  }

  // Whether the pointer is on a handle, so that a click means nothing else.
  get seized(): boolean {
    return this.controls.axis !== null && this.controls.object !== undefined;
  }

  // Follows a model that moves by itself.
  follow(): void {
    if (this.controls.dragging || !this.controls.object) return;
    const pose = this.editor.pose(this.page.now.selected);
    if (!pose) return;
    matrixOf(pose, 0, kMatrix);
    kMatrix.decompose(this.handle.position, this.handle.quaternion, this.handle.scale);
    this.handle.updateMatrixWorld();
  }

  private attach(): void {
    const { selected, tool, shown, controlled, hello } = this.page.now,
      model = this.editor.find(selected);
    const wanted =
      model &&
      !model.path &&
      tool === "select" &&
      shown.has("World") &&
      controlled &&
      hello?.mode === "live";
    if (wanted) {
      this.controls.attach(this.handle);
      this.follow();
    } else if (!this.controls.dragging) this.controls.detach();
    this.stage.touch();
  }

  private preview(): void {
    const model = this.editor.find(this.page.now.selected);
    if (!model) return;
    this.handle.scale.clampScalar(kShortestAxis, 100);
    this.handle.updateMatrix();
    this.stage.preview(
      model,
      kMatrix.copy(this.handle.matrix).multiply(kInverse.copy(this.begun).invert()),
    );
  }

  private async commit(): Promise<void> {
    const { selected } = this.page.now,
      { x, y, z } = this.handle.scale;
    this.handle.updateMatrix();
    if (this.controls.getMode() === "scale") await this.editor.scale(selected, [x, y, z]);
    else await this.editor.move(selected, poseOf(this.handle.matrix));
    this.handle.scale.set(1, 1, 1);
    this.stage.preview(null, kMatrix.identity());
    this.follow();
  }
}

const kMatrix = new THREE.Matrix4(),
  kInverse = new THREE.Matrix4();
