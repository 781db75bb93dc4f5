// A plot of several series: over time, or the others over the first one; with statistics, as a
// table, and with a cursor tied to the time line.
import uPlot from "uplot";
import { csvOf, statisticsOf } from "../wire/fields";
import type { Page } from "../state/page";
import { downloadName } from "../state/world_key";
import { download } from "../widgets/download";
import { h } from "../widgets/elements";
import { drawable, padded, ticksText } from "../widgets/plots";
import { XYPlot } from "../widgets/xy_plot";
import type { Series } from "../state/series";

const kColours = ["--true", "--odometry", "--sonar", "--rays", "--accent", "--text"];
const kDouble_ms = 300; // between the clicks of a double click, at most
const kCurves_ms = 200; // between two drawings of curves, which are created again each time

const css = (name: string) =>
  getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const colourOf = (series: number) => kColours[series % kColours.length]!;

export interface Zoom {
  min: number; // s, from the beginning of the time line
  max: number;
}
export interface PaneActions {
  seek(time_s: number): void;
  changed(): void;
  close(pane: Pane): void;
  zoom(to: Zoom | null): void; // of all panes; null: everything
}

export class Pane {
  readonly element: HTMLElement;
  readonly series: Series[] = [];
  xy = false; // the others over the first one
  zoom: Zoom | null = null;
  private readonly body = h("div", {
    class: "plot",
    title: "drag: zoom; double click: everything",
  });
  private readonly table = h("table", { class: "statistics" });
  private readonly axes = h(
    "button",
    { title: "the others over the first one", click: () => this.setXY(!this.xy) },
    "x-y",
  );
  private plot: uPlot | undefined;
  private curves: XYPlot | undefined;
  private dirty = true;
  private drawn_ms = -Infinity;
  private seeking = 0; // of a timer

  constructor(
    private readonly page: Page,
    private readonly actions: PaneActions,
  ) {
    const csv = h("button", { title: "as a table", click: () => this.download() }, "CSV");
    const close = h("button", { title: "close this pane", click: () => actions.close(this) }, "×");
    this.element = h(
      "section",
      { class: "pane" },
      this.body,
      this.table,
      h("div", { class: "row" }, this.axes, csv, close),
    );
    new ResizeObserver(() => this.build()).observe(this.body);
  }

  add(series: Series): void {
    this.series.push(series);
    this.build();
    this.actions.changed();
  }

  // Something is new in its series.
  touch(): void {
    this.dirty = true;
  }

  setXY(on: boolean): void {
    this.xy = on;
    this.build();
    this.actions.changed();
  }

  // The beginning of the time line: 0 s of the plot.
  private get origin(): number {
    return this.page.now.playback?.begin ?? 0;
  }

  clear(): void {
    for (const series of this.series) series.clear();
    this.dirty = true;
  }

  restyle(): void {
    this.build();
  }

  draw(now_s: number, at_ms: number): void {
    if (this.body.clientWidth === 0) return;
    if (!this.plot && !this.curves) this.build();
    if (this.curves) this.drawCurves(at_ms);
    else this.drawTimes(now_s);
  }

  private drawTimes(now_s: number): void {
    if (this.dirty) {
      this.dirty = false;
      const columns = this.series.map(
        ({ times, values }) =>
          [times.map((t) => t - this.origin), values.map(drawable)] as uPlot.AlignedData,
      );
      const joined =
        columns.length > 0
          ? uPlot.join(
              columns,
              columns.map(() => [2]),
            )
          : [[]];
      this.plot?.setData(joined as uPlot.AlignedData, this.zoom === null);
      if (this.zoom) this.plot?.setScale("x", this.zoom);
      this.summarise();
    }
    const left = this.plot?.valToPos(now_s - this.origin, "x") ?? -1;
    const cursor = this.body.querySelector<HTMLElement>(".now");
    if (cursor) cursor.style.left = `${left}px`;
  }

  // Each value over the newest one that the first series had by then.
  private drawCurves(at_ms: number): void {
    const [x, ...others] = this.series;
    if (this.dirty && at_ms - this.drawn_ms >= kCurves_ms) {
      this.dirty = false;
      this.drawn_ms = at_ms;
      this.curves!.clear();
      others.forEach((y, curve) => {
        let at = -1;
        y.times.forEach((time_s, i) => {
          while (at + 1 < x!.times.length && x!.times[at + 1]! <= time_s) ++at;
          if (at >= 0) this.curves!.add(curve, time_s, x!.values[at]!, y.values[i]!);
        });
      });
      this.summarise();
    }
    this.curves!.draw();
  }

