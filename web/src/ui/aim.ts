// Clicks on the scene by keyboard: while a tool waits for one and the view has the focus, arrows
// move a cross over it, and Enter clicks there.
import type { Page, Tool } from "../state/page";
import { h } from "../widgets/elements";

const kStep_px = 16,
  kFine_px = 2; // with Shift
const kWays: Record<string, [x: number, y: number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

export interface AimActions {
  click(x: number, y: number, further: boolean): void;
  look(x: number, y: number): void; // what is there
}

export class Aim {
  private readonly cross = h("div", { class: "cross", hidden: true, "aria-hidden": "true" });
  private at: [x: number, y: number] | null = null; // shares of the view

  constructor(
    view: HTMLElement,
    private readonly canvas: HTMLElement,
    private readonly page: Page,
    private readonly actions: AimActions,
  ) {
    view.append(this.cross);
    // Before the keys that drive
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("pointerdown", () => this.move(null));
    canvas.addEventListener("blur", () => this.move(null));
    page.watch(["tool"], () => this.move(null));
  }

  private key(event: KeyboardEvent): void {
    const way = kWays[event.key];
    if (!waitsForClick(this.page.now.tool) || (!way && event.key !== "Enter")) return;
    event.preventDefault();
    event.stopPropagation();
    const { left, top, width, height } = this.canvas.getBoundingClientRect(),
      [x, y] = this.at ?? [0.5, 0.5];
    if (way) {
      const step = event.shiftKey ? kFine_px : kStep_px;
      this.move([x + (way[0] * step) / width, y + (way[1] * step) / height]);
    } else {
      this.move([x, y]);
      this.actions.click(left + x * width, top + y * height, event.shiftKey);
    }
  }

  private move(to: [number, number] | null): void {
    const inside = (share: number) => Math.max(0, Math.min(1, share));
    this.at = to && [inside(to[0]), inside(to[1])];
    this.cross.hidden = !this.at;
    if (!this.at) return;
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    Object.assign(this.cross.style, { left: `${100 * this.at[0]}%`, top: `${100 * this.at[1]}%` });
    this.actions.look(left + this.at[0] * width, top + this.at[1] * height);
  }
}

const waitsForClick = (tool: Tool) =>
  typeof tool !== "string" || tool === "go" || ["measure", "door", "wall", "room"].includes(tool);
