// Which parts of the page are open and where, kept for each world, or as the link says that led
// here. A new world starts with the last layout.
import { kLayers } from "../state/layers";
import { kTabs, type Page, type Tab } from "../state/page";
import { recallFor, rememberFor } from "../state/memory";
import { placeOf } from "../state/place";
import { worldKey } from "../state/world_key";

const kNarrow_px = 860; // below this the panel takes much of the page, and is closed at first

// Where panels are.
export interface Panels {
  onChange: () => void;
  readonly kept: object | null;
  restore(kept: unknown): void;
  open(tab: Tab): void;
}

export class Layout {
  private of = ""; // the world that the layout belongs to
  private isFirst = true; // no world has been shown yet

  constructor(
    private readonly page: Page,
    private readonly dock: Panels,
  ) {
    page.watch(["world"], (state) => {
      const key = worldKey(state);
      if (!state.world || key === this.of) return;
      this.of = key;
      this.restore();
    });
    page.watch(["tab", "panel", "layers"], ({ tab, panel, layers }) => {
      if (!this.of) return;
      rememberFor(this.of, "page", tab);
      if (innerWidth >= kNarrow_px) rememberFor(this.of, "panel", panel ? "open" : "closed");
      const off = kLayers.filter((layer) => !layers.has(layer));
      rememberFor(this.of, "layers-off", off.join());
    });
    dock.onChange = () => {
      const { kept } = dock;
      if (this.of && kept) rememberFor(this.of, "layout", JSON.stringify(kept));
    };
  }

  private restore(): void {
    const { hello, tab, panel, layers } = this.page.now,
      linked = this.isFirst ? placeOf(location.hash).open : null,
      kept = linked?.page ?? recallFor(this.of, "page"),
      off = linked?.off ?? recallFor(this.of, "layers-off")?.split(","),
      isOpen = linked !== null || recallFor(this.of, "panel") !== "closed",
      opened = hello?.save ? tab : (kTabs.find((name) => name === kept) ?? tab);
    this.isFirst = false;
    this.dock.restore(linked?.layout ?? JSON.parse(recallFor(this.of, "layout") ?? "null"));
    this.page.set({
      tab: opened,
      panel: innerWidth >= kNarrow_px ? isOpen : panel,
      layers: off ? new Set(kLayers.filter((layer) => !off.includes(layer))) : layers,
    });
    this.dock.open(opened);
  }
}
