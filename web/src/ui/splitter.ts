// The edge between view and panel: dragged, or moved by arrow keys; its place is remembered.
import { recall, remember } from "../state/memory";
import { h } from "../widgets/elements";

const kLeast_px = 280,
  kMostShare = 0.7, // of the page
  kUsual_px = 390,
  kStep_px = 20;

export class Splitter {
  private readonly element = h("div", {
    class: "splitter",
    id: "splitter",
    role: "separator",
    tabindex: 0,
    "aria-orientation": "vertical",
    "aria-label": "width of the panel",
    title: "drag, or arrow keys; double click: as at first",
  });
  private width = Number(recall("panel-width")) || kUsual_px;

  constructor(panel: HTMLElement) {
    panel.prepend(this.element);
    this.element.addEventListener("pointerdown", ({ pointerId }) =>
      this.element.setPointerCapture(pointerId),
    );
    this.element.addEventListener("pointermove", ({ pointerId, clientX }) => {
      if (this.element.hasPointerCapture(pointerId)) this.set(innerWidth - clientX);
    });
    this.element.addEventListener("dblclick", () => this.set(kUsual_px));
    this.element.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: 1, ArrowRight: -1 }[event.key];
      if (!way) return;
      event.preventDefault();
      event.stopPropagation(); // elsewhere arrows drive
      this.set(this.width + way * kStep_px);
    });
    addEventListener("resize", () => this.apply());
    this.apply();
  }

  private set(width: number): void {
    this.width = Math.round(Math.max(kLeast_px, Math.min(kMostShare * innerWidth, width)));
    remember("panel-width", String(this.width));
    this.apply();
  }

  private apply(): void {
    const most = Math.max(kLeast_px, Math.round(kMostShare * innerWidth)),
      width = Math.min(this.width, most);
    document.getElementById("app")!.style.setProperty("--panel-width", `${width}px`);
    for (const [name, value] of [
      ["min", kLeast_px],
      ["max", most],
      ["now", width],
    ] as const)
      this.element.setAttribute(`aria-value${name}`, String(value));
  }
}
