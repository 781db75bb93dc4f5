// Plots of any fields of any channels, and of formulas over them, in panes over the whole run.
import { isCompared } from "../state/comparison";
import { worldKey } from "../state/world_key";
import { arraysOf, fieldsOf, kOverAll, nameOf } from "../wire/fields";
import type { Page } from "../state/page";
import { placeOf, type Open } from "../state/place";
import { decode, typeOf } from "../wire/lcm";
import type { RunLink } from "../wire/protocol";
import { h, toast } from "../widgets/elements";
import { recall, remember } from "../state/memory";
import { kDragType } from "../widgets/drag";
import { Pane, type Zoom } from "./pane";
import { Series } from "../state/series";

const kMostPanes = 8;
const kMostOffered = 1500; // fields of a channel

type Kept = Open["panes"][number]; // a pane as it is remembered

export class FieldPlots {
  readonly element: HTMLElement;
  private readonly panes: Pane[] = [];
  private zoom: Zoom | null = null;
  private isFirst = true; // no world has been shown yet
  private of = ""; // the world that the panes belong to
  private readonly newest = new Map<string, object>(); // messages of plotted and of offered channels
  private offered = ""; // channel, and how many fields of it
  private readonly list = h("div");
  private readonly channel = h("select", { "aria-label": "channel to plot", class: "wide" });
  private readonly field = h("input", {
    "aria-label": "field to plot",
    class: "wide",
    list: "offered-fields",
    placeholder: "field or formula",
    title: "x, min(ranges), derivative(v), x - y, {p3at/pose pos[0]} - {p3at/odometry x}",
    autocomplete: "off",
    spellcheck: "false",
  });
  private readonly offers = h("datalist", { id: "offered-fields" });

  // changed: called when other channels are needed.
  constructor(
    private readonly page: Page,
    private readonly link: RunLink,
    private readonly seek: (time_s: number) => void,
    private readonly changed: () => void,
  ) {
    this.channel.addEventListener("change", () => {
      this.field.value = "";
      this.offer();
      this.changed();
    });
    const plot = (apart: boolean) => this.plot(this.channel.value, this.field.value.trim(), apart);
    this.field.addEventListener("keydown", (event) => {
      if (event.key === "Enter") plot(false);
    });
    const add = h("button", { id: "plot", click: () => plot(false) }, "Plot");
    const apart = h(
      "button",
      { id: "plot-apart", title: "in a pane of its own", click: () => plot(true) },
      "In a new pane",
    );
    this.element = h(
      "section",
      { class: "fields", id: "fields" },
      h("h2", {}, "Any field"),
      h("div", { class: "row" }, this.channel, this.field, this.offers),
      h("div", { class: "row" }, add, apart),
      this.list,
    );
    page.watch(["world"], (state) => {
      const key = worldKey(state);
      if (state.world && key !== this.of) {
        this.of = key;
        this.restore();
      }
      this.fillChannels();
    });
  }

  // Those that are plotted, and the one whose fields are offered.
  get channels(): string[] {
    const { shown, world } = this.page.now,
      type = world?.channels.find(({ name }) => name === this.channel.value)?.type,
      isOffered = shown.has("Plots") && type !== "image_t" && this.channel.value;
    return [
      ...this.panes.flatMap(({ series }) => series.flatMap(({ channels }) => channels)),
      ...(isOffered ? [this.channel.value] : []),
    ];
  }

  // Takes fields that are dropped anywhere on an element.
  takeDrops(element: HTMLElement): void {
    element.addEventListener("dragover", (event) => {
      if (event.dataTransfer?.types.includes(kDragType)) event.preventDefault();
    });
    element.addEventListener("drop", (event) => {
      const [channel, path] = event.dataTransfer?.getData(kDragType).split("\n") ?? [];
      if (!channel || !path) return;
      event.preventDefault();
      const pane = this.panes.find((each) => each.element.contains(event.target as Node));
      this.plot(channel, path, false, pane);
      this.page.set({ tab: "Plots" });
    });
  }

  // Adds a field or a formula to a pane, the last one unless told, or to a new one.
  plot(channel: string, path: string, apart: boolean, into = this.panes.at(-1)): void {
    if (!channel || !path) return;
    if (into?.series.some((each) => each.channel === channel && each.path === path)) return;
    let series: Series;
    try {
      series = new Series(channel, path);
    } catch (error) {
      return toast(`${path}: ${(error as Error).message}.`, "error");
    }
    series.name = nameOf(this.newest.get(channel), path);
    const isNew = !into || (apart && this.panes.length < kMostPanes),
      pane = isNew ? this.newPane() : into;
    pane.add(series);
    void this.fill(pane, series);
  }

