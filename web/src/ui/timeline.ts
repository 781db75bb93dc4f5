// The time line of a recorded run, or of the last minutes of a live one: play, scrub, speed.
import type { Page } from "../state/page";
import { loopedTo, shownOf, spanOf, type Shown } from "../state/time";
import { giveFocusBack, h, say } from "../widgets/elements";
import { icon, iconButton } from "../widgets/icons";
import { more } from "../widgets/more";
import { EventLane } from "./event_lane";

export interface TimelineActions {
  play(on: boolean, speed: number): void;
  seek(time_s: number): void;
  live(): void;
  step(ahead: boolean): void;
  branch(): void;
}

export class Timeline {
  private readonly slider = h("input", {
    type: "range",
    min: 0,
    max: 1,
    step: "any",
    value: 0,
    id: "scrub",
    "aria-label": "time",
  });
  private readonly time = h("span", { class: "clock", id: "logtime" });
  private readonly button: HTMLButtonElement;
  private readonly live: HTMLButtonElement;
  private readonly speed = h(
    "select",
    { "aria-label": "speed" },
    ...["0.25", "0.5", "1", "2", "5", "10"].map((value) => h("option", { value }, `× ${value}`)),
  );
  readonly lane: EventLane;
  private held = false;
  private played = false; // when it was last shown
  private lastSeek = 0;

  constructor(
    private readonly place: HTMLElement,
    private readonly page: Page,
    private readonly actions: TimelineActions,
  ) {
    this.button = iconButton("play", "play (space)", () => this.toggle());
    this.live = h(
      "button",
      { id: "live", title: "the live run (End)", click: () => actions.live() },
      "Live",
    );
    this.speed.value = "1";
    this.speed.addEventListener("change", () => {
      this.speed.blur(); // so that space plays
      actions.play(shownOf(page.now)?.playing ?? false, Number(this.speed.value));
    });
    this.slider.addEventListener("pointerdown", () => {
      this.held = true;
    });
    this.slider.addEventListener("pointerup", () => {
      this.held = false;
      this.slider.blur();
    });
    this.slider.addEventListener("change", () => {
      this.held = false;
      this.go(true);
    });
    this.slider.addEventListener("input", () => this.go(false));
    const { canvas, text, kinds, before, after, loop } = (this.lane = new EventLane(
      page,
      (time_s) => actions.seek(time_s),
    ));
    const back = iconButton("back", "the state before (,)", () => actions.step(false)),
      ahead = iconButton("step", "the next state (.)", () => actions.step(true));
    place.append(
      this.button,
      h("span", { class: "row tight" }, back, ahead),
      h("div", { class: "line" }, this.slider, canvas),
      h("div", { class: "times" }, this.time, text),
      h("span", { class: "row tight" }, before, after),
      ...more(
        "more-time",
        "loop, speed and kinds of events",
        h("span", { class: "row tight" }, kinds, loop, this.difference()),
        this.speed,
        this.branch(),
      ),
      this.live,
    );
    giveFocusBack(place);
    page.watch(["playback", "past", "kept", "hello", "span"], (state) => {
      const shown = shownOf(state);
      this.show(shown);
      const to = shown && loopedTo(page.now, shown, this.played);
      this.played = (shown?.playing ?? false) && (state.hello?.mode === "log" || !!state.past);
      if (to === null) return;
      actions.seek(to);
      actions.play(true, shown!.speed);
    });
  }

  // Shown if there is another log to compare with.
  private difference(): HTMLElement {
    const words = "the first difference",
      button = h(
        "button",
        { id: "first-difference", title: words, click: () => this.lane.goToDifference() },
        "≠",
      );
    button.setAttribute("aria-label", words);
    this.page.watch(["comparison"], ({ comparison }) => {
      button.hidden = !comparison?.first;
    });
    return button;
  }

  // Shown in the past of a run.
  private branch(): HTMLElement {
    const title = "a second run that continues from here",
      button = h("button", { id: "branch", title, click: () => this.actions.branch() }, "Branch");
    this.page.watch(["past", "hello"], ({ past, hello }) => {
      button.hidden = !past || hello?.mode !== "live";
    });
    return button;
  }

  private toggle(): void {
    const { past, kept } = this.page.now,
      shown = shownOf(this.page.now);
    if (this.page.now.hello?.mode === "live" && !past)
      this.actions.seek(kept.end); // pauses at the present moment
    else this.actions.play(!shown?.playing, Number(this.speed.value));
  }

  private go(now: boolean): void {
    if (!now && performance.now() - this.lastSeek < 50) return;
    this.lastSeek = performance.now();
    this.actions.seek(Number(this.slider.value));
  }

  private show(shown: Shown | null): void {
    const { hello, past } = this.page.now,
      isLive = hello?.mode === "live";
    // After a reset the past is empty for a moment; the layout stays.
    this.place.hidden = shown === null && (!isLive || hello.save !== "");
    this.live.hidden = !isLive;
    this.speed.hidden = isLive && !past;
    this.live.classList.toggle("on", !past);
    if (!shown) return;
    const { begin, end } = spanOf(this.page.now.span, shown);
    this.slider.min = String(begin);
    this.slider.max = String(end);
    if (!this.held) this.slider.value = String(shown.now);
    say(
      this.time,
      isLive
        ? past
          ? `${(shown.now - shown.end).toFixed(1)} s`
          : "now"
        : `${(shown.now - shown.begin).toFixed(1)} / ${(shown.end - shown.begin).toFixed(1)} s`,
    );
    const speed = String(shown.speed);
    if (![...this.speed.options].some((option) => option.value === speed))
      this.speed.append(h("option", { value: speed }, `× ${speed}`));
    if (document.activeElement !== this.speed) this.speed.value = speed;
    this.button.replaceChildren(icon(shown.playing ? "pause" : "play"));
    const title =
      isLive && !past
        ? "stop here; the run continues"
        : shown.playing
          ? "pause (space)"
          : "play (space)";
    this.button.title = title;
    this.button.setAttribute("aria-label", title);
  }
}
