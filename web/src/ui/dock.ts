// The arrangement of the 3-D view, the pages and further views: panels that are dragged, resized,
// shown as tabs or beside each other, and closed (dockview). Keys do the same: arrows on a tab and
// on an edge, Delete on a tab.
import {
  createDockview,
  LayoutPriority,
  type DockviewApi,
  type IContentRenderer,
  type IDockviewPanel,
  type ITabRenderer,
  type SerializedDockview,
} from "dockview";
import "dockview/dist/styles/dockview.css";
import { kTabs, type Page, type Tab } from "../state/page";
import { kDragType } from "../widgets/drag";
import { h } from "../widgets/elements";

const kView = "view"; // the panel of the main view, which is always there
const kPanel_px = 390,
  kPanelShare = 0.16, // of a wide page, if that is more
  kBelowShare = 0.44, // of a phone
  kLeast_px = 120,
  kStep_px = 20; // of an edge moved by a key
// A phone, upright: pages below the view; on its side: beside it. Else: as the user likes.
const kShapes = {
  beside: matchMedia("(max-width: 860px) and (max-height: 480px) and (orientation: landscape)"),
  below: matchMedia("(max-width: 860px)"),
};
type Shape = keyof typeof kShapes | "wide";

// Makes the content of a further panel of that kind.
export type MakeFurther = (kind: string, settings: Record<string, unknown>) => IContentRenderer;

export class Dock {
  onChange: () => void = () => undefined; // the user has arranged something
  private readonly api: DockviewApi;
  private shape: Shape = shapeNow();
  private wide: SerializedDockview | null = null; // while a phone's arrangement is shown
  private isArranging = false; // not by the user

  constructor(
    private readonly place: HTMLElement,
    private readonly page: Page,
    view: HTMLElement,
    pages: Record<Tab, HTMLElement>,
    make: MakeFurther,
  ) {
    view.remove();
    this.api = createDockview(place, {
      theme: { name: "ruedo", className: "dockview-theme-ruedo" },
      disableFloatingGroups: true,
      proportionalLayout: false,
      defaultTabComponent: "tab",
      createTabComponent: tabLabel,
      createComponent: ({ id, name }) => {
        if (id === kView) return { element: view, init: () => undefined };
        const tab = kTabs.find((each) => each === id);
        return tab ? pageOf(pages[tab]) : further(make, name);
      },
    });
    // The room of a window that grows is the view's. Groups have no setting for that.
    this.api.onDidAddGroup((group) =>
      Object.defineProperty(group, "priority", {
        get: () =>
          group.panels.some(({ id }) => id === kView) ? LayoutPriority.High : LayoutPriority.Normal,
      }),
    );
    this.usual();
    for (const event of [this.api.onDidActivePanelChange, this.api.onDidLayoutChange])
      event(() => this.look());
    for (const query of Object.values(kShapes))
      query.addEventListener("change", () => this.reshape());
    page.watch(["tab"], ({ tab }) => this.open(tab));
    page.watch(["panel"], ({ panel }) => this.uncover(panel));
    place.addEventListener("keydown", (event) => this.key(event));
    place.addEventListener("dragover", (event) => {
      const to = tabOf(event.target);
      if (to && event.dataTransfer?.types.includes(kDragType))
        this.api.getPanel(to)?.api.setActive();
    });
  }

  // The open panes and their places; null on a phone.
  get kept(): SerializedDockview | null {
    return this.shape === "wide" ? this.api.toJSON() : this.wide;
  }

  // Arranges everything so again; as usual if that cannot be.
  restore(kept: unknown): void {
    if (this.shape !== "wide") {
      this.wide = kept as SerializedDockview | null;
      return;
    }
    this.arrange(() => {
      try {
        // Popped out windows would open any address
        const { grid, panels, activeGroup } = kept as SerializedDockview;
        this.api.fromJSON({ grid, panels, activeGroup });
        if (!this.api.getPanel(kView)) this.usual();
      } catch {
        this.usual();
      }
    });
  }

