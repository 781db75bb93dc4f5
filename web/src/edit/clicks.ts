// Clicks on the scene: choose, select, send a robot, place a thing, or make a door.
import * as THREE from "three";
import { matrixOf } from "../scene/matrix";
import type { Stage } from "../scene/stage";
import type { Page } from "../state/page";
import { toast } from "../widgets/elements";
import type { Editor } from "./editor";
import type { Door } from "./sdf";

const kClick_px = 5; // the pointer may move this far in a click

// Returns what clicks at a point of the page; further: in addition to earlier points.
export function listenToClicks(
  canvas: HTMLElement,
  page: Page,
  stage: Stage,
  editor: Editor,
  door: Door,
  busy: () => boolean,
  measured: (point: THREE.Vector3) => void,
  sent: (point: THREE.Vector3, further: boolean) => void,
): (x: number, y: number, further: boolean) => void {
  let down = { x: 0, y: 0 },
    taken = false;
  canvas.addEventListener("pointerdown", (event) => {
    down = { x: event.clientX, y: event.clientY };
    taken = busy();
  });
  canvas.addEventListener("pointerup", (event) => {
    if (
      event.button !== 0 ||
      taken ||
      Math.hypot(event.clientX - down.x, event.clientY - down.y) > kClick_px
    )
      return;
    click(event.clientX, event.clientY, event.shiftKey);
  });
  const click = (x: number, y: number, further: boolean) => {
    const { tool } = page.now,
      picked = stage.picker.pick(x, y);
    if (tool === "wall" || tool === "room") return;
    if (tool === "measure") {
      if (picked.point) measured(picked.point);
      return;
    }
    if (tool === "go") {
      if (picked.point) sent(picked.point, further);
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
  };
  return click;
}

// A door takes the full thickness of its wall; only the position along the wall matters.
function makeDoor(name: string, point: THREE.Vector3 | null, editor: Editor, door: Door): void {
  const pose = editor.pose(name);
  if (!name || !point || !pose) return toast("There is no wall here.", "error");
  const at = point.clone().applyMatrix4(matrixOf(pose, 0, new THREE.Matrix4()).invert());
  void editor.door(name, [at.x, at.y], door);
}
