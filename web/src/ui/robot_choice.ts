// The choice of a robot, with a search field where they are many.
import type { Page } from "../state/page";
import { h } from "../widgets/elements";

const kSearched = 12; // a search field is shown for more robots than these

export class RobotChoice {
  readonly element: HTMLElement;
  private readonly robots = h("select", { class: "full robots", "aria-label": "robot" });
  private readonly search = h("input", {
    type: "search",
    class: "find",
    placeholder: "find a robot",
    "aria-label": "find a robot",
  });
  private names: string[] = [];

  constructor(
    private readonly page: Page,
    choose: (robot: number) => void,
  ) {
    this.element = h("div", { class: "choice" }, this.search, this.robots);
    this.robots.addEventListener("change", () => choose(this.names.indexOf(this.robots.value)));
    this.search.addEventListener("input", () => this.fill());
    this.search.addEventListener("keydown", (event) => {
      // the first match
      if (event.key === "Enter" && this.robots.options.length > 0)
        choose(this.names.indexOf(this.robots.options[0]!.value));
    });
    page.watch(["world", "robot"], ({ world, robot }) => {
      const names = world?.robots.map(({ name }) => name) ?? [];
      this.element.hidden = names.length === 0;
      if (names.join("\n") !== this.names.join("\n")) {
        this.names = names;
        this.search.hidden = names.length <= kSearched;
        this.search.value = "";
        this.fill();
      }
      this.robots.value = names[robot] ?? "";
    });
  }

  private fill(): void {
    const words = this.search.value.toLowerCase();
    this.robots.replaceChildren(
      ...this.names
        .filter((name) => name.toLowerCase().includes(words))
        .map((name) => h("option", {}, name)),
    );
    this.robots.value = this.names[this.page.now.robot] ?? "";
  }
}
