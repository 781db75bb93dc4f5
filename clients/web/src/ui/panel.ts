// The panel beside the view: pages for the robot, its plots, the channels, and the world.
import { kTabs, type Page, type Tab } from "../state/page";
import type { Stage } from "../scene/stage";
import { h, recall, remember } from "./dom";
import { kThings, type Thing } from "./things";

const kSearched = 12; // more robots than these can be searched

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
  private readonly thing = h(
    "select",
    { class: "wide", "aria-label": "what to place" },
    ...kThings.map(({ name }, i) => h("option", { value: i }, name)),
  );
  private readonly place = h(
    "button",
    { id: "place", click: () => this.arm(!this.armed) },
    "Place by click (B)",
  );
  private armed = false;

  constructor(
    element: HTMLElement,
    private readonly page: Page,
    private readonly stage: Stage,
    pages: Record<Exclude<Tab, "World">, HTMLElement>,
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
    this.robots.addEventListener("change", () => choose(this.names.indexOf(this.robots.value)));
    this.search.addEventListener("input", () => this.fill());
    this.search.addEventListener("keydown", (event) => {
      // the first that is found
      if (event.key === "Enter" && this.robots.options.length > 0)
        choose(this.names.indexOf(this.robots.options[0]!.value));
    });
    element.append(tabs, this.content);
    const contents: Record<Tab, HTMLElement> = { ...pages, World: this.worldPage() };
    page.watch(["tab"], ({ tab }) => this.show(tab, contents[tab]));
    page.watch(["panel"], ({ panel }) =>
      document.getElementById("app")!.classList.toggle("closed", !panel),
    );
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
    remember("page", tab);
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

  // As in any list of tabs: arrows, Home and End go from one to the next.
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
    event.stopPropagation(); // arrows drive elsewhere
    this.open(kTabs[to]!);
    this.tabs.get(kTabs[to]!)!.focus();
  }

  private worldPage(): HTMLElement {
    const { stage } = this;
    const shadows = h("input", { type: "checkbox", checked: true });
    shadows.addEventListener("change", () => stage.setShadows(shadows.checked));
    const less = h("input", { type: "checkbox", checked: recall("detail") !== "full" });
    less.addEventListener("change", () => {
      remember("detail", less.checked ? "automatic" : "full");
      stage.setAutomatic(less.checked);
    });
    stage.setAutomatic(less.checked);
    return h(
      "section",
      {},
      h("h2", {}, "Place"),
      h("div", { class: "row" }, this.thing, this.place),
      h("p", { class: "dim" }, "Then click on the ground."),
      h("h2", {}, "View"),
      h("label", { class: "check" }, shadows, "shadows"),
      h("label", { class: "check" }, less, "less detail where drawing is slow"),
      h("div", { class: "row" }, h("button", { click: () => stage.home() }, "Whole world (Home)")),
    );
  }

  // What the next click on the ground places; null: nothing.
  placing(): Thing | null {
    return this.armed ? kThings[this.thing.selectedIndex]! : null;
  }
  startPlacing(): void {
    this.arm(true);
  }
  stopPlacing(): void {
    this.arm(false);
  }
  private arm(on: boolean): void {
    this.armed = on;
    this.place.classList.toggle("on", on);
    document.getElementById("canvas")!.classList.toggle("placing", on);
  }
}
