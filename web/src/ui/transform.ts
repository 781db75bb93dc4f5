// The selected model in numbers: its pose, its handles, duplicate and delete.
import type { Editor } from "../edit/editor";
import { numbersOf, poseFrom, samePose, type Pose7 } from "../edit/pose";
import type { Handle, Page } from "../state/page";
import { h, say } from "../widgets/elements";
import { numberField } from "../widgets/number_field";
import { remember } from "../state/memory";
import { PropertyList } from "./properties";

const kFields = [
  ["x", "m"],
  ["y", "m"],
  ["z", "m"],
  ["roll", "°"],
  ["pitch", "°"],
  ["yaw", "°"],
] as const;
const kHandles: [Handle, string, string][] = [
  ["translate", "Move", "M"],
  ["rotate", "Turn", "E"],
  ["scale", "Scale", "Z"],
];
const kSnaps = [0, 0.01, 0.05, 0.1, 0.25, 0.5, 1];

export class Transform {
  readonly element: HTMLElement;
  private readonly title = h("h2", { id: "selected" });
  private readonly fields = kFields.map(([name]) =>
    h("input", {
      type: "number",
      step: name.length === 1 ? 0.1 : 15,
      "aria-label": name,
      "data-number": name,
    }),
  );
  private readonly factors = ["x", "y", "z"].map((axis) =>
    numberField(`factor along ${axis}`, 1, { min: 0.01, max: 100, step: 0.1 }),
  );
  private readonly body: HTMLElement;

  constructor(
    private readonly page: Page,
    private readonly editor: Editor,
  ) {
    this.fields.forEach((field, i) => field.addEventListener("change", () => void this.put(i)));
    const numbers = this.fields.map((field, i) =>
      h("label", {}, h("span", { class: "dim" }, `${kFields[i]![0]}, ${kFields[i]![1]}`), field),
    );
    const scale = h("button", { id: "scale", click: () => this.scale() }, "Scale");
    this.body = h(
      "div",
      {},
      h("div", { class: "row" }, ...this.handles(), this.snap()),
      h("div", { class: "numbers" }, ...numbers),
      h("div", { class: "row" }, h("span", { class: "dim" }, "scale"), ...this.factors, scale),
      new PropertyList(page, editor).element,
      h("div", { class: "row" }, ...this.ends()),
    );
    this.element = h("section", {}, this.title, this.body);
    page.watch(["selected", "scene"], () => this.show());
  }

  private handles(): HTMLElement[] {
    const { page } = this;
    const handles = kHandles.map(([handle, name, key]) =>
      h(
        "button",
        {
          "data-handle": handle,
          title: `${name.toLowerCase()} by handles (${key})`,
          click: () => page.set({ handle }),
        },
        name,
      ),
    );
    page.watch(["handle"], ({ handle }) => {
      for (const button of handles) {
        button.classList.toggle("on", button.dataset.handle === handle);
        button.setAttribute("aria-pressed", button.dataset.handle === handle ? "true" : "false");
      }
    });
    return handles;
  }

  private snap(): HTMLElement {
    const { page } = this;
    const snap = h(
      "select",
      { "aria-label": "snap" },
      ...kSnaps.map((value) => h("option", { value }, value === 0 ? "no snap" : `snap ${value} m`)),
    );
    snap.value = String(page.now.snap_m);
    snap.addEventListener("change", () => {
      remember("snap", snap.value);
      page.set({ snap_m: Number(snap.value) });
    });
    return snap;
  }

  private ends(): HTMLElement[] {
    const { page, editor } = this,
      button = (id: string, text: string, title: string, click: () => void) =>
        h("button", { id, title, click }, text);
    return [
      button("duplicate", "Duplicate", "a copy beside it (Ctrl D)", () => {
        void editor.duplicate(page.now.selected);
      }),
      button("delete", "Delete", "take it away (Delete)", () => {
        void editor.remove(page.now.selected);
      }),
    ];
  }

  // Updates the numbers as things move, except the one that is being edited.
  show(): void {
    const { selected } = this.page.now,
      pose = this.editor.pose(selected);
    say(this.title, selected || "Nothing is selected: click a model");
    this.body.hidden = !pose;
    if (!pose) return;
    this.fields.forEach((field, i) => {
      if (field !== document.activeElement) this.fill(i, pose);
    });
  }

  private fill(i: number, pose: Pose7): void {
    const text = String(Number(numbersOf(pose)[i]!.toFixed(i < 3 ? 4 : 2)) || 0),
      field = this.fields[i]!;
    if (field.value !== text) field.value = text;
  }

  // Only the number that was edited counts: the others keep all their digits, and where the model
  // is now. Text that is not a number, or that the server refuses, is reverted.
  private async put(i: number): Promise<void> {
    const { selected } = this.page.now,
      pose = this.editor.pose(selected),
      value = this.fields[i]!.valueAsNumber;
    if (!pose) return;
    const to = poseFrom(numbersOf(pose).map((number, k) => (k === i ? value : number)));
    const isMoved =
      Number.isFinite(value) && !samePose(pose, to) && (await this.editor.move(selected, to));
    if (!isMoved && this.page.now.selected === selected)
      this.fill(i, this.editor.pose(selected) ?? pose);
  }

  private scale(): void {
    const [x, y, z] = this.factors.map((field) => Number(field.value)) as [number, number, number];
    void this.editor.scale(this.page.now.selected, [x, y, z]).then((good) => {
      if (good) for (const field of this.factors) field.value = "1";
    });
  }
}