  // The pages as tabs beside the view.
  reset(): void {
    this.arrange(() => this.usual());
    this.onChange();
  }

  has(tab: Tab): boolean {
    return this.api.getPanel(tab) !== undefined;
  }

  open(tab: Tab): void {
    const there = this.api.getPanel(tab);
    if (there) return there.api.setActive();
    const beside = kTabs.find((each) => this.has(each));
    this.api.addPanel({
      id: tab,
      component: "page",
      title: tab,
      position: beside
        ? { referencePanel: beside, direction: "within" }
        : { referencePanel: kView, direction: this.shape === "below" ? "below" : "right" },
      ...this.size,
    });
  }

  close(tab: Tab): void {
    this.api.getPanel(tab)?.api.close();
  }

  // A further panel beside the view, below those that are there.
  add(kind: string, title: string, params: Record<string, unknown>): void {
    let number = 1;
    while (this.api.getPanel(`${kind} ${number}`)) ++number;
    const last = this.api.panels.filter(({ id }) => id !== kView && !isPageId(id)).at(-1);
    this.api.addPanel({
      id: `${kind} ${number}`,
      component: kind,
      title,
      params,
      position: last
        ? { referencePanel: last, direction: "below" }
        : { referencePanel: kView, direction: this.shape === "below" ? "below" : "right" },
    });
  }

  private get size(): { initialWidth?: number; initialHeight?: number } {
    const { clientWidth, clientHeight } = this.place;
    if (this.shape === "below") return { initialHeight: kBelowShare * clientHeight };
    return {
      initialWidth:
        this.shape === "beside"
          ? kBelowShare * clientWidth
          : Math.max(kPanel_px, kPanelShare * clientWidth),
    };
  }

  private usual(): void {
    this.api.clear();
    this.api.addPanel({
      id: kView,
      component: kView,
      title: "3-D view",
      minimumWidth: kLeast_px,
      minimumHeight: kLeast_px,
    });
    for (const tab of kTabs) this.open(tab);
    this.open(this.page.now.tab);
  }

  private arrange(how: () => void): void {
    this.isArranging = true;
    how();
    this.isArranging = false;
    this.uncover(this.page.now.panel);
  }

  // Another shape of the window.
  private reshape(): void {
    const shape = shapeNow();
    if (shape === this.shape) return;
    if (this.shape === "wide") this.wide = this.api.toJSON();
    this.shape = shape;
    // Of the new size at once: widths that are set in the old one would be cut to it.
    this.api.layout(this.place.clientWidth, this.place.clientHeight);
    if (shape === "wide" && this.wide) this.restore(this.wide);
    else this.arrange(() => this.usual());
  }

  // Shows the pages, or hides them and leaves their room to the views.
  private uncover(panel: boolean): void {
    document.getElementById("app")!.classList.toggle("closed", !panel);
    for (const group of this.api.groups)
      if (group.panels.length > 0 && group.panels.every(isPage)) group.api.setVisible(panel);
    this.look();
  }

  // The visible panes.
  private look(): void {
    const groups = this.api.groups.filter(({ api }) => api.isVisible),
      active = this.api.activePanel?.id,
      shown = kTabs.filter((tab) => groups.some(({ activePanel }) => activePanel?.id === tab));
    for (const { header, panels } of this.api.groups)
      header.hidden = panels.length === 1 && panels[0]!.id === kView; // it would cover the view
    this.makeEdges();
    if (this.isArranging) return;
    this.page.set({
      shown: new Set(shown),
      tab: shown.find((tab) => tab === active) ?? this.nextTo(shown),
    });
    this.onChange();
  }

  // The last page, if it is still there.
  private nextTo(shown: Tab[]): Tab {
    const { tab } = this.page.now;
    return this.has(tab) ? tab : (shown[0] ?? tab);
  }

