// The joints of the chosen robot: their positions, and a slider for each that can be moved, between
// the joint's limits.
import type { joint_state_t } from "../../generated/messages";
import { decimals, h, say } from "../widgets/elements";
import type { JointDescription } from "../wire/description";

const kReach = Math.PI, // to both sides, of a joint without limits: rad or m
  kSteps = 500; // of a slider

interface Row {
  values: HTMLElement[];
  slider: HTMLInputElement | null;
  moved: boolean; // moved by hand: the slider no longer follows the joint
}

export interface JointActions {
  move(name: string, position: number): void; // requests a position of a joint
  canMove(): boolean; // whether the robot accepts that
  find(name: string): JointDescription | undefined;
}

export class JointTable {
  readonly element = h("table", { class: "statistics", id: "joints", hidden: true });
  private rows = new Map<string, Row>();

  constructor(private readonly joints: JointActions) {}

  clear(): void {
    this.rows.clear();
    this.element.hidden = true;
    this.element.replaceChildren();
  }

  show({ joint_name, joint_position, joint_velocity, joint_effort }: joint_state_t): void {
    const known = [...this.rows.keys()];
    if (joint_name.length !== known.length || joint_name.some((name, i) => name !== known[i]))
      this.make(joint_name);
    joint_name.forEach((name, i) => {
      const row = this.rows.get(name);
      if (!row) return;
      [joint_position, joint_velocity, joint_effort].forEach((values, column) =>
        say(row.values[column]!, decimals(values[i]!, 3)),
      );
      if (row.slider && !row.moved) row.slider.value = String(joint_position[i]);
    });
  }

  private make(names: string[]): void {
    this.clear();
    const movable = this.joints.canMove();
    const heads = ["joint", "position", "speed", "effort", "", ...(movable ? ["move"] : [])];
    this.element.append(h("tr", {}, ...heads.map((text) => h("th", {}, text))));
    for (const name of names) {
      const joint = this.joints.find(name),
        unit = joint ? (joint.slides ? "m" : "rad") : "";
      const slider = movable ? this.slider(name, unit, joint) : null;
      const row: Row = {
        values: [0, 1, 2].map(() => h("td", { class: "number" })),
        slider,
        moved: false,
      };
      slider?.addEventListener("input", () => {
        row.moved = true;
        this.joints.move(name, Number(slider.value));
      });
      this.rows.set(name, row);
      const range = slider && `${bound(slider.min)} to ${bound(slider.max)} ${unit}`;
      this.element.append(
        h(
          "tr",
          {},
          h("th", {}, ...name.split(/(?<=_)/).flatMap((part) => [part, h("wbr")])),
          ...row.values,
          h("td", { class: "dim" }, unit),
          slider && h("td", {}, slider, h("div", { class: "dim range" }, range)),
        ),
      );
    }
    this.element.hidden = names.length === 0;
  }

  private slider(name: string, unit: string, joint?: JointDescription): HTMLInputElement {
    const min = joint?.lower ?? Math.min(-kReach, (joint?.upper ?? kReach) - 2 * kReach),
      max = joint?.upper ?? Math.max(kReach, min + 2 * kReach);
    return h("input", {
      type: "range",
      min,
      max,
      step: max > min ? (max - min) / kSteps : "any",
      "aria-label": `move ${name}${unit && `, ${unit}`}`,
    });
  }
}

const bound = (value: string) => String(Number(Number(value).toPrecision(3)));
