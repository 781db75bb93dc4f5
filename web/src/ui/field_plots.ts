// Plots of any fields of any channels, in panes: over the whole run, with statistics, as a table,
// and with a cursor tied to the time line.
import uPlot from "uplot";
import { isCompared } from "../state/comparison";
import { csvOf, fieldsOf, statisticsOf, valueAt } from "../wire/fields";
import type { Page } from "../state/page";
import { decode, typeOf } from "../wire/lcm";
import type { History, RunLink } from "../wire/protocol";
import { h, toast } from "../widgets/elements";
import { recall, remember } from "../state/memory";
import { drawable, padded } from "../widgets/plots";
import { download } from "../widgets/download";
import { kDragType } from "../widgets/drag";

const kMostPoints = 40_000; // of a series; then every second one is dropped
const kMostPanes = 8;
const kColours = ["--true", "--odometry", "--sonar", "--rays", "--accent", "--text"];

const css = (name: string) =>
  getComputedStyle(document.documentElement).getPropertyValue(name).trim();

interface Series {
  channel: string;
  path: string;
  times: number[];
  values: number[];
  stride: number; // every n-th message is kept
  skipped: number;
  note: string; // what is missing; "" for nothing
}

class Pane {
  readonly element: HTMLElement;
  readonly series: Series[] = [];
  private readonly body = h("div", { class: "plot" });
  private readonly table = h("table", { class: "statistics" });
  private plot: uPlot | undefined;
  private dirty = true;

  constructor(
    private readonly page: Page,
    private readonly actions: {
      seek(time_s: number): void;
      changed(): void;
      close(pane: Pane): void;
    },
  ) {
    const csv = h("button", { title: "as a table", click: () => this.download() }, "CSV");
    const close = h("button", { title: "close this pane", click: () => actions.close(this) }, "×");
    this.element = h(
      "section",
      { class: "pane" },
      this.body,
      this.table,
      h("div", { class: "row" }, csv, close),
    );
    new ResizeObserver(() => this.build()).observe(this.body);
  }

  add(channel: string, path: string): Series {
    const series = { channel, path, times: [], values: [], stride: 1, skipped: 0, note: "" };
    this.series.push(series);
    this.build();
    this.actions.changed();
    return series;
  }

  take(series: Series, time_s: number, value: number): void {
    const { times, values } = series;
    if (times.length > 0 && time_s <= times.at(-1)!) return; // the past, which is here already
    if (++series.skipped < series.stride) return;
    series.skipped = 0;
    times.push(time_s);
    values.push(value);
    if (times.length > kMostPoints) {
      series.times = times.filter((_, i) => i % 2 === 0);
      series.values = values.filter((_, i) => i % 2 === 0);
      series.stride *= 2;
    }
    this.dirty = true;
  }

  // The history, followed by what has arrived meanwhile.
  begin(series: Series, { every, times, values }: History): void {
    const { times: laterTimes, values: laterValues } = series;
    Object.assign(series, { times, values });
    if (every > 1) series.note = `1 of ${every} messages`;
    laterTimes.forEach((time_s, i) => this.take(series, time_s, laterValues[i]!));
    this.dirty = true;
  }

  // The beginning of the time line: 0 s of the plot.
  private get origin(): number {
    return this.page.now.playback?.begin ?? 0;
  }

  clear(): void {
    for (const series of this.series) series.times = [];
    for (const series of this.series) series.values = [];
    this.dirty = true;
  }

  restyle(): void {
    this.build();
  }

  draw(now_s: number): void {
    if (this.body.clientWidth === 0) return;
    if (!this.plot) this.build();
    if (this.dirty) {
      this.dirty = false;
      this.plot?.setData(
        uPlot.join(
          this.series.map(
            ({ times, values }) =>
              [
                times.map((time_s) => time_s - this.origin),
                values.map(drawable),
              ] as uPlot.AlignedData,
          ),
          this.series.map(() => [2]),
        ),
      );
      this.summarise();
    }
    const left = this.plot?.valToPos(now_s - this.origin, "x") ?? -1;
    const cursor = this.body.querySelector<HTMLElement>(".now");
    if (cursor) cursor.style.left = `${left}px`;
  }

