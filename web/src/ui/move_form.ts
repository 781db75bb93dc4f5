// The form for a motion primitive: kind, distance, radius, speed, and the button that sends it.
import { move_command_t } from "../../generated/messages";
import { h, say } from "../widgets/elements";
import type { Move } from "../state/go_to";

const kFarthest = { min: -1000, max: 1000 }, // m; targets are hardly further away
  kMostTurned = { min: -36_000, max: 36_000 }; // degrees

function numberInput(label: string, more: Record<string, string | number>): HTMLInputElement {
  return h("input", {
    type: "number",
    step: 0.1,
    value: 1,
    required: "required",
    "aria-label": label,
    ...more,
  });
}

// Says what is allowed where it is not. Between its steps a number is good.
function isGood(input: HTMLInputElement): boolean {
  const { valueMissing, badInput, rangeOverflow, rangeUnderflow } = input.validity;
  const bad = valueMissing || badInput || rangeOverflow || rangeUnderflow;
  if (bad) input.reportValidity();
  return !bad;
}

// buttons: placed after the one that sends.
export function makeMoveForm(
  send: (move: Move) => unknown,
  ...buttons: HTMLElement[]
): HTMLElement {
  const kind = h(
    "select",
    { "aria-label": "motion primitive" },
    h("option", { value: move_command_t.ADVANCE }, "advance"),
    h("option", { value: move_command_t.ROTATE }, "rotate"),
    h("option", { value: move_command_t.HEADING }, "turn to heading"),
    h("option", { value: move_command_t.ARC }, "arc"),
  );
  const value = numberInput("how far", kFarthest),
    unit = h("span", { class: "dim" }, "m");
  const radius = numberInput("radius", { min: 0.05, max: 1000 }),
    radiusRow = h("label", { class: "row" }, "radius", radius, h("span", { class: "dim" }, "m"));
  const speed = numberInput("speed", { value: 0, min: 0, max: 100, title: "0: the robot's own" });
  const turns = () => Number(kind.value) !== move_command_t.ADVANCE,
    isArc = () => Number(kind.value) === move_command_t.ARC;
  radiusRow.hidden = true;
  kind.addEventListener("change", () => {
    say(unit, turns() ? "°" : "m");
    value.value = turns() ? "90" : "1";
    value.step = turns() ? "15" : "0.1";
    const { min, max } = turns() ? kMostTurned : kFarthest;
    Object.assign(value, { min, max });
    radiusRow.hidden = !isArc();
  });
  const go = () => {
    if (![value, ...(isArc() ? [radius] : []), speed].every(isGood)) return;
    send({
      kind: Number(kind.value),
      value: Number(value.value) * (turns() ? Math.PI / 180 : 1),
      radius: isArc() ? Number(radius.value) : 0,
      speed: Number(speed.value),
      acceleration: 0,
      deceleration: 0,
    });
  };
  return h(
    "div",
    { class: "row" },
    kind,
    value,
    unit,
    radiusRow,
    h("label", { class: "row" }, "speed", speed),
    h("button", { id: "move", click: go }, "Go"),
    ...buttons,
  );
}
