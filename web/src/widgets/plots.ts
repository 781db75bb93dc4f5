// Live plots of the chosen robot: velocity and odometry error over time, and ranges around the
// robot.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { planar_lidar_t, sonar_t, device_info_t } from "../../generated/messages";
import { h } from "./elements";

export const kWindow_s = 30;
const kLeast = 0.02; // m/s, rad/s or m: what is smaller is noise
const kLate_s = 0.5; // a longer step back restarts the plot
const css = (name: string) =>
  getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export interface SeriesDescription {
  label: string;
  colour: string;
  scale?: string;
  dash?: number[];
}

// Values over sim time, for the last half minute.
export class TimePlot {
  readonly element = h("div", { class: "plot" });
  private plot: uPlot | undefined;
  private data: (number | null)[][]; // null: nothing to draw there
  private dirty = false;

  constructor(
    private readonly title: string,
    private readonly unit: string,
    private readonly series: SeriesDescription[],
  ) {
    this.data = [[], ...series.map(() => [])];
    new ResizeObserver(() => this.build()).observe(this.element);
  }

  // Adds one value at that time; the other series keep their last one. A slightly late value
  // counts only if another series has one of its time.
  add(series: number, time_s: number, value: number): void {
    const times = this.times,
      drawn = drawable(value);
    const last_s = times.at(-1) ?? -Infinity;
    if (time_s < last_s - kLate_s) this.clear();
    else if (time_s <= last_s) {
      const at = times.lastIndexOf(time_s);
      if (at >= 0) this.data[series + 1]![at] = drawn;
    }
    if (times.length === 0 || time_s > last_s) {
      times.push(time_s);
      this.data
        .slice(1)
        .forEach((column, i) =>
          column.push(i === series ? drawn : (column[column.length - 1] ?? null)),
        );
    }
    const first = times.findIndex((t) => t >= time_s - kWindow_s);
    if (first > 64) for (const column of this.data) column.splice(0, first);
    this.dirty = true;
  }

  private get times(): number[] {
    return this.data[0] as number[];
  }

  clear(): void {
    for (const column of this.data) column.length = 0;
    this.dirty = true;
  }

  draw(): void {
    if (!this.dirty || this.element.clientWidth === 0) return;
    this.dirty = false;
    if (!this.plot) this.build();
    const end = this.times[this.times.length - 1] ?? 0;
    this.plot?.setData(this.data as uPlot.AlignedData, false);
    this.plot?.setScale("x", { min: Math.max(0, end - kWindow_s), max: Math.max(5, end) });
  }

  restyle(): void {
    this.build();
  }

  private build(): void {
    const width = this.element.clientWidth;
    if (width === 0) return;
    this.plot?.destroy();
    const axis = {
      stroke: css("--dim"),
      grid: { stroke: css("--line"), width: 1 },
      ticks: { stroke: css("--line"), width: 1 },
      font: "11px system-ui",
    };
    const wide = this.series.some((s) => s.scale);
    this.plot = new uPlot(
      {
        width,
        height: 190,
        title: this.title,
        cursor: { points: { size: 6 } },
        legend: { live: false },
        scales: {
          x: { time: false },
          y: { range: (_, low, high) => padded(low, high, kLeast) },
          w: { range: (_, low, high) => padded(low, high, kLeast) },
        },
        axes: [
          { ...axis, size: 32, values: (_, splits) => splits.map((s) => `${s} s`) },
          { ...axis, size: 46 },
          ...(wide
            ? [{ ...axis, scale: "w", side: 1 as const, size: 46, grid: { show: false } }]
            : []),
        ],
        series: [
          {},
          ...this.series.map((s) => ({
            label: `${s.label}`,
            stroke: css(s.colour),
            width: 1.6,
            scale: s.scale ?? "y",
            dash: s.dash,
            points: { show: false },
          })),
        ],
      },
      this.data as uPlot.AlignedData,
      this.element,
    );
    this.element.title = this.unit;
    this.dirty = true;
  }
}

const kMost = 1e30; // that an axis shows

// null, a gap, for what is not finite or as large as the largest double: one such value would hide
// all others.
export function drawable(value: number): number | null {
  return Math.abs(value) < kMost ? value : null;
}

// Some room below and above: at least that much, and as much as axes tell apart at such numbers.
export function padded(low: number, high: number, least: number): [number, number] {
  if (!Number.isFinite(low) || !Number.isFinite(high)) return [-0.1, 0.1];
  const size = Math.max(Math.abs(low), Math.abs(high)),
    pad =
      high > low ? Math.max(least, 0.1 * (high - low), 1e-6 * size) : Math.max(0.02, 0.02 * size);
  return [low - pad, high + pad];
}