  private summarise(): void {
    const number = (value: number) => String(Number(value.toPrecision(5)));
    const rows = this.series.map((series, i) => {
      const found = statisticsOf(series.values),
        remove = h(
          "button",
          { title: "take it out", "aria-label": `take out ${labelOf(series)}` },
          "×",
        );
      remove.addEventListener("click", () => {
        this.series.splice(this.series.indexOf(series), 1);
        this.build();
        this.actions.changed();
      });
      const cells = found
        ? [found.min, found.mean, found.max, found.deviation].map((value) =>
            h("td", { class: "number" }, number(value)),
          )
        : [h("td", { colspan: 4, class: "dim" }, "nothing yet")];
      const colour = `color: ${css(kColours[i % kColours.length]!)}`;
      return h(
        "tr",
        {},
        h(
          "th",
          { style: colour },
          labelOf(series),
          series.note && h("div", { class: "dim" }, series.note),
        ),
        ...cells,
        h("td", {}, remove),
      );
    });
    const heads = ["", "least", "mean", "most", "deviation", ""].map((text) => h("th", {}, text));
    this.table.replaceChildren(h("tr", {}, ...heads), ...rows);
  }

  private download(): void {
    const text = csvOf(
      this.series.map(labelOf),
      this.series.map(({ times, values }) => [times, values]),
    );
    download(new Blob([text], { type: "text/csv" }), "ruedo.csv");
  }

  private build(): void {
    const width = this.body.clientWidth;
    if (width === 0) return;
    this.plot?.destroy();
    const axis = {
      stroke: css("--dim"),
      grid: { stroke: css("--line"), width: 1 },
      ticks: { stroke: css("--line"), width: 1 },
      font: "11px system-ui",
    };
    const series = this.series.map((each, i) => ({
      label: labelOf(each),
      stroke: css(kColours[i % kColours.length]!),
      width: 1.4,
      points: { show: false },
    }));
    this.plot = new uPlot(
      {
        width,
        height: 190,
        legend: { show: false },
        cursor: { points: { size: 6 }, drag: { x: true, y: false } },
        scales: { x: { time: false }, y: { range: (_, low, high) => padded(low, high) } },
        axes: [
          { ...axis, size: 32, values: (_, splits) => splits.map((s) => `${s} s`) },
          { ...axis, size: 54 },
        ],
        series: [{}, ...series],
      },
      [[]] as unknown as uPlot.AlignedData,
      this.body,
    );
    this.plot.over.append(h("div", { class: "now" }));
    this.plot.over.addEventListener("click", () => {
      const { left } = this.plot!.cursor;
      if (left !== undefined && left >= 0 && this.page.now.hello)
        this.actions.seek(this.origin + this.plot!.posToVal(left, "x"));
    });
    this.dirty = true;
  }
}

const labelOf = ({ channel, path }: { channel: string; path: string }) => `${channel} ${path}`;

export class FieldPlots {
  readonly element: HTMLElement;
  private readonly panes: Pane[] = [];
  private of = ""; // the world that the panes belong to
  private readonly list = h("div");
  private readonly channel = h("select", { "aria-label": "channel to plot", class: "wide" });
  private readonly field = h("select", { "aria-label": "field to plot", class: "wide" });

  // changed: called when other channels are needed.
  constructor(
    private readonly page: Page,
    private readonly link: RunLink,
    private readonly seek: (time_s: number) => void,
    private readonly changed: () => void,
  ) {
    this.channel.addEventListener("change", () => this.fillFields());
    const add = h(
      "button",
      { id: "plot", click: () => this.plot(this.channel.value, this.field.value, false) },
      "Plot",
    );
    const apart = h(
      "button",
      {
        id: "plot-apart",
        title: "in a pane of its own",
        click: () => this.plot(this.channel.value, this.field.value, true),
      },
      "In a new pane",
    );
    this.element = h(
      "section",
      { class: "fields", id: "fields" },
      h("h2", {}, "Any field"),
      h("div", { class: "row" }, this.channel, this.field),
      h("div", { class: "row" }, add, apart),
      this.list,
    );
    this.element.addEventListener("dragover", (event) => event.preventDefault());
    this.element.addEventListener("drop", (event) => this.drop(event));
    page.watch(["world"], ({ world }) => {
      if (world && world.name !== this.of) {
        this.of = world.name;
        this.restore();
      }
      this.fillChannels();
    });
  }

