// The selected model's properties: name, whether it is fixed, colour, size and mass; and all of its
// elements.
import type { Editor } from "../edit/editor";
import {
  propertiesOf,
  withColour,
  withMass,
  withStatic,
  type Properties,
} from "../edit/properties";
import type { Size } from "../edit/sdf";
import type { Page } from "../state/page";
import { h, say, toast } from "../widgets/elements";
import { ElementTree } from "./element_tree";

const kLargest_m = 1000,
  kHeaviest_kg = 1e6;

export class PropertyList {
  readonly element: HTMLElement;
  private readonly name = h("input", { "aria-label": "name", "data-property": "name" });
  private readonly fixed = h("input", { type: "checkbox", "data-property": "static" });
  private readonly colour = h("input", {
    type: "color",
    "aria-label": "colour",
    "data-property": "colour",
  });
  private readonly mass = this.number("mass, kg", "mass", kHeaviest_kg);
  private readonly sizes = ["x", "y", "z"].map((axis) =>
    this.number(`size along ${axis}, m`, `size-${axis}`, kLargest_m),
  );
  private readonly words = h("p", { class: "dim" });
  private readonly rows: Record<"name" | "colour" | "size" | "mass" | "static", HTMLElement>;
  private readonly tree = new ElementTree((what, by) => this.change(what, by));
  private shown: Properties | null = null;
  private asked = 0;
  private pending = 0; // edits that the server has not answered yet
  // The fields being typed into: a reply to an earlier edit would revert them.
  private readonly typed = new Set<HTMLInputElement>();

  constructor(
    private readonly page: Page,
    private readonly editor: Editor,
  ) {
    const row = (label: string, ...fields: HTMLElement[]) =>
      h("div", { class: "row property" }, h("span", { class: "dim" }, label), ...fields);
    this.rows = {
      name: row("name", this.name),
      colour: row("colour", this.colour),
      size: row("size, m", ...this.sizes),
      mass: row("mass, kg", this.mass),
      static: h("label", { class: "check" }, this.fixed, "fixed: it never moves"),
    };
    this.element = h(
      "div",
      { id: "properties" },
      ...Object.values(this.rows),
      this.words,
      this.tree.element,
    );
    this.listen();
    page.watch(["selected", "scene", "shown"], () => void this.show());
  }

  private number(label: string, property: string, max: number): HTMLInputElement {
    return h("input", {
      type: "number",
      step: "any",
      min: 0,
      max,
      "aria-label": label,
      "data-property": property,
    });
  }

  private change(what: string, by: (xml: string) => string): void {
    void this.settle(this.editor.change(this.page.now.selected, what, by));
  }

  private listen(): void {
    for (const field of [this.name, this.mass, ...this.sizes]) {
      field.addEventListener("input", () => this.typed.add(field));
      for (const end of ["change", "blur"])
        field.addEventListener(end, () => this.typed.delete(field));
    }
    this.name.addEventListener("change", () => void this.rename());
    this.fixed.addEventListener("change", () => {
      const on = this.fixed.checked;
      this.change(on ? "fix" : "let move", (xml) => withStatic(xml, on));
    });
    this.colour.addEventListener("change", () => {
      const hex = this.colour.value;
      this.change("colour", (xml) => withColour(xml, hex));
    });
    this.mass.addEventListener("change", () => {
      const mass = this.mass.valueAsNumber;
      if (this.isGood(this.mass)) this.change("mass", (xml) => withMass(xml, mass));
    });
    this.sizes.forEach((field, i) =>
      field.addEventListener("change", () => {
        if (this.isGood(field)) this.resize(i, field.valueAsNumber);
      }),
    );
  }

  // Anything else is refused in words, and taken back.
  private isGood(field: HTMLInputElement): boolean {
    const value = field.valueAsNumber,
      good = value > 0 && value <= Number(field.max);
    if (!good) {
      toast(
        `${field.getAttribute("aria-label")}: a number above 0, ${field.max} at most.`,
        "error",
      );
      this.fill();
    }
    return good;
  }

  // A ball keeps its shape, and a cylinder its circle.
  private resize(axis: number, to: number): void {
    const { shape, size } = this.shown ?? {},
      { selected } = this.page.now;
    if (!size) return;
    const together =
      shape === "sphere" ? [0, 1, 2] : shape === "cylinder" && axis < 2 ? [0, 1] : [axis];
    const factors = [0, 1, 2].map((i) => (together.includes(i) ? to / size[axis]! : 1)) as Size;
    void this.settle(this.editor.scale(selected, factors));
  }

  private async rename(): Promise<void> {
    await this.settle(this.editor.rename(this.page.now.selected, this.name.value.trim()));
  }

  // Until the server has answered, the fields keep the entered values: the reply to an earlier
  // request would revert them.
  private async settle(edit: Promise<boolean>): Promise<void> {
    ++this.pending;
    const good = await edit;
    --this.pending;
    if (!good) {
      this.fill();
      this.tree.draw();
    } else if (!this.pending) await this.show();
  }

  private async show(): Promise<void> {
    const { selected, shown, hello } = this.page.now,
      asked = ++this.asked;
    this.element.hidden = !selected || !shown.has("World") || hello?.mode !== "live";
    if (this.element.hidden) return;
    const text = await this.editor.textOf(selected);
    if (asked !== this.asked || this.pending) return;
    let words = text === null ? "It has no text of its own." : "";
    this.shown = null;
    try {
      if (text !== null) this.shown = propertiesOf(text);
    } catch (error) {
      words = `${(error as Error).message}.`;
    }
    say(this.words, words);
    this.fill();
    this.tree.show(this.shown && text);
  }

  private fill(): void {
    const { shown } = this,
      { size, mass, colour } = shown ?? {};
    const put = (field: HTMLInputElement, value: string) => {
      if (!this.typed.has(field)) field.value = value;
    };
    put(this.name, this.page.now.selected);
    this.rows.name.hidden = shown === null;
    this.rows.static.hidden = shown === null;
    this.rows.colour.hidden = shown === null;
    this.rows.size.hidden = !size;
    this.rows.mass.hidden = mass === undefined || mass === null || (shown?.isStatic ?? true);
    this.fixed.checked = shown?.isStatic ?? false;
    this.colour.value = colour ?? "#808080";
    put(this.mass, mass ? String(Number(mass.toPrecision(5))) : "");
    this.sizes.forEach((field, i) =>
      put(field, size ? String(Number(size[i]!.toPrecision(6))) : ""),
    );
  }
}
