// Pictures of cameras in panels of their own.
import type { image_t } from "../../generated/messages";
import { h } from "../widgets/elements";
import { Picture, type Source } from "../widgets/picture";

export class CameraPanels {
  private readonly open = new Set<Picture>();

  // changed: called when other channels are needed.
  constructor(private readonly changed: () => void) {}

  get channels(): string[] {
    return [...this.open].map(({ name }) => name);
  }

  // A panel for that channel, to be disposed of when it is closed.
  make(channel: string) {
    const picture = new Picture(channel);
    this.open.add(picture);
    this.changed();
    return {
      element: h("div", { class: "camera-panel" }, picture.element),
      init: () => undefined,
      dispose: () => {
        this.open.delete(picture);
        this.changed();
      },
    };
  }

  message(channel: string, message: image_t, source: Source): void {
    for (const picture of this.open) if (picture.name === channel) picture.show(message, source);
  }
}
