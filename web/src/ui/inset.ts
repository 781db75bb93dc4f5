// A camera picture in a corner of the view, independent of the panel.
import type { image_t } from "../../generated/messages";
import type { Page } from "../state/page";
import { h } from "../widgets/elements";
import { recall, remember } from "../state/memory";
import { Picture, type Source } from "../widgets/picture";

export class Inset {
  private readonly choice = h("select", { id: "inset", "aria-label": "camera in the view" });
  private readonly element = h("div", { class: "inset", hidden: true });
  private picture: Picture | null = null;
  readonly chooser = h("label", { class: "row" }, "camera in the view", this.choice);

  // changed: called when another channel is needed.
  constructor(
    view: HTMLElement,
    private readonly page: Page,
    private readonly changed: () => void,
  ) {
    view.append(this.element);
    this.choice.addEventListener("change", () => {
      remember("inset", this.choice.value);
      this.show();
    });
    page.watch(["world"], () => this.list());
  }

  // "" for none.
  get channel(): string {
    return this.choice.value;
  }

  message(channel: string, message: image_t, source: Source): void {
    if (channel === this.channel) this.picture?.show(message, source);
  }

  private list(): void {
    const names = (this.page.now.world?.channels ?? [])
      .filter(({ type, input }) => type === "image_t" && !input)
      .map(({ name }) => name);
    const chosen = this.choice.value || recall("inset") || "";
    this.choice.replaceChildren(
      h("option", { value: "" }, "none"),
      ...names.map((name) => h("option", {}, name)),
    );
    this.choice.value = names.includes(chosen) ? chosen : "";
    this.chooser.hidden = names.length === 0;
    if (this.choice.value !== (this.picture?.name ?? "")) this.show();
  }

  private show(): void {
    const { channel } = this;
    this.picture = channel ? new Picture(channel) : null;
    this.element.hidden = !channel;
    this.element.replaceChildren(...(this.picture ? [this.picture.element] : []));
    this.changed();
  }
}
