// The box around the selected model.
import * as THREE from "three";
import type { Stage } from "../scene/stage";
import type { Page } from "../state/page";
import type { Editor } from "./editor";

export class Outline {
  private readonly box = new THREE.Box3();
  private readonly helper = new THREE.Box3Helper(this.box, new THREE.Color(0x35c2ad));

  constructor(
    private readonly page: Page,
    private readonly stage: Stage,
    private readonly editor: Editor,
  ) {
    this.helper.visible = false;
    (this.helper.material as THREE.LineBasicMaterial).toneMapped = false;
    stage.scene.add(this.helper);
    page.watch(["selected", "shown"], () => stage.touch());
  }

  follow(): void {
    const { selected, shown } = this.page.now,
      model = shown.has("World") ? this.editor.find(selected) : undefined;
    if (model) this.box.copy(this.stage.bodies.boxOf(model));
    this.helper.visible = model !== undefined && !this.box.isEmpty();
  }
}
