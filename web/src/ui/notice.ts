// A message that stays until it no longer holds, or is clicked away.
import type { Page } from "../state/page";
import type { LinkState } from "../wire/protocol";
import { say, toast } from "../widgets/elements";

export class Notice {
  private wasOpen = false;

  constructor(
    private readonly element: HTMLElement,
    private readonly page: Page,
  ) {
    element.addEventListener("click", () => this.show(""));
  }

  // "" for none.
  show(words: string): void {
    this.element.hidden = words === "";
    say(this.element, words);
  }

  onLink(link: LinkState, words: string): void {
    const was = this.page.now.link;
    this.page.set({ link });
    this.show(words);
    if (link !== "open") return;
    if (this.wasOpen) toast(was === "silent" ? "The server answers again." : "Connected again.");
    this.wasOpen = true;
  }
}
