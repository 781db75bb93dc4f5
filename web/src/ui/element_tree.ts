// All elements of the selected model's text as a tree. An element without children is a field.
import { attributeOf, textIn, withText } from "../edit/properties";
import { topModel, type Place } from "../edit/sdf";
import { h } from "../widgets/elements";

export class ElementTree {
  readonly element: HTMLDetailsElement;
  private readonly body = h("div");
  private readonly opened = new Set<string>(["link"]); // names of elements
  private xml: string | null = null;

  // change: asks for another text of the model; called with what changes.
  constructor(private readonly change: (what: string, by: (xml: string) => string) => void) {
    this.element = h(
      "details",
      { id: "elements", hidden: true },
      h("summary", {}, "All elements"),
      this.body,
    );
    this.element.addEventListener("toggle", ({ target }) => {
      if (target === this.element) this.draw();
    });
  }

  // null: there is no text to change.
  show(xml: string | null): void {
    this.element.hidden = xml === null;
    if (xml === this.xml) return; // it may be edited just now
    this.xml = xml;
    this.draw();
  }

  // Anew: what was entered is refused.
  draw(): void {
    const isShown = this.xml !== null && this.element.open;
    this.body.replaceChildren(...(isShown ? this.branches(topModel(this.xml!), []) : []));
  }

  // The model's own pose is a number above.
  private branches({ children }: Place, path: number[]): HTMLElement[] {
    return children.flatMap((place, i) =>
      path.length === 0 && place.name === "pose" ? [] : [this.branch(place, [...path, i])],
    );
  }

  private branch(place: Place, path: number[]): HTMLElement {
    const { name, children, tag } = place,
      words = [name, attributeOf(tag, "name")].filter(Boolean).join(" "),
      text = textIn(this.xml!, place);
    if (children.length > 0) {
      const open = this.opened.has(name),
        branch = h("details", { open }, h("summary", {}, words), ...this.branches(place, path));
      branch.addEventListener("toggle", () =>
        branch.open ? this.opened.add(name) : this.opened.delete(name),
      );
      return branch;
    }
    const label = h("span", { class: "dim" }, words);
    if (text === null) return h("div", { class: "row" }, label);
    const field = h("input", { "data-element": name, value: text });
    field.addEventListener("change", () =>
      this.change(name, (xml) => withText(xml, path, field.value)),
    );
    return h("label", { class: "row property" }, label, field);
  }
}
