// Which parts of the page are open, kept for each world. A new world starts with the last layout.
import { kLayers } from "../state/layers";
import { kTabs, type Page } from "../state/page";
import { recallFor, rememberFor } from "../state/memory";

const kNarrow_px = 860; // below this the panel takes much of the page, and is closed at first

export class Layout {
  private of = ""; // the world that the layout belongs to

  constructor(private readonly page: Page) {
    page.watch(["world"], ({ world }) => {
      if (!world || world.name === this.of) return;
      this.of = world.name;
      this.restore();
    });
    page.watch(["tab", "panel", "layers"], ({ tab, panel, layers }) => {
      if (!this.of) return;
      rememberFor(this.of, "page", tab);
      if (innerWidth >= kNarrow_px) rememberFor(this.of, "panel", panel ? "open" : "closed");
      const off = kLayers.filter((layer) => !layers.has(layer));
      rememberFor(this.of, "layers-off", off.join());
    });
  }

  private restore(): void {
    const { hello, tab, panel, layers } = this.page.now,
      kept = recallFor(this.of, "page"),
      off = recallFor(this.of, "layers-off")?.split(",");
    const isOpen = recallFor(this.of, "panel") !== "closed";
    this.page.set({
      tab: hello?.save ? tab : (kTabs.find((name) => name === kept) ?? tab),
      panel: innerWidth >= kNarrow_px ? isOpen : panel,
      layers: off ? new Set(kLayers.filter((layer) => !off.includes(layer))) : layers,
    });
  }
}
