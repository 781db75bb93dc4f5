// The panel's page about the world: its models, the selection, tools, and things to place.
import type { Draw } from "../edit/draw";
import type { Editor } from "../edit/editor";
import type { Page, Tool } from "../state/page";
import type { Stage } from "../scene/stage";
import { h, say } from "../widgets/elements";
import { numberField } from "../widgets/number_field";
import { recall, remember } from "../state/memory";
import { makeDisplayForm } from "./display_form";
import { Library } from "./library";
import { kThings } from "../edit/things";
import { Transform } from "./transform";
import { Tree } from "./tree";

const kTools: [Tool & string, string, string][] = [
  ["select", "Select", "click a model"],
  ["wall", "Wall", "drag over the floor"],
  ["room", "Room", "drag from corner to corner"],
  ["door", "Door", "click on a wall"],
];

const kSizes = { min: 0.01, max: 100, step: 0.1 }; // m, of walls and doors

export interface DoorSize {
  width: number;
  height: number;
}

export class EditPage {
  readonly element: HTMLElement;
  readonly door: DoorSize = { width: 0.9, height: 1 };
  readonly extras = h("div"); // for further settings of the view
  readonly transform: Transform;
  readonly library: Library;

  constructor(
    private readonly page: Page,
    private readonly stage: Stage,
    private readonly editor: Editor,
    private readonly draw: Draw,
  ) {
    this.transform = new Transform(page, editor);
    this.library = new Library(page);
    const editing = h(
      "div",
      {},
      h("div", { class: "tools" }, this.saving(), this.tools()),
      this.transform.element,
      h("h2", {}, "Models"),
      new Tree(page, editor).element,
      h("h2", {}, "Place"),
      this.place(),
      this.library.element,
    );
    this.element = h("section", {}, editing, h("h2", {}, "View"), this.view());
    page.watch(["hello", "controlled"], ({ hello, controlled }) => {
      editing.hidden = hello?.mode !== "live" || !controlled;
    });
    page.watch(["shown", "hello", "world"], ({ shown, hello, world }) => {
      if (shown.has("World") && hello?.mode === "live" && world) void this.library.fill();
    });
  }

  startPlacing(): void {
    this.page.set({ tool: this.chosen() });
  }
  stop(): void {
    this.page.set({ tool: "select" });
  }

  private readonly thing = h(
    "select",
    { class: "wide", "aria-label": "what to place" },
    ...kThings.map(({ label }, i) => h("option", { value: i }, label!)),
  );
  private chosen() {
    return kThings[this.thing.selectedIndex]!;
  }

  private saving(): HTMLElement {
    const { page, editor } = this,
      button = (id: string, text: string, title: string, click: () => void) =>
        h("button", { id, title, click }, text);
    const save = button("save", "Save", "save the world (Ctrl S)", () => void editor.save());
    const copy = button(
      "save-copy",
      "Save a copy",
      "beside the file, with the next free number",
      () => void editor.saveCopy(),
    );
    const undo = button("undo", "Undo", "", () => void editor.history.undo()),
      redo = button("redo", "Redo", "", () => void editor.history.redo());
    page.watch(["hello", "edits", "saved"], ({ hello, edits, saved }) => {
      save.hidden = copy.hidden = !hello?.save;
      say(save, edits.changes === saved ? `Save to ${hello?.save}` : `Save to ${hello?.save} •`);
      undo.disabled = edits.undo === null;
      redo.disabled = edits.redo === null;
      undo.title = `take back: ${edits.undo ?? "nothing"} (Ctrl Z)`;
      redo.title = `do again: ${edits.redo ?? "nothing"} (Ctrl Y)`;
    });
    return h(
      "div",
      { class: "row" },
      save,
      copy,
      undo,
      redo,
      button(
        "settle",
        "Settle",
        "let physics go on until nothing moves",
        () => void editor.settle(),
      ),
    );
  }

  private tools(): HTMLElement {
    const { page, draw, door } = this,
      words = h("span", { class: "dim", id: "drawing" });
    const buttons = kTools.map(([tool, text, title]) =>
      h("button", { "data-tool": tool, title, click: () => page.set({ tool }) }, text),
    );
    const number = <Key extends string>(label: string, of: Record<Key, number>, key: Key) =>
      h(
        "label",
        { class: "row" },
        h("span", { class: "dim" }, `${label}, m`),
        numberField(label, of[key], kSizes, (value) => (of[key] = value)),
      );
    const walls = h(
      "div",
      { class: "row" },
      number("wall height", draw.style, "height"),
      number("thickness", draw.style, "thickness"),
    );
    const doors = h(
      "div",
      { class: "row" },
      number("door width", door, "width"),
      number("door height", door, "height"),
    );
    draw.onLength = (length) => say(words, length);
    page.watch(["tool"], ({ tool }) => {
      for (const button of buttons) {
        button.classList.toggle("on", button.dataset.tool === tool);
        button.setAttribute("aria-pressed", button.dataset.tool === tool ? "true" : "false");
      }
      walls.hidden = tool !== "wall" && tool !== "room";
      doors.hidden = tool !== "door";
      document.getElementById("canvas")!.classList.toggle("placing", tool !== "select");
    });
    return h("section", {}, h("div", { class: "row" }, ...buttons, words), walls, doors);
  }

  private place(): HTMLElement {
    const { page } = this,
      button = h(
        "button",
        {
          id: "place",
          click: () => {
            if (typeof page.now.tool === "string") this.startPlacing();
            else this.stop();
          },
        },
        "Place by click (B)",
      );
    this.thing.addEventListener("change", () => {
      if (typeof page.now.tool !== "string") this.startPlacing();
    });
    page.watch(["tool"], ({ tool }) =>
      button.classList.toggle("on", typeof tool !== "string" && kThings.includes(tool)),
    );
    return h(
      "div",
      {},
      h("div", { class: "row" }, this.thing, button),
      h("p", { class: "dim" }, "Then click on the ground."),
    );
  }

  private view(): HTMLElement {
    const { stage } = this,
      shadows = h("input", { type: "checkbox", checked: true });
    shadows.addEventListener("change", () => stage.setShadows(shadows.checked));
    const less = h("input", { type: "checkbox", checked: recall("detail") !== "full" });
    less.addEventListener("change", () => {
      remember("detail", less.checked ? "automatic" : "full");
      stage.setAutomatic(less.checked);
    });
    stage.setAutomatic(less.checked);
    const { page } = this,
      measure = h(
        "button",
        {
          id: "measure",
          title: "the way between two points that are clicked",
          click: () => page.set({ tool: page.now.tool === "measure" ? "select" : "measure" }),
        },
        "Measure",
      );
    page.watch(["tool"], ({ tool }) => measure.classList.toggle("on", tool === "measure"));
    const edges = h("input", { type: "checkbox", id: "wireframe" });
    edges.addEventListener("change", () => stage.setWireframe(edges.checked));
    return h(
      "div",
      {},
      h("label", { class: "check" }, edges, "wireframe"),
      h("label", { class: "check" }, shadows, "shadows"),
      h("label", { class: "check" }, less, "less detail where drawing is slow"),
      makeDisplayForm(page),
      h(
        "div",
        { class: "row" },
        h("button", { click: () => stage.home() }, "Whole world (Home)"),
        measure,
      ),
      this.extras,
    );
  }
}
