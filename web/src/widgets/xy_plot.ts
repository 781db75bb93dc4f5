// Curves of y over x.
import { h } from "./elements";
import { drawable, ticksText } from "./plots";

const kHeight_px = 260,
  kMargin_px = { left: 48, right: 10, top: 18, bottom: 38 };
const css = (name: string) =>
  getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export interface Curve {
  label: string;
  colour: string; // a CSS variable
  dash?: number[];
}
interface Box {
  x: [number, number];
  y: [number, number];
}

// 1, 2 or 5 times a power of ten, so that there are at most so many ticks.
export function tickStep(span: number, most: number): number {
  const least = span / most,
    power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((n) => n * power).find((step) => step >= least * (1 - 1e-9))!;
}

// The ranges shown in a field of this size in pixels: all points with a margin; with equal
// scales, if requested.
export function boxAround(
  points: Iterable<readonly [number, number]>,
  [width, height]: [number, number],
  equal: boolean,
): Box {
  const low = [Infinity, Infinity],
    high = [-Infinity, -Infinity];
  for (const point of points)
    point.forEach((value, i) => {
      low[i] = Math.min(low[i]!, value);
      high[i] = Math.max(high[i]!, value);
    });
  const half = [0, 1].map((i) =>
      high[i]! >= low[i]!
        ? Math.max(
            0.05,
            0.55 * (high[i]! - low[i]!),
            1e-6 * Math.max(Math.abs(low[i]!), Math.abs(high[i]!)),
          )
        : 0.5,
    ),
    centre = [0, 1].map((i) => (high[i]! >= low[i]! ? (high[i]! + low[i]!) / 2 : 0));
  if (equal) {
    const metre_px = Math.min(width / half[0]!, height / half[1]!);
    [half[0], half[1]] = [width / metre_px, height / metre_px];
  }
  const side = (i: number): [number, number] => [centre[i]! - half[i]!, centre[i]! + half[i]!];
  return { x: side(0), y: side(1) };
}

export class XYPlot {
  readonly element: HTMLElement;
  private readonly canvas = h("canvas", { class: "xy", role: "img" });
  private points: [x: number, y: number, time_s: number][][];
  private dirty = true;

  // window_s: of the points that are kept, before the newest one.
  constructor(
    title: string,
    private readonly units: [x: string, y: string],
    private readonly curves: Curve[],
    private readonly equal: boolean,
    private readonly window_s = Infinity,
  ) {
    this.points = curves.map(() => []);
    this.canvas.setAttribute("aria-label", `${title || "curves"}: ${units[1]} over ${units[0]}`);
    this.element = h(
      "div",
      { class: "plot" },
      title && h("div", { class: "u-title" }, title),
      this.canvas,
      h(
        "div",
        { class: "xy-legend" },
        ...curves.map(({ label, colour }) =>
          h("span", { style: `--colour: var(${colour})` }, h("i"), label),
        ),
      ),
    );
    new ResizeObserver(() => this.restyle()).observe(this.canvas);
  }

  // Points that cannot be drawn are left out.
  add(curve: number, time_s: number, x: number, y: number): void {
    const points = this.points[curve]!;
    if (points.length > 0 && time_s <= points.at(-1)![2]) return; // it is here already
    if (drawable(x) === null || drawable(y) === null) return;
    points.push([x, y, time_s]);
    const first = points.findIndex(([, , t]) => t >= time_s - this.window_s);
    if (first > 64) points.splice(0, first);
    this.dirty = true;
  }

  // Of the newest point; -Infinity without one.
  get newest_s(): number {
    return Math.max(...this.points.map((points) => points.at(-1)?.[2] ?? -Infinity));
  }

  clear(): void {
    this.points = this.curves.map(() => []);
    this.dirty = true;
  }
  restyle(): void {
    this.dirty = true;
  }

  draw(): void {
    const { canvas } = this,
      width = canvas.clientWidth,
      ratio = Math.min(2, devicePixelRatio);
    if (!this.dirty || width === 0) return;
    this.dirty = false;
    Object.assign(canvas, { width: width * ratio, height: kHeight_px * ratio });
    const pen = canvas.getContext("2d")!,
      { left, right, top, bottom } = kMargin_px,
      [w, h] = [width - left - right, kHeight_px - top - bottom],
      box = boxAround(
        this.points.flat().map(([x, y]) => [x, y] as const),
        [w, h],
        this.equal,
      );
    pen.scale(ratio, ratio);
    const px = (x: number) => left + (w * (x - box.x[0])) / (box.x[1] - box.x[0]),
      py = (y: number) => top + (h * (box.y[1] - y)) / (box.y[1] - box.y[0]);
    this.drawGrid(pen, box, px, py, [w, h]);
    pen.lineWidth = 1.6;
    this.points.forEach((points, i) => {
      pen.strokeStyle = css(this.curves[i]!.colour);
      pen.setLineDash(this.curves[i]!.dash ?? []);
      pen.beginPath();
      for (const [x, y] of points) pen.lineTo(px(x), py(y));
      pen.stroke();
    });
  }

  private drawGrid(
    pen: CanvasRenderingContext2D,
    { x, y }: Box,
    px: (x: number) => number,
    py: (y: number) => number,
    [w, h]: [number, number],
  ): void {
    const { left, top } = kMargin_px;
    Object.assign(pen, { strokeStyle: css("--line"), fillStyle: css("--dim"), lineWidth: 1 });
    pen.font = "11px system-ui";
    const ticks = (
      [low, high]: [number, number],
      most: number,
      draw: (at: number, text: string) => void,
    ) => {
      const step = tickStep(high - low, most),
        first = Math.ceil(low / step),
        places = Array.from(
          { length: Math.floor(high / step) - first + 1 },
          (_, i) => (first + i) * step,
        );
      ticksText(places).forEach((text, i) => draw(places[i]!, text));
    };
    pen.beginPath();
    pen.textAlign = "center";
    ticks(x, Math.max(2, w / 70), (at, text) => {
      pen.moveTo(px(at), top);
      pen.lineTo(px(at), top + h);
      pen.fillText(text, px(at), top + h + 14);
    });
    pen.textAlign = "right";
    ticks(y, Math.max(2, h / 40), (at, text) => {
      pen.moveTo(left, py(at));
      pen.lineTo(left + w, py(at));
      pen.fillText(text, left - 5, py(at) + 4);
    });
    pen.stroke();
    pen.textAlign = "left";
    pen.fillText(this.units[1], 2, top - 6);
    pen.textAlign = "right";
    pen.fillText(this.units[0], left + w, top + h + 30);
  }
}
