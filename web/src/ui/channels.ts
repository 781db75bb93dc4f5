// The list of all channels: type, rate, size, and the last values of those that are open.
import { decode, typeOf } from "../wire/lcm";
import type { World } from "../state/world";
import { fieldsOf, nameOf } from "../wire/fields";
import { h, say } from "../widgets/elements";
import { kDragType } from "../widgets/drag";
import { textOf } from "../widgets/text";

const kMostRows = 300;
const kMostFields = 400; // to plot by a click; a formula on the page Plots takes any
const kMostShown = 2000; // elements of an array

interface Row {
  element: HTMLElement;
  rate: HTMLElement;
  size: HTMLElement;
  values: HTMLElement | null;
  last: number;
  at: number;
  hz: number;
}

export class ChannelList {
  readonly element: HTMLElement;
  readonly opened = new Set<string>();
  private readonly rows = new Map<string, Row>();
  private readonly body = h("tbody");
  private readonly filter = h("input", {
    type: "search",
    placeholder: "filter channels",
    "aria-label": "filter channels",
  });
  private readonly more = h("p", { class: "dim" });
  private world: World | null = null;
  onPlot: (channel: string, path: string) => void = () => undefined;

  constructor(private readonly onOpened: () => void) {
    this.filter.addEventListener("input", () => this.fill());
    this.element = h(
      "section",
      {},
      this.filter,
      h(
        "table",
        { class: "channels" },
        h(
          "thead",
          {},
          h(
            "tr",
            {},
            h("th", {}, "channel"),
            h("th", {}, "type"),
            h("th", { class: "number" }, "Hz"),
            h("th", { class: "number" }, "bytes"),
          ),
        ),
        this.body,
      ),
      this.more,
    );
  }

  show(world: World): void {
    this.world = world;
    this.fill();
  }

  private fill(): void {
    const wanted = this.filter.value.toLowerCase();
    const channels = (this.world?.channels ?? []).filter((c) =>
      `${c.name} ${c.type}`.toLowerCase().includes(wanted),
    );
    this.body.replaceChildren();
    const before = new Map(this.rows);
    this.rows.clear();
    for (const channel of channels.slice(0, kMostRows)) {
      const old = before.get(channel.name);
      const rate = h("td", { class: "number" }),
        size = h("td", { class: "number" });
      const row: Row = {
        element: h(
          "tr",
          { tabindex: 0, "data-channel": channel.name },
          h("td", {}, channel.input ? "→ " : "", channel.name),
          h("td", { class: "dim" }, channel.type),
          rate,
          size,
        ),
        rate,
        size,
        values: null,
        last: old?.last ?? 0,
        at: old?.at ?? 0,
        hz: old?.hz ?? 0,
      };
      const toggle = () => {
        if (this.opened.delete(channel.name)) {
          row.values?.parentElement?.parentElement?.remove();
          row.values = null;
        } else {
          this.opened.add(channel.name);
          this.open(row);
        }
        this.onOpened();
      };
      row.element.addEventListener("click", toggle);
      row.element.addEventListener("keydown", (event) => {
        if (event.key === "Enter") toggle();
      });
      this.rows.set(channel.name, row);
      this.body.append(row.element);
      if (this.opened.has(channel.name)) this.open(row);
    }
    say(
      this.more,
      channels.length > kMostRows
        ? `${channels.length - kMostRows} more: narrow them down by the filter`
        : "",
    );
  }

  private open(row: Row): void {
    row.values = h("pre", {}, "nothing yet");
    row.element.after(h("tr", {}, h("td", { colspan: 4 }, row.values)));
  }

  // Fields that can be plotted by a click or a drag onto the page Plots; made once for each open
  // row.
  private offerFields(channel: string, type: string, message: unknown, values: HTMLElement): void {
    if (values.nextElementSibling) return;
    const fields = fieldsOf(type, message).filter((path) => path !== "utime");
    const chips = fields.slice(0, kMostFields).map((path) => {
      const chip = h(
        "button",
        {
          class: "chip",
          draggable: "true",
          "data-field": path,
          title: `plot ${channel} ${path}`,
          click: () => this.onPlot(channel, path),
        },
        nameOf(message, path) || path,
      );
      chip.addEventListener("dragstart", (event) =>
        event.dataTransfer?.setData(kDragType, `${channel}\n${path}`),
      );
      return chip;
    });
    values.after(h("div", { class: "row" }, ...chips));
  }

  traffic(channels: string[], messages: Uint32Array, sizes: Uint32Array): void {
    const now = performance.now();
    channels.forEach((name, i) => {
      const row = this.rows.get(name);
      if (!row || i >= messages.length) return;
      const count = messages[i]!;
      if (row.at > 0 && now > row.at) {
        const hz = (((count - row.last) >>> 0) * 1000) / (now - row.at);
        row.hz = row.hz === 0 || hz === 0 ? hz : 0.6 * row.hz + 0.4 * hz;
        say(row.rate, row.hz >= 9.95 ? row.hz.toFixed(0) : row.hz.toFixed(1));
      }
      row.last = count;
      row.at = now;
      say(row.size, String(sizes[i]!));
    });
  }

  message(channel: string, bytes: Uint8Array): void {
    const values = this.rows.get(channel)?.values;
    if (!values) return;
    const type = typeOf(bytes);
    try {
      const message = type && decode(type, bytes);
      say(
        values,
        type ? textOf(message, 0, kMostShown) : `${bytes.length} bytes of a type that is not known`,
      );
      if (type) this.offerFields(channel, type, message, values);
    } catch (error) {
      say(values, (error as Error).message);
    }
  }
}