  get channels(): string[] {
    return this.panes.flatMap(({ series }) => series.map(({ channel }) => channel));
  }

  // Adds a field to the last pane, or to a new one.
  plot(channel: string, path: string, apart: boolean): void {
    if (!channel || !path) return;
    let pane = this.panes.at(-1);
    if (!pane || (apart && this.panes.length < kMostPanes)) {
      pane = new Pane(this.page, {
        seek: this.seek,
        changed: () => this.onChanged(),
        close: (closed) => this.close(closed),
      });
      this.panes.push(pane);
      this.list.append(pane.element);
    }
    if (pane.series.some((each) => each.channel === channel && each.path === path)) return;
    const series = pane.add(channel, path);
    void this.fillFromHistory(pane, series);
  }

  message(channel: string, bytes: Uint8Array): void {
    if (this.page.now.hello?.mode === "log") return; // its whole history was requested at once
    for (const pane of this.panes) {
      for (const series of pane.series)
        if (series.channel === channel) this.take(pane, series, bytes);
    }
  }

  draw(): void {
    const { playback, past, time_s } = this.page.now;
    for (const pane of this.panes) pane.draw(past?.now ?? playback?.now ?? time_s);
  }

  clear(): void {
    if (this.page.now.hello?.mode === "live") for (const pane of this.panes) pane.clear();
  }
  restyle(): void {
    for (const pane of this.panes) pane.restyle();
  }

  // The plots that were open when this world was last shown.
  private restore(): void {
    for (const { element } of this.panes.splice(0)) element.remove();
    try {
      const panes = JSON.parse(recall(`plots of ${this.of}`) ?? "[]") as [string, string][][];
      panes.forEach((pane) =>
        pane
          .filter(([channel]) => !isCompared(channel) || this.page.now.hello?.compared)
          .forEach(([channel, path], i) => this.plot(channel, path, i === 0)),
      );
    } catch {
      remember(`plots of ${this.of}`, "[]");
    }
  }

  private take(pane: Pane, series: Series, bytes: Uint8Array): void {
    const type = typeOf(bytes);
    if (!type) return;
    try {
      const message = decode(type, bytes) as unknown as { utime?: bigint };
      const time_s =
        message.utime === undefined ? this.page.now.time_s : Number(message.utime) * 1e-6;
      pane.take(series, time_s, valueAt(message, series.path));
    } catch {
      /* not whole: others say so */
    }
  }

  private async fillFromHistory(pane: Pane, series: Series): Promise<void> {
    try {
      pane.begin(series, await this.link.history(series.channel, series.path));
    } catch (error) {
      toast(`${labelOf(series)}: ${(error as Error).message}`, "error");
    }
  }

  private drop(event: DragEvent): void {
    const [channel, path] = event.dataTransfer?.getData(kDragType).split("\n") ?? [];
    if (!channel || !path) return;
    event.preventDefault();
    this.plot(channel, path, false);
  }

  private close(pane: Pane): void {
    this.panes.splice(this.panes.indexOf(pane), 1);
    pane.element.remove();
    this.onChanged();
  }

  private onChanged(): void {
    remember(
      `plots of ${this.of}`,
      JSON.stringify(
        this.panes.map(({ series }) => series.map(({ channel, path }) => [channel, path])),
      ),
    );
    this.changed();
  }

  private fillChannels(): void {
    const { world } = this.page.now,
      chosen = this.channel.value;
    const channels = (world?.channels ?? []).filter(
      ({ type, input, name }) => !input && name && fieldsOf(type).length > 0,
    );
    this.channel.replaceChildren(...channels.map(({ name }) => h("option", {}, name)));
    if (channels.some(({ name }) => name === chosen)) this.channel.value = chosen;
    this.fillFields();
  }

  private fillFields(): void {
    const type = this.page.now.world?.channels.find(
      ({ name }) => name === this.channel.value,
    )?.type;
    const fields = fieldsOf(type ?? "").filter((path) => path !== "utime");
    this.field.replaceChildren(...fields.map((path) => h("option", {}, path)));
  }
}
