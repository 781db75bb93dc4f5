// Publishes a message, written as JSON, on a channel that the run takes; its type is checked first.
import type { Page } from "../state/page";
import { h, say } from "../widgets/elements";
import { blankOf, checkedMessage } from "../wire/as_text";
import { encode, fingerprint, type TypeName } from "../wire/lcm";

export class Publisher {
  readonly element: HTMLElement;
  private readonly channel = h("select", { "aria-label": "channel to publish on", class: "wide" });
  private readonly type = h("span", { class: "dim" });
  private readonly text = h("textarea", {
    "aria-label": "message",
    id: "message",
    rows: 8,
    spellcheck: "false",
  });
  private readonly words = h("p", { class: "dim", role: "status", id: "published" });
  private shown = "";

  // publish: returns false without a connection.
  constructor(
    private readonly page: Page,
    private readonly publish: (channel: string, message: Uint8Array) => boolean,
  ) {
    this.channel.addEventListener("change", () => this.fill());
    this.element = h(
      "details",
      { id: "publish" },
      h("summary", {}, "Publish"),
      h("div", { class: "row" }, this.channel, this.type),
      this.text,
      h("div", { class: "row" }, h("button", { id: "send", click: () => this.send() }, "Publish")),
      this.words,
    );
    page.watch(["world", "hello"], ({ world, hello }) => {
      // Requests have answers, and a session that makes them.
      const inputs = (world?.channels ?? []).filter(
        ({ input, type, fingerprint: hash }) =>
          input && type !== "request_t" && fingerprint(type) === hash,
      );
      this.element.hidden = hello?.mode !== "live" || inputs.length === 0;
      const chosen = this.channel.value;
      this.channel.replaceChildren(...inputs.map(({ name }) => h("option", {}, name)));
      if (inputs.some(({ name }) => name === chosen)) this.channel.value = chosen;
      this.fill();
    });
  }

  private get typeName(): string {
    const { world } = this.page.now;
    return world?.channels.find(({ name }) => name === this.channel.value)?.type ?? "";
  }

  private fill(): void {
    const { typeName } = this;
    if (typeName === this.shown) return;
    this.shown = typeName;
    say(this.type, typeName);
    this.text.value = JSON.stringify(blankOf(typeName), null, 1);
  }

  private send(): void {
    const { value: channel } = this.channel,
      type = this.typeName as TypeName;
    try {
      const message = checkedMessage(type, JSON.parse(this.text.value));
      const sent = this.publish(channel, encode(type, message as never));
      say(this.words, sent ? `Published on ${channel}.` : "There is no connection.");
    } catch (error) {
      say(this.words, `Not published: ${(error as Error).message}.`);
    }
  }
}
