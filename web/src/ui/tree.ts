// The models of the world as a searchable tree: robots, movable and fixed things, each with its
// links.
import type { Editor } from "../edit/editor";
import type { ModelDescription } from "../wire/description";
import type { Page } from "../state/page";
import { h, say } from "../widgets/elements";

const kMostRows = 200;
const kGroups: [title: string, holds: (model: ModelDescription) => boolean][] = [
  ["Robots", (model) => model.robot],
  ["Movable", (model) => !model.robot && !model.fast],
  ["Fixed", (model) => !model.robot && model.fast],
];

export class Tree {
  readonly element: HTMLElement;
  private readonly list = h("div", {
    class: "tree",
    role: "tree",
    "aria-label": "models of the world",
    tabindex: 0,
  });
  private readonly search = h("input", {
    type: "search",
    id: "find-model",
    placeholder: "find a model",
    "aria-label": "find a model",
  });
  private readonly more = h("p", { class: "dim" });
  private readonly closed = new Set<string>();

  constructor(
    private readonly page: Page,
    private readonly editor: Editor,
  ) {
    this.search.addEventListener("input", () => this.fill());
    this.search.addEventListener("keydown", (event) => {
      if (event.key === "Enter") this.step(1, true);
    });
    this.list.addEventListener("keydown", (event) => this.byKeys(event));
    this.element = h("section", {}, this.search, this.list, this.more);
    page.watch(["scene", "world"], () => this.fill());
    page.watch(["selected"], () => this.mark());
  }

  private fill(): void {
    const words = this.search.value.toLowerCase(),
      found = this.editor.models.filter(({ name }) => name.toLowerCase().includes(words));
    this.list.replaceChildren();
    let rows = 0;
    for (const [title, holds] of kGroups) {
      const models = found.filter(holds);
      if (models.length === 0) continue;
      const open = !this.closed.has(title),
        group = h("div", { role: "group" });
      const head = h(
        "div",
        {
          role: "treeitem",
          "aria-expanded": open,
          "aria-selected": false,
          class: "group",
          click: () => {
            if (!this.closed.delete(title)) this.closed.add(title);
            this.fill();
          },
        },
        `${open ? "▾" : "▸"} ${title} (${models.length})`,
      );
      this.list.append(head, group);
      if (!open) continue;
      for (const model of models.slice(0, Math.max(0, kMostRows - rows)))
        group.append(this.row(model));
      rows += models.length;
    }
    say(
      this.more,
      rows > kMostRows ? `${rows - kMostRows} more: narrow them down by the search` : "",
    );
    this.mark();
  }

  private row(model: ModelDescription): HTMLElement {
    return h(
      "div",
      {
        role: "treeitem",
        "aria-selected": false,
        "data-model": model.name,
        click: () => this.page.set({ selected: model.name }),
      },
      model.name,
    );
  }

  private rows(): HTMLElement[] {
    return [...this.list.querySelectorAll<HTMLElement>("[data-model]")];
  }

  private mark(): void {
    for (const row of this.rows()) {
      const is = row.dataset.model === this.page.now.selected;
      row.setAttribute("aria-selected", is ? "true" : "false");
      row.classList.toggle("on", is);
      if (is) row.scrollIntoView({ block: "nearest" });
    }
  }

  private byKeys(event: KeyboardEvent): void {
    if (event.key !== "ArrowDown" && event.key !== "ArrowUp") return;
    event.preventDefault();
    event.stopPropagation(); // elsewhere arrows drive
    this.step(event.key === "ArrowDown" ? 1 : -1, false);
  }

  private step(by: number, first: boolean): void {
    const rows = this.rows(),
      at = first ? -1 : rows.findIndex((row) => row.dataset.model === this.page.now.selected);
    const next = rows[Math.max(0, Math.min(rows.length - 1, at + by))];
    if (next) this.page.set({ selected: next.dataset.model! });
  }
}
