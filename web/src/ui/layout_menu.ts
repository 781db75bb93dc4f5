// The menu that opens and closes panels and adds further views.
import { kTabs, type Page } from "../state/page";
import { h } from "../widgets/elements";
import { icon } from "../widgets/icons";

export interface Arranged {
  has(tab: (typeof kTabs)[number]): boolean;
  open(tab: (typeof kTabs)[number]): void;
  close(tab: (typeof kTabs)[number]): void;
  add(kind: string, title: string, settings: Record<string, unknown>): void;
  reset(): void;
}

export function makeLayoutMenu(place: Element, page: Page, dock: Arranged): void {
  const pages = kTabs.map((tab) => {
    const box = h("input", { type: "checkbox" });
    box.addEventListener("change", () => (box.checked ? dock.open(tab) : dock.close(tab)));
    return { tab, box, label: h("label", { class: "check" }, box, tab) };
  });
  const cameras = h("select", { "aria-label": "add a camera" });
  const menu = h(
    "div",
    { id: "panels", class: "menu", popover: true },
    ...pages.map(({ label }) => label),
    h(
      "button",
      { id: "add-view", click: () => dock.add("scene", "3-D view", {}) },
      "Add a 3-D view",
    ),
    cameras,
    h("button", { id: "usual-layout", click: () => dock.reset() }, "Usual layout"),
  );
  cameras.addEventListener("change", () => {
    dock.add("camera", cameras.value, { channel: cameras.value });
    cameras.value = "";
  });
  menu.addEventListener("click", ({ target }) => {
    if (target instanceof HTMLButtonElement) menu.hidePopover();
  });
  menu.addEventListener("beforetoggle", () => {
    for (const { tab, box } of pages) box.checked = dock.has(tab);
    const names = (page.now.world?.channels ?? [])
      .filter(({ type, input }) => type === "image_t" && !input)
      .map(({ name }) => name);
    cameras.hidden = names.length === 0;
    cameras.replaceChildren(
      h("option", { value: "" }, "Add a camera …"),
      ...names.map((name) => h("option", {}, name)),
    );
  });
  place.append(
    h(
      "button",
      {
        id: "open-panels",
        class: "icon",
        popovertarget: "panels",
        title: "panels and views",
        "aria-label": "panels and views",
      },
      icon("panels"),
    ),
  );
  document.body.append(menu);
}