  private newPane(): Pane {
    const pane = new Pane(this.page, {
      seek: this.seek,
      changed: () => this.onChanged(),
      close: (closed) => this.close(closed),
      zoom: (to) => this.setZoom(to),
    });
    pane.zoom = this.zoom;
    this.panes.push(pane);
    this.list.append(pane.element);
    return pane;
  }

  private setZoom(zoom: Zoom | null): void {
    this.zoom = zoom;
    for (const pane of this.panes) {
      pane.zoom = zoom;
      pane.touch();
    }
  }

  message(channel: string, bytes: Uint8Array): void {
    const panes = this.panes.filter(({ series }) =>
        series.some(({ channels }) => channels.includes(channel)),
      ),
      type = panes.length > 0 || channel === this.channel.value ? typeOf(bytes) : undefined;
    if (!type) return;
    let message: { utime?: bigint };
    try {
      message = decode(type, bytes) as unknown as { utime?: bigint };
    } catch {
      return; // not whole: others say so
    }
    this.newest.set(channel, message);
    if (channel === this.channel.value) this.offer();
    if (this.page.now.hello?.mode === "log") return; // its whole history was requested at once
    const time_s =
      message.utime === undefined ? this.page.now.time_s : Number(message.utime) * 1e-6;
    for (const pane of panes) {
      for (const series of pane.series) if (series.hear(channel, time_s, message)) pane.touch();
    }
  }

  draw(at_ms: number): void {
    const { playback, past, time_s } = this.page.now;
    for (const pane of this.panes) pane.draw(past?.now ?? playback?.now ?? time_s, at_ms);
  }

  clear(): void {
    if (this.page.now.hello?.mode === "live") for (const pane of this.panes) pane.clear();
  }
  restyle(): void {
    for (const pane of this.panes) pane.restyle();
  }

  // The open plots.
  get kept(): Kept[] {
    return this.panes.map(({ xy, series }) => ({
      xy,
      of: series.map(({ channel, path }) => [channel, path]),
    }));
  }

  // The plots that were open when this world was last shown, or those of the link that led here.
  private restore(): void {
    for (const { element } of this.panes.splice(0)) element.remove();
    this.newest.clear();
    const linked = this.isFirst ? placeOf(location.hash).open?.panes : undefined;
    this.isFirst = false;
    try {
      const panes = linked ?? (JSON.parse(recall(`plots of ${this.of}`) ?? "[]") as Kept[]);
      for (const { xy, of } of panes) {
        const shown = of.filter(
          ([channel]) => !isCompared(channel) || this.page.now.hello?.compared,
        );
        shown.forEach(([channel, path], i) => this.plot(channel, path, i === 0));
        if (shown.length > 0) this.panes.at(-1)?.setXY(xy);
      }
    } catch {
      remember(`plots of ${this.of}`, "[]");
    }
  }

  private async fill(pane: Pane, series: Series): Promise<void> {
    try {
      await series.fill((channel, paths) => this.link.history(channel, paths));
    } catch (error) {
      toast(`${series.label}: ${(error as Error).message}`, "error");
    }
    pane.touch();
  }

  private close(pane: Pane): void {
    this.panes.splice(this.panes.indexOf(pane), 1);
    pane.element.remove();
    this.onChanged();
  }

  private onChanged(): void {
    remember(`plots of ${this.of}`, JSON.stringify(this.kept));
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
    this.offer();
  }

  // The fields of the chosen channel: all that its newest message has, with names.
  private offer(): void {
    const { value: channel } = this.channel,
      message = this.newest.get(channel),
      type = this.page.now.world?.channels.find(({ name }) => name === channel)?.type ?? "";
    const fields = fieldsOf(type, message).filter((path) => path !== "utime"),
      key = `${channel} ${fields.length} ${message !== undefined}`;
    if (key === this.offered) return;
    this.offered = key;
    const whole = arraysOf(type).flatMap((name) => kOverAll.map((over) => `${over}(${name})`));
    this.offers.replaceChildren(
      ...[...fields, ...whole].slice(0, kMostOffered).map((path) => {
        const name = nameOf(message, path);
        return h("option", { value: path, ...(name ? { label: `${path}: ${name}` } : {}) });
      }),
    );
  }
}
