// The warnings of the program and the notes of the page, each with its times, the newest first,
// since toasts disappear.
import { clockText } from "../state/clock";
import type { Page, PageState } from "../state/page";
import { h, onToast, toast } from "../widgets/elements";

const kMost = 500;

export class Notes {
  readonly element: HTMLElement;
  private readonly list = h("ol", { class: "notes", id: "notes" });
  private readonly warnings = h("ol", { class: "notes", id: "warnings" });
  private isFaulty = false; // of the shown world, and a note was made
  private readonly none = h("p", { class: "dim" }, "No notes yet.");

  constructor(page: Page) {
    const clear = h("button", { id: "clear-notes", click: () => this.clear() }, "Clear");
    this.element = h(
      "section",
      {},
      h("h2", {}, "The program"),
      this.warnings,
      h("h2", {}, "This page"),
      h("div", { class: "row" }, clear),
      this.none,
      this.list,
    );
    page.watch(["warnings"], ({ warnings }) => this.showWarnings(warnings));
    onToast((text, kind) => {
      const { world, time_s } = page.now,
        sim = world ? clockText(time_s, world.step_us) : "",
        wall = new Date().toLocaleTimeString();
      this.list.prepend(
        h("li", { class: kind }, h("span", { class: "dim" }, `${wall}  ${sim} `), text),
      );
      if (this.list.childElementCount > kMost) this.list.lastElementChild!.remove();
      this.none.hidden = true;
    });
  }

  private showWarnings(warnings: PageState["warnings"]): void {
    const isFaulty = warnings.some(({ kind }) => kind === "error");
    if (isFaulty && !this.isFaulty)
      toast("Parts of this world are missing or faulty: see Notes.", "error");
    this.isFaulty = isFaulty;
    const lines = warnings.map(({ kind, text }) =>
      h("li", { class: kind === "error" ? "error" : "" }, h("b", {}, kind), ` ${text}`),
    );
    this.warnings.replaceChildren(
      ...(lines.length > 0 ? lines : [h("li", { class: "dim" }, "has warned of nothing.")]),
    );
  }

  private clear(): void {
    this.list.replaceChildren();
    this.none.hidden = false;
  }
}