// Numbers along an axis, in few places however large or small they are.
export function ticksText(ticks: number[]): string[] {
  const size = Math.max(...ticks.map(Math.abs)),
    step = ticks.length > 1 ? ticks[1]! - ticks[0]! : size || 1;
  const power = (value: number) => Math.floor(Math.log10(value) + 1e-9);
  if (size < 1e6 && step >= 1e-4)
    return ticks.map((tick) => tick.toFixed(Math.max(0, -power(step))));
  const digits = Math.min(7, Math.max(0, power(size) - power(step)));
  return ticks.map((tick) => (tick === 0 ? "0" : tick.toExponential(digits)));
}

// Ranges seen from above, with the robot's heading up.
export class PolarPlot {
  readonly element = h("canvas", { class: "polar", "aria-label": "ranges around the robot" });
  private readonly scans = new Map<string, [device_info_t, planar_lidar_t]>();
  private readonly sonars = new Map<string, [device_info_t, sonar_t]>();
  private dirty = true;

  scan(device: device_info_t, message: planar_lidar_t): void {
    this.scans.set(device.name, [device, message]);
    this.dirty = true;
  }
  sonar(device: device_info_t, message: sonar_t): void {
    this.sonars.set(device.name, [device, message]);
    this.dirty = true;
  }
  clear(): void {
    this.scans.clear();
    this.sonars.clear();
    this.dirty = true;
  }
  restyle(): void {
    this.dirty = true;
  }

  draw(): void {
    const { element } = this;
    const width = element.clientWidth,
      height = element.clientHeight,
      ratio = Math.min(2, devicePixelRatio);
    if (!this.dirty || width === 0) return;
    this.dirty = false;
    element.width = width * ratio;
    element.height = height * ratio;
    const pen = element.getContext("2d")!;
    pen.scale(ratio, ratio);
    const limit = Math.max(
      1,
      ...[...this.scans.values(), ...this.sonars.values()].map(([device]) =>
        Math.min(device.range_max, 30),
      ),
    );
    const behind = [...this.sonars.values()].length > 0;
    const cx = width / 2,
      cy = behind ? height / 2 : height - 18,
      reach = Math.min(width / 2 - 8, behind ? height / 2 - 8 : height - 30);
    const at = (x: number, y: number): [number, number] => [
      cx - (y / limit) * reach,
      cy - (x / limit) * reach,
    ];
    pen.strokeStyle = css("--line");
    pen.fillStyle = css("--dim");
    pen.font = "10px system-ui";
    pen.lineWidth = 1;
    const step = limit > 15 ? 5 : limit > 6 ? 2 : 1;
    for (let r = step; r <= limit + 1e-6; r += step) {
      pen.beginPath();
      pen.arc(cx, cy, (r / limit) * reach, 0, 2 * Math.PI);
      pen.stroke();
      pen.fillText(`${r} m`, cx + 3, cy - (r / limit) * reach + 11);
    }
    for (const [device, sonar] of this.sonars.values()) {
      pen.strokeStyle = css("--sonar");
      pen.lineWidth = 2;
      const yaw0 = 2 * Math.atan2(device.orientation[3]!, device.orientation[0]!);
      for (let i = 0; i < Math.min(sonar.n, device.nelements); ++i) {
        const r = sonar.range[i]!,
          p = device.element_pose,
          yaw = yaw0 + p[6 * i + 5]!,
          half = device.fov_horizontal / 2;
        if (r >= device.range_max - 1e-3) continue;
        pen.beginPath();
        for (let k = 0; k <= 6; ++k) {
          const a = yaw + half * (k / 3 - 1);
          pen.lineTo(
            ...at(
              device.position[0]! + p[6 * i]! + r * Math.cos(a),
              device.position[1]! + p[6 * i + 1]! + r * Math.sin(a),
            ),
          );
        }
        pen.stroke();
      }
    }
    for (const [device, scan] of this.scans.values()) {
      const yaw0 = 2 * Math.atan2(device.orientation[3]!, device.orientation[0]!);
      pen.fillStyle = css("--rays");
      pen.beginPath();
      pen.moveTo(...at(device.position[0]!, device.position[1]!));
      scan.ranges.forEach((range, i) => {
        const r = range === -Infinity ? 0 : Math.min(range, limit),
          a = yaw0 + scan.rad0 + i * scan.radstep;
        pen.lineTo(
          ...at(device.position[0]! + r * Math.cos(a), device.position[1]! + r * Math.sin(a)),
        );
      });
      pen.closePath();
      pen.globalAlpha = 0.22;
      pen.fill();
      pen.globalAlpha = 1;
      scan.ranges.forEach((range, i) => {
        if (!Number.isFinite(range)) return;
        const a = yaw0 + scan.rad0 + i * scan.radstep,
          [x, y] = at(
            device.position[0]! + range * Math.cos(a),
            device.position[1]! + range * Math.sin(a),
          );
        pen.fillRect(x - 1, y - 1, 2, 2);
      });
    }
    pen.fillStyle = css("--accent");
    pen.beginPath();
    pen.moveTo(cx, cy - 8);
    pen.lineTo(cx + 5, cy + 5);
    pen.lineTo(cx - 5, cy + 5);
    pen.fill();
  }
}
