// Clicks on the scene: choose, select, send a robot, place a thing, or make a door.
import * as THREE from "three";
import { matrixOf } from "../scene/matrix";
import type { Picker } from "../scene/picker";
import type { Page } from "../state/page";
import { toast } from "../widgets/elements";
import type { Editor } from "./editor";
import type { Door } from "./sdf";

const kClick_px = 5; // the pointer may move this far in a click

export interface ClickActions {
  isBusy(): boolean; // a click means nothing here
  measured(point: THREE.Vector3): void;
  sent(point: THREE.Vector3, further: boolean): void;
}

export class Clicks {
  constructor(
    private readonly page: Page,
    private readonly editor: Editor,
    private readonly door: Door,
    private readonly actions: ClickActions,
  ) {}

  // To the clicks on a view's canvas.
  listen(canvas: HTMLElement, picker: Picker): void {
    let down = { x: 0, y: 0 },
      taken = false;
    canvas.addEventListener("pointerdown", (event) => {
      down = { x: event.clientX, y: event.clientY };
      taken = this.actions.isBusy();
    });
    canvas.addEventListener("pointerup", ({ button, clientX, clientY, shiftKey }) => {
      const moved_px = Math.hypot(clientX - down.x, clientY - down.y);
      if (button === 0 && !taken && moved_px <= kClick_px)
        this.click(clientX, clientY, shiftKey, picker);
    });
  }

  // At a point of the page; further: in addition to earlier points.
  click(x: number, y: number, further: boolean, picker: Picker): void {
    const { page, editor, door, actions } = this,
      { tool } = page.now,
      picked = picker.pick(x, y);
    if (tool === "wall" || tool === "room") return;
    if (tool === "measure") {
      if (picked.point) actions.measured(picked.point);
      return;
    }
    if (tool === "go") {
      if (picked.point) actions.sent(picked.point, further);
      return;
    }
    if (tool === "door") return makeDoor(picked.model, picked.point, editor, door);
    if (tool !== "select") {
      if (!picked.point) return;
      page.set({ tool: "select" });
      void editor.add(tool, [...picked.point.toArray(), 1, 0, 0, 0], true).then((good) => {
        if (good) toast("Placed.");
      });
      return;
    }
    if (page.now.shown.has("World") && page.now.controlled && page.now.hello?.mode === "live")
      page.set({ selected: picked.model });
    const robot =
      page.now.world?.robots.findIndex(
        ({ name }) => name === page.now.scene?.bases[picked.robot]?.robot,
      ) ?? -1;
    if (robot >= 0) page.set({ robot });
  }
}

// A door takes the full thickness of its wall; only the position along the wall matters.
function makeDoor(name: string, point: THREE.Vector3 | null, editor: Editor, door: Door): void {
  const pose = editor.pose(name);
  if (!name || !point || !pose) return toast("There is no wall here.", "error");
  const at = point.clone().applyMatrix4(matrixOf(pose, 0, new THREE.Matrix4()).invert());
  void editor.door(name, [at.x, at.y], door);
}
