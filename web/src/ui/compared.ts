// The comparison with another log: the first difference, and how far apart the robots are.
import { apartChannel, wordsOf } from "../state/comparison";
import type { Comparison } from "../wire/protocol";
import type { Page } from "../state/page";
import { h } from "../widgets/elements";

const kMostRows = 20,
  kMostNames = 8;

export interface ComparedActions {
  seek(time_s: number): void;
  plot(channel: string, field: string): void;
}

export class Compared {
  readonly element = h("section", { id: "compared" });

  constructor(
    private readonly page: Page,
    private readonly actions: ComparedActions,
  ) {
    page.watch(["hello", "comparison"], ({ hello, comparison }) => {
      this.element.hidden = !hello?.compared;
      this.element.replaceChildren(
        h("h2", {}, `Beside ${hello?.compared ?? ""}`),
        ...(comparison ? this.report(comparison) : [h("p", { class: "dim" }, "Comparing …")]),
      );
    });
  }

  private report(found: Comparison): HTMLElement[] {
    const words = [found.fault && `The messages were not compared: ${found.fault}`];
    if (found.same) words.push("No message differs.");
    if (found.channels?.length) words.push(`Other messages on ${some(found.channels)}.`);
    if (found.missing.length > 0) words.push(`Only in ${found.other}: ${some(found.missing)}.`);
    if (found.extra.length > 0) words.push(`Not in ${found.other}: ${some(found.extra)}.`);
    return [
      ...(found.first ? [this.first(found)] : []),
      ...words.filter(Boolean).map((text) => h("p", { class: "dim" }, text)),
      ...(found.robots.length > 0 ? [this.table(found)] : []),
    ];
  }

  private first({ first, other }: Comparison): HTMLElement {
    const { begin = 0 } = this.page.now.playback ?? {};
    return h(
      "p",
      { id: "difference-words" },
      `First difference at ${(first!.t - begin).toFixed(3)} s: ${wordsOf(first!, other)} `,
      h("button", { id: "to-difference", click: () => this.actions.seek(first!.t) }, "Go there"),
    );
  }

  // The largest distance first.
  private table({ robots }: Comparison): HTMLElement {
    const rows = [...robots].sort((a, b) => b.distance - a.distance).slice(0, kMostRows);
    return h(
      "table",
      { class: "statistics" },
      h("tr", {}, ...["robot", "apart at most", "", ""].map((text) => h("th", {}, text))),
      ...rows.map(({ name, distance, t }) =>
        h(
          "tr",
          { "data-apart": name },
          h("th", {}, name),
          h("td", { class: "number" }, `${distance.toPrecision(3)} m`),
          h("td", {}, h("button", { click: () => this.actions.seek(t) }, "Go there")),
          h("td", {}, h("button", { click: () => this.plot(name) }, "Plot")),
        ),
      ),
    );
  }

  private plot(robot: string): void {
    this.actions.plot(apartChannel(robot), "distance");
    this.actions.plot(apartChannel(robot), "angle");
  }
}

const some = (names: string[]) =>
  names.slice(0, kMostNames).join(", ") +
  (names.length > kMostNames ? ` and ${names.length - kMostNames} more` : "");