  // Edges can be moved by keys.
  private makeEdges(): void {
    const all = this.place.getBoundingClientRect();
    for (const edge of this.place.querySelectorAll<HTMLElement>(".dv-sash")) {
      const isUpright = edge.closest(".dv-split-view-container")!.matches(".dv-horizontal"),
        { left, top } = edge.getBoundingClientRect(),
        share = isUpright ? (left - all.left) / all.width : (top - all.top) / all.height;
      Object.assign(edge, { role: "separator", tabIndex: 0, ariaLabel: "edge between panels" });
      edge.ariaOrientation = isUpright ? "vertical" : "horizontal";
      edge.ariaValueNow = String(Math.round(100 * share));
    }
  }

  private key(event: KeyboardEvent): void {
    const { target, key } = event;
    if (!(target instanceof HTMLElement)) return;
    if (target.matches(".dv-sash")) this.moveEdge(target, event);
    const at = tabOf(target);
    if (!at || target.role !== "tab") return;
    if (key === "Delete" && at !== kView) return this.api.getPanel(at)?.api.close();
    const tabs = [...target.parentElement!.querySelectorAll<HTMLElement>('[role="tab"]')],
      place = tabs.indexOf(target),
      last = tabs.length - 1;
    const to = {
      ArrowLeft: place === 0 ? last : place - 1,
      ArrowRight: place === last ? 0 : place + 1,
      Home: 0,
      End: last,
    }[key];
    if (to === undefined) return;
    event.preventDefault();
    event.stopPropagation(); // elsewhere arrows drive
    this.api.getPanel(tabOf(tabs[to]!)!)?.api.setActive();
    tabs[to]!.focus();
  }

  // As if it were dragged.
  private moveEdge(edge: HTMLElement, event: KeyboardEvent): void {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[
      event.key
    ];
    if (!way) return;
    event.preventDefault();
    event.stopPropagation();
    const drag = (kind: string, steps: number) =>
      new PointerEvent(kind, {
        clientX: steps * way[0]! * kStep_px,
        clientY: steps * way[1]! * kStep_px,
      });
    edge.dispatchEvent(drag("pointerdown", 0));
    document.dispatchEvent(drag("pointermove", 1));
    document.dispatchEvent(drag("pointerup", 1));
    this.makeEdges();
  }
}

const isPageId = (id: string) => kTabs.some((tab) => tab === id);
const isPage = ({ id }: IDockviewPanel) => isPageId(id);

const tabOf = (target: EventTarget | null) =>
  target instanceof Element
    ? target.closest<HTMLElement>("[data-tab-panel-id]")?.dataset.tabPanelId
    : undefined;

const shapeNow = (): Shape =>
  kShapes.beside.matches ? "beside" : kShapes.below.matches ? "below" : "wide";

const pageOf = (content: HTMLElement): IContentRenderer => ({
  element: h("div", { class: "page", tabindex: 0 }, content),
  init: () => undefined,
});

// With a cross for the pointer; keys close it by Delete.
function tabLabel(): ITabRenderer {
  const element = h("span", { class: "label" });
  return {
    element,
    init({ title, api }) {
      const cross = h("span", { class: "cross-out", "aria-hidden": "true", title: "close (Del)" });
      cross.append("×");
      cross.addEventListener("pointerdown", (event) => event.stopPropagation());
      cross.addEventListener("click", () => api.close());
      element.replaceChildren(title, ...(api.id === kView ? [] : [cross]));
    },
  };
}

// Its settings are known only when it is initialised.
function further(make: MakeFurther, kind: string): IContentRenderer {
  const element = h("div", { class: "further" });
  let made: IContentRenderer | null = null;
  return {
    element,
    init(parameters) {
      made = make(kind, parameters.params);
      element.replaceChildren(made.element);
      made.init(parameters);
    },
    dispose: () => made?.dispose?.(),
  };
}
