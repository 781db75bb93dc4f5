// Driving by keyboard, gamepad and on-screen stick: each gives a share of the robot's speed and
// turn rate, sent as velocity commands ten times a second, with a stop when it is released.
import { dialogIsOpen } from "../widgets/confirm";
import { h } from "../widgets/elements";
import { isTyping } from "../widgets/typing";

const kPeriod_ms = 100;
const kKeys: Record<string, [number, number]> = {
  KeyW: [1, 0],
  ArrowUp: [1, 0],
  KeyS: [-1, 0],
  ArrowDown: [-1, 0],
  KeyA: [0, 1],
  ArrowLeft: [0, 1],
  KeyD: [0, -1],
  ArrowRight: [0, -1],
};
const kDeadZone = 0.15;

export class Drive {
  readonly stick = h(
    "div",
    {
      class: "stick",
      role: "group",
      title: "drag to drive (W A S D)",
      "aria-label": "driving stick",
    },
    h("div", { class: "knob" }),
  );
  private readonly held = new Set<string>();
  private fromStick: [number, number] = [0, 0];
  private active = false;

  // send: a share of speed ahead and of turn rate to the left, each from -1 to 1.
  constructor(private readonly send: (ahead: number, left: number) => void) {
    addEventListener("keydown", (event) => {
      if (
        !(event.code in kKeys) ||
        event.ctrlKey ||
        event.metaKey ||
        event.altKey ||
        isTyping(event.target) ||
        dialogIsOpen()
      )
        return;
      this.held.add(event.code);
      event.preventDefault();
      this.tick();
    });
    addEventListener("keyup", (event) => {
      if (this.held.delete(event.code)) this.tick();
    });
    addEventListener("blur", () => {
      this.held.clear();
      this.tick();
    });
    this.stick.addEventListener("pointerdown", (event) => {
      this.stick.setPointerCapture(event.pointerId);
      this.onStick(event);
    });
    this.stick.addEventListener("pointermove", (event) => {
      if (this.stick.hasPointerCapture(event.pointerId)) this.onStick(event);
    });
    for (const end of ["pointerup", "pointercancel"])
      this.stick.addEventListener(end, () => this.setStick(0, 0));
    setInterval(() => this.tick(), kPeriod_ms);
  }

  private onStick(event: PointerEvent): void {
    const box = this.stick.getBoundingClientRect(),
      reach = box.width / 2;
    let x = (event.clientX - box.left - reach) / reach,
      y = (event.clientY - box.top - reach) / reach;
    const length = Math.hypot(x, y);
    if (length > 1) {
      x /= length;
      y /= length;
    }
    this.setStick(-y, -x);
  }

  private setStick(ahead: number, left: number): void {
    this.fromStick = [ahead, left];
    (this.stick.firstElementChild as HTMLElement).style.transform =
      `translate(${-left * 40}px, ${-ahead * 40}px)`;
    this.tick();
  }

  private tick(): void {
    let [ahead, left] = this.fromStick;
    for (const code of this.held) {
      ahead += kKeys[code]![0];
      left += kKeys[code]![1];
    }
    for (const pad of navigator.getGamepads?.() ?? []) {
      if (!pad) continue;
      const value = (axis: number) => {
        const v = pad.axes[axis] ?? 0;
        return Math.abs(v) > kDeadZone ? v : 0;
      };
      ahead -= value(1);
      left -= value(0) || value(2);
    }
    if (dialogIsOpen()) {
      this.held.clear();
      ahead = left = 0;
    }
    const clamp = (v: number) => Math.max(-1, Math.min(1, v));
    const moving = ahead !== 0 || left !== 0;
    // One more command than needed: the stop
    if (moving || this.active) this.send(clamp(ahead), clamp(left));
    this.active = moving;
  }
}