  private summarise(): void {
    const number = (value: number) => String(Number(value.toPrecision(5)));
    const rows = this.series.map((series, i) => {
      const found = statisticsOf(series.values);
      const cells = found
        ? [found.min, found.mean, found.max, found.deviation].map((value) =>
            h("td", { class: "number" }, number(value)),
          )
        : [h("td", { colspan: 4, class: "dim" }, "nothing yet")];
      const note = series.note && h("div", { class: "dim" }, series.note);
      return h(
        "tr",
        {},
        h("th", { style: `color: ${css(colourOf(i))}` }, series.label, note),
        ...cells,
        h("td", {}, this.remover(series)),
      );
    });
    const heads = ["", "least", "mean", "most", "deviation", ""].map((text) => h("th", {}, text));
    this.table.replaceChildren(h("tr", {}, ...heads), ...rows);
    this.axes.hidden = this.series.length < 2;
  }

  private remover(series: Series): HTMLElement {
    return h(
      "button",
      {
        title: "take it out",
        "aria-label": `take out ${series.label}`,
        click: () => {
          this.series.splice(this.series.indexOf(series), 1);
          this.build();
          this.actions.changed();
        },
      },
      "×",
    );
  }

  private download(): void {
    const text = csvOf(
      this.series.map(({ label }) => label),
      this.series.map(({ times, values }) => [times, values]),
    );
    download(new Blob([text], { type: "text/csv" }), downloadName(this.page.now, "plot", "csv"));
  }

  private build(): void {
    if (this.body.clientWidth === 0) return;
    this.plot?.destroy();
    this.plot = this.curves = undefined;
    this.body.replaceChildren();
    const isXY = this.xy && this.series.length > 1;
    this.axes.classList.toggle("on", isXY);
    this.axes.setAttribute("aria-pressed", String(isXY));
    if (isXY) this.buildCurves();
    else this.buildTimes();
    this.dirty = true;
    this.drawn_ms = -Infinity;
  }

  private buildCurves(): void {
    const [x, ...others] = this.series;
    this.curves = new XYPlot(
      "",
      [x!.label, others.length === 1 ? others[0]!.label : ""],
      others.map(({ label }, i) => ({ label, colour: colourOf(i + 1) })),
      false,
    );
    this.body.append(this.curves.element);
  }

  private buildTimes(): void {
    const axis = {
      stroke: css("--dim"),
      grid: { stroke: css("--line"), width: 1 },
      ticks: { stroke: css("--line"), width: 1 },
      font: "11px system-ui",
    };
    const series = this.series.map(({ label }, i) => ({
      label,
      stroke: css(colourOf(i)),
      width: 1.4,
      points: { show: false },
    }));
    this.plot = new uPlot(
      {
        width: this.body.clientWidth,
        height: 190,
        legend: { show: false },
        cursor: { points: { size: 6 }, drag: { x: true, y: false, setScale: false } },
        hooks: { setSelect: [(plot) => this.select(plot)] },
        scales: { x: { time: false }, y: { range: (_, low, high) => padded(low, high, 0) } },
        axes: [
          { ...axis, size: 32, values: (_, splits) => splits.map((s) => `${s} s`) },
          { ...axis, size: 54, values: (_, splits) => ticksText(splits) },
        ],
        series: [{}, ...series],
      },
      [[]] as unknown as uPlot.AlignedData,
      this.body,
    );
    this.plot.over.append(h("div", { class: "now" }));
    this.plot.over.addEventListener("click", ({ detail }) => this.click(detail));
    this.plot.over.addEventListener("dblclick", () => this.actions.zoom(null));
  }

  // While a part is shown, it waits whether a second click comes, which shows everything.
  private click(count: number): void {
    const { left } = this.plot!.cursor;
    clearTimeout(this.seeking);
    if (left === undefined || left < 0 || !this.page.now.hello || count > 1) return;
    const to_s = this.origin + this.plot!.posToVal(left, "x");
    if (this.zoom) this.seeking = window.setTimeout(() => this.actions.seek(to_s), kDouble_ms);
    else this.actions.seek(to_s);
  }

  private select(plot: uPlot): void {
    const { left, width, height } = plot.select;
    if (width === 0) return;
    this.actions.zoom({ min: plot.posToVal(left, "x"), max: plot.posToVal(left + width, "x") });
    plot.setSelect({ left: 0, top: 0, width: 0, height }, false);
  }
}
