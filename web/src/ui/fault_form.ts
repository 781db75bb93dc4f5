// Faults of the chosen robot: what breaks, how much, for how long. They act at once, and are inputs
// like commands: in the log, and repeated with it.
import type { fault_t } from "../../generated/messages";
import { h, say, toast } from "../widgets/elements";

type Of = "device" | "wheels" | "robot";
interface Kind {
  name: string;
  of: Of;
  value?: { min: number; max: number; start: number; unit: string };
}
// As src/world/model/fault.cpp has them; without those of the whole world and of a place.
const kKinds: Kind[] = [
  { name: "dropout", of: "device" },
  { name: "freeze", of: "device" },
  { name: "lag", of: "device", value: { min: 1e-6, max: 60, start: 0.5, unit: "s" } },
  { name: "bias", of: "device", value: { min: -1e6, max: 1e6, start: 0.1, unit: "SI, added" } },
  { name: "scale", of: "device", value: { min: -1e3, max: 1e3, start: 0.9, unit: "times" } },
  { name: "encoder_stuck", of: "wheels" },
  {
    name: "wheel_slip",
    of: "wheels",
    value: { min: 0.01, max: 0.95, start: 0.3, unit: "of the turning lost" },
  },
  {
    name: "weak_motor",
    of: "wheels",
    value: { min: 0, max: 1, start: 0.5, unit: "of the speed left" },
  },
  {
    name: "commands_lost",
    of: "robot",
    value: { min: 1e-6, max: 1, start: 0.2, unit: "probability" },
  },
  { name: "commands_late", of: "robot", value: { min: 1e-6, max: 60, start: 0.3, unit: "s" } },
];
const kLongest_s = 1e6;

export class FaultForm {
  readonly element: HTMLElement;
  private devices: string[] = [];
  private readonly kind = h(
    "select",
    { "aria-label": "fault" },
    ...kKinds.map(({ name }) => h("option", {}, name)),
  );
  private readonly target = h("select", { "aria-label": "what it is of" });
  private readonly value = h("input", { type: "number", step: "any", "aria-label": "how much" });
  private readonly unit = h("span", { class: "dim" });
  private readonly duration = h("input", {
    type: "number",
    step: 1,
    min: 0,
    max: kLongest_s,
    value: 5,
    "aria-label": "for how long, s",
    title: "0: to the end",
  });

  constructor(private readonly send: (fault: fault_t) => boolean) {
    this.kind.addEventListener("change", () => this.fill());
    this.element = h(
      "details",
      { id: "faults" },
      h("summary", {}, "Faults"),
      h("div", { class: "row" }, this.kind, this.target),
      h(
        "div",
        { class: "row" },
        this.value,
        this.unit,
        h("span", { class: "dim" }, "for"),
        this.duration,
        h("span", { class: "dim" }, "s"),
        h("button", { id: "fault", click: () => this.inject() }, "Inject"),
      ),
    );
    this.fill();
  }

  show(devices: string[]): void {
    this.devices = devices;
    this.fill();
  }

  private get chosen(): Kind {
    return kKinds[this.kind.selectedIndex] ?? kKinds[0]!;
  }

  private fill(): void {
    const { of, value } = this.chosen,
      targets = { device: this.devices, wheels: ["", "left", "right"], robot: [] }[of];
    this.target.replaceChildren(
      ...targets.map((name) => h("option", { value: name }, name || "all wheels")),
    );
    this.target.hidden = targets.length === 0;
    this.value.hidden = !value;
    say(this.unit, value?.unit ?? "");
    if (value) Object.assign(this.value, { min: value.min, max: value.max, value: value.start });
  }

  private inject(): void {
    const { name, of, value } = this.chosen,
      much = value ? this.value.valueAsNumber : 0,
      long_s = this.duration.valueAsNumber;
    if (value && !(much >= value.min && much <= value.max))
      return toast(`${name}: a number from ${value.min} to ${value.max}.`, "error");
    if (!(long_s >= 0 && long_s <= kLongest_s))
      return toast(`${name}: from 0 to ${kLongest_s} s; 0 is to the end.`, "error");
    const target = of === "robot" ? "" : this.target.value;
    const sent = this.send({
      utime: 0n,
      kind: name,
      target,
      duration: long_s,
      value: much,
      view_begin: 0,
      view_end: 1,
      x: 0,
      y: 0,
      heading: 0,
    });
    if (sent) toast(`${name}${target && ` of ${target}`}${long_s > 0 ? ` for ${long_s} s` : ""}.`);
  }
}
