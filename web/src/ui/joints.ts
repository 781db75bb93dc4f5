// The joints of the chosen robot: their positions, and a slider for each that can be moved.
import type { joint_state_t } from "../../generated/messages";
import { h, say } from "../widgets/elements";

const kReach = Math.PI; // range of a slider, rad or m to both sides

interface Row {
  values: HTMLElement[];
  slider: HTMLInputElement | null;
  moved: boolean; // moved by hand: the slider no longer follows the joint
}

export class JointTable {
  readonly element = h("table", { class: "statistics", id: "joints", hidden: true });
  private rows = new Map<string, Row>();

  // move: requests a position of a joint. canMove: whether the robot accepts that.
  constructor(
    private readonly move: (joint: string, position: number) => void,
    private readonly canMove: () => boolean,
  ) {}

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
        say(row.values[column]!, values[i]!.toFixed(3)),
      );
      if (row.slider && !row.moved) row.slider.value = String(joint_position[i]);
    });
  }

  private make(names: string[]): void {
    this.clear();
    const movable = this.canMove();
    const heads = ["joint", "position", "speed", "effort", ...(movable ? ["move"] : [])];
    this.element.append(h("tr", {}, ...heads.map((text) => h("th", {}, text))));
    for (const name of names) {
      const slider = movable
        ? h("input", {
            type: "range",
            min: -kReach,
            max: kReach,
            step: 0.01,
            "aria-label": `move ${name}`,
          })
        : null;
      const row: Row = {
        values: [0, 1, 2].map(() => h("td", { class: "number" })),
        slider,
        moved: false,
      };
      slider?.addEventListener("input", () => {
        row.moved = true;
        this.move(name, Number(slider.value));
      });
      this.rows.set(name, row);
      this.element.append(
        h("tr", {}, h("th", {}, name), ...row.values, slider && h("td", {}, slider)),
      );
    }
    this.element.hidden = names.length === 0;
  }
}
