// The bar at the top: what runs, the clock, and the controls of the simulation.
import { clockText } from "../state/clock";
import { stateWords, type Page, type ViewMode } from "../state/page";
import { giveFocusBack, h, say } from "../widgets/elements";
import { icon, iconButton } from "../widgets/icons";
import { more } from "../widgets/more";

export interface BarActions {
  pauseOrResume(): void;
  step(): void;
  rate(rate: number): void;
  reset(): void;
  mode(mode: ViewMode): void;
  theme(): void;
  help(): void;
  panel(): void;
}

export class Bar {
  private readonly name = h("span");
  private readonly state = h("span", { class: "pill", id: "state" }, "connecting");
  private readonly clock = h("span", { class: "clock", id: "clock", title: "sim time" }, "–");
  private readonly factor = h("span", { class: "pill", title: "sim time per real time" }, "–");
  private readonly pause: HTMLButtonElement;
  private readonly stepButton: HTMLButtonElement;
  private readonly resetButton: HTMLButtonElement;
  private readonly rate = h(
    "select",
    { title: "requested sim time per real time", "aria-label": "rate" },
    // Shown until the user chooses a rate; the actual one stands beside it
    h("option", { value: "", hidden: true }, "rate"),
    ...["0.1", "0.25", "0.5", "1", "2", "5", "10", "max"].map((value) =>
      h("option", { value }, value === "max" ? "max" : `× ${value}`),
    ),
  );
  // Told by screen readers
  private readonly told = h("span", { class: "unseen", role: "status", id: "told" });
  private readonly modes = new Map<string, HTMLButtonElement>();

  constructor(
    place: HTMLElement,
    private readonly page: Page,
    actions: BarActions,
  ) {
    this.pause = iconButton("pause", "pause (space)", () => actions.pauseOrResume());
    this.pause.id = "pause";
    this.stepButton = iconButton("step", "one step while paused (.)", () => actions.step());
    this.resetButton = iconButton("reset", "reset the world (R)", () => actions.reset());
    this.rate.value = "";
    this.rate.addEventListener("change", () => this.rate.blur());
    this.rate.addEventListener("change", () =>
      actions.rate(this.rate.value === "max" ? Infinity : Number(this.rate.value)),
    );
    place.append(
      h(
        "h1",
        { class: "name" },
        h("img", {
          src: document.querySelector<HTMLLinkElement>("link[rel=icon]")!.href,
          alt: "Ruedo",
        }),
        this.name,
      ),
      this.state,
      this.told,
      h("span", { class: "grow" }),
      this.clock,
      this.pause,
      ...this.more(actions),
      iconButton("panel", "panel (P)", () => actions.panel()),
    );
    giveFocusBack(place);
    this.show();
  }

  // Less frequently used controls.
  private more(actions: BarActions): HTMLElement[] {
    const view = h("span", { class: "row", style: "flex-wrap: nowrap; gap: 4px" });
    for (const [mode, key] of [
      ["orbit", "1"],
      ["follow", "2"],
      ["top", "3"],
    ] as const) {
      const button = h(
        "button",
        { title: `${mode} view (${key})`, click: () => actions.mode(mode) },
        mode,
      );
      this.modes.set(mode, button);
      view.append(button);
    }
    return more(
      "more",
      "more",
      this.stepButton,
      this.factor,
      this.rate,
      this.resetButton,
      view,
      iconButton("theme", "dark or light (T)", () => actions.theme()),
      iconButton("help", "keys (?)", () => actions.help()),
    );
  }

  // Shows the page's state.
  private show(): void {
    const { page } = this;
    page.watch(["hello"], ({ hello }) => {
      say(this.name, hello?.title ?? "");
      if (hello?.mode === "log")
        for (const element of [this.stepButton, this.rate, this.resetButton, this.factor])
          element.remove();
    });
    page.watch(["link", "hello", "world", "paused", "playback", "past"], (state) => {
      const [words, good] = stateWords(state);
      say(this.state, words);
      this.state.className = `pill ${good === null ? "" : good ? "good" : "bad"}`;
    });
    page.watch(["paused", "hello", "world"], ({ paused, hello, world }) => {
      if (world)
        say(
          this.told,
          `${hello?.mode === "log" ? "log" : "run"} ${paused ? "paused" : "going on"}`,
        );
    });
    page.watch(["time_s", "world"], ({ time_s, world }) => {
      if (world) say(this.clock, clockText(time_s, world.step_us));
    });
    page.watch(["factor"], ({ factor }) =>
      say(
        this.factor,
        factor === null ? "–" : `× ${factor >= 9.95 ? factor.toFixed(0) : factor.toFixed(2)}`,
      ),
    );
    page.watch(["mode"], ({ mode }) => {
      for (const [name, button] of this.modes) {
        button.classList.toggle("on", name === mode);
        button.setAttribute("aria-pressed", name === mode ? "true" : "false");
      }
    });
    page.watch(["paused", "controlled", "past"], ({ paused, controlled, past }) => {
      this.pause.replaceChildren(icon(paused ? "play" : "pause"));
      const what = paused ? "go on" : "pause";
      this.pause.title = past ? `the run: ${what}` : `${what} (space)`;
      this.pause.setAttribute("aria-label", this.pause.title);
      for (const element of [this.pause, this.rate, this.resetButton])
        element.disabled = !controlled;
      this.stepButton.disabled = !controlled || !paused;
    });
  }
}
