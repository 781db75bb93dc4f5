// The panel beside the view: pages for the robot, its plots, the channels, and the world.
import { kTabs, type Page, type Tab } from "../state/page";
import { h } from "../widgets/elements";

const kSearched = 12; // a search field is shown for more robots than these

export class Panel {
  private readonly tabs = new Map<Tab, HTMLButtonElement>();
  private readonly content = h("div", { class: "page", role: "tabpanel", id: "page", tabindex: 0 });
  private readonly robots = h("select", { class: "full", id: "robots", "aria-label": "robot" });
  private readonly search = h("input", {
    type: "search",
    id: "find",
    placeholder: "find a robot",
    "aria-label": "find a robot",
  });
  private names: string[] = [];

  constructor(
    element: HTMLElement,
    private readonly page: Page,
    pages: Record<Tab, HTMLElement>,
    choose: (robot: number) => void,
  ) {
    const tabs = h("div", { class: "tabs", role: "tablist", "aria-label": "panel" });
    for (const tab of kTabs) {
      const button = h(
        "button",
        { role: "tab", id: `tab-${tab}`, "aria-controls": "page", click: () => this.open(tab) },
        tab,
      );
      this.tabs.set(tab, button);
      tabs.append(button);
    }
    tabs.addEventListener("keydown", (event) => this.byArrows(event));
    const plots = this.tabs.get("Plots")!; // fields can be dropped onto it
    plots.addEventListener("dragover", (event) => {
      event.preventDefault();
      this.open("Plots");
    });
    this.robots.addEventListener("change", () => choose(this.names.indexOf(this.robots.value)));
    this.search.addEventListener("input", () => this.fill());
    this.search.addEventListener("keydown", (event) => {
      // the first match
      if (event.key === "Enter" && this.robots.options.length > 0)
        choose(this.names.indexOf(this.robots.options[0]!.value));
    });
    element.append(tabs, this.content);
    page.watch(["tab"], ({ tab }) => this.show(tab, pages[tab]));
    page.watch(["panel"], ({ panel }) =>
      document.getElementById("app")!.classList.toggle("closed", !panel),
    );
    this.search.hidden = this.robots.hidden = true;
    page.watch(["world", "robot"], ({ world, robot }) => {
      const names = world?.robots.map(({ name }) => name) ?? [];
      if (names.join("\n") !== this.names.join("\n")) {
        this.names = names;
        this.search.hidden = names.length <= kSearched;
        this.search.value = "";
        this.robots.hidden = names.length === 0;
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

  private open(tab: Tab): void {
    this.page.set({ tab });
  }

  private show(tab: Tab, content: HTMLElement): void {
    for (const [name, button] of this.tabs) {
      button.setAttribute("aria-selected", name === tab ? "true" : "false");
      button.tabIndex = name === tab ? 0 : -1;
    }
    this.content.setAttribute("aria-labelledby", `tab-${tab}`);
    const withRobot = tab === "Robot" || tab === "Plots";
    this.content.replaceChildren(
      ...(withRobot ? [this.search, this.robots, h("div", { style: "height: 10px" })] : []),
      content,
    );
  }

  // As in any tab list: arrows, Home and End change the tab.
  private byArrows(event: KeyboardEvent): void {
    const at = kTabs.indexOf(this.page.now.tab),
      last = kTabs.length - 1;
    const to = {
      ArrowLeft: at === 0 ? last : at - 1,
      ArrowRight: at === last ? 0 : at + 1,
      Home: 0,
      End: last,
    }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    event.stopPropagation(); // elsewhere arrows drive
    this.open(kTabs[to]!);
    this.tabs.get(kTabs[to]!)!.focus();
  }
}
