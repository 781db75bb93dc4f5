// Drawing walls and rooms by dragging, or by one click where they begin and one where they end (as
// keys click), on the floor where they begin.
import * as THREE from "three";
import { kOnTop, putOnTop } from "../scene/on_top";
import type { Picker } from "../scene/picker";
import type { Stage } from "../scene/stage";
import type { Page } from "../state/page";
import type { Editor } from "./editor";
import { roomModel, wallModel, type WallStyle } from "./sdf";

const kShortest_m = 0.2;
type Place = Pick<PointerEvent, "clientX" | "clientY">; // of the page
type Point = { x: number; y: number; z: number };

export class Draw {
  style: WallStyle = { height: 1.2, thickness: 0.1 };
  onLength: (words: string) => void = () => undefined; // the dimensions of what is being drawn
  private from: Point | null = null;
  private picker: Picker; // of the view in which it was begun
  private to: Point = { x: 0, y: 0, z: 0 };
  private readonly ghost = new THREE.LineSegments(
    new THREE.EdgesGeometry(new THREE.BoxGeometry(1, 1, 1)),
    new THREE.LineBasicMaterial({ color: 0x35c2ad, ...kOnTop }),
  );

  constructor(
    private readonly page: Page,
    private readonly stage: Stage,
    private readonly editor: Editor,
  ) {
    this.picker = stage.picker;
    this.ghost.visible = false;
    putOnTop(this.ghost);
    stage.scene.add(this.ghost);
    page.watch(["tool"], () => {
      this.cancel();
    });
  }

  // Drags over that canvas draw; its camera rests meanwhile.
  listen(canvas: HTMLCanvasElement, picker: Picker, controls: { enabled: boolean }): void {
    this.page.watch(["tool"], () => (controls.enabled = !this.drawing));
    canvas.addEventListener("pointerdown", (event) => {
      if (this.drawing && event.button === 0) this.begin(canvas, picker, event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.from) this.drag(event);
    });
    canvas.addEventListener("pointerup", () => void this.finish());
    canvas.addEventListener("pointercancel", () => this.cancel());
  }

  get drawing(): boolean {
    return this.page.now.tool === "wall" || this.page.now.tool === "room";
  }

  // Begins at a point of the page, or ends there.
  click(x: number, y: number): void {
    if (this.from) {
      this.drag({ clientX: x, clientY: y });
      void this.finish();
    } else this.beginAt(this.stage.picker, { clientX: x, clientY: y });
  }
  // The drawing if the pointer ends at this point of the page.
  look(x: number, y: number): void {
    if (this.from) this.drag({ clientX: x, clientY: y });
  }

  cancel(): void {
    this.from = null;
    this.ghost.visible = false;
    this.onLength("");
    this.stage.touch();
  }

  // A point at the height where the drag began; at its begin, one that is seen.
  private point({ clientX, clientY }: Place): Point | null {
    const { picker } = this,
      point = this.from
        ? picker.level(clientX, clientY, this.from.z)
        : picker.point(clientX, clientY),
      snap = this.page.now.snap_m;
    if (!point) return null;
    const near = (value: number) => (snap > 0 ? Math.round(value / snap) * snap : value);
    return { x: near(point.x), y: near(point.y), z: Number(point.z.toFixed(3)) };
  }

  private begin(canvas: HTMLCanvasElement, picker: Picker, event: PointerEvent): void {
    this.beginAt(picker, event);
    canvas.setPointerCapture(event.pointerId);
  }

  private beginAt(picker: Picker, place: Place): void {
    this.picker = picker;
    this.from = this.point(place);
    if (this.from) this.to = this.from;
  }

  private drag(place: Place): void {
    const point = this.point(place);
    if (!point || !this.from) return;
    this.to = point;
    const { from, to } = this,
      { height, thickness } = this.style,
      dx = to.x - from.x,
      dy = to.y - from.y,
      room = this.page.now.tool === "room";
    const length = Math.hypot(dx, dy);
    this.onLength(
      room
        ? `${Math.abs(dx).toFixed(2)} × ${Math.abs(dy).toFixed(2)} m`
        : `${length.toFixed(2)} m, ${((Math.atan2(dy, dx) * 180) / Math.PI).toFixed(0)}°`,
    );
    this.ghost.visible = true;
    this.ghost.position.set((from.x + to.x) / 2, (from.y + to.y) / 2, from.z + height / 2);
    this.ghost.rotation.z = room ? 0 : Math.atan2(dy, dx);
    this.ghost.scale.set(
      Math.max(0.01, room ? Math.abs(dx) : length),
      Math.max(thickness, room ? Math.abs(dy) : 0),
      height,
    );
    this.stage.touch();
  }

  private async finish(): Promise<void> {
    const { from, to } = this;
    if (!from) return;
    const { tool } = this.page.now,
      dx = to.x - from.x,
      dy = to.y - from.y,
      x = (from.x + to.x) / 2,
      y = (from.y + to.y) / 2;
    this.cancel();
    if (tool === "wall" && Math.hypot(dx, dy) >= kShortest_m) {
      const half = Math.atan2(dy, dx) / 2;
      await this.editor.add(
        { name: "wall", model: "", text: wallModel("wall", Math.hypot(dx, dy), this.style) },
        [x, y, from.z, Math.cos(half), 0, 0, Math.sin(half)],
        false,
      );
    } else if (tool === "room" && Math.min(Math.abs(dx), Math.abs(dy)) >= kShortest_m) {
      await this.editor.add(
        {
          name: "room",
          model: "",
          text: roomModel("room", Math.abs(dx), Math.abs(dy), this.style),
        },
        [x, y, from.z, 1, 0, 0, 0],
        false,
      );
    }
  }
}
