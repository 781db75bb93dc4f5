// Editing the world: the editor, and the handles and lines in the view.
import { Draw } from "../edit/draw";
import { Editor } from "../edit/editor";
import { Gizmo } from "../edit/gizmo";
import { listenToEditing } from "../edit/keys";
import { Outline } from "../edit/outline";
import type { Model } from "./model";
import type { SceneView } from "./scene_view";

export class Editing {
  readonly editor: Editor;
  readonly gizmo: Gizmo;
  readonly draw: Draw;
  private readonly outline: Outline;

  constructor(model: Model, { stage, canvas }: SceneView) {
    const { page } = model;
    this.editor = new Editor(page, model.poses, model.control, (of) => stage.bodies.boxOf(of));
    this.gizmo = new Gizmo(page, stage, this.editor, canvas);
    this.outline = new Outline(page, stage, this.editor);
    this.draw = new Draw(page, stage, this.editor);
    listenToEditing(page, this.editor);
    model.onForget((reset) => {
      if (reset) this.editor.history.clear();
    });
  }

  // Once a frame.
  frame(): void {
    this.gizmo.follow();
    this.outline.follow();
  }
}
