// The time line of a recorded run, and of the last minutes of a live one: play, scrub, speed.
import type { Page, PageState } from "../state/page";
import { h, say } from "./dom";
import { icon, iconButton } from "./bar";

interface Shown {
  begin: number;
  end: number;
  now: number;
  speed: number;
  playing: boolean;
}
export interface TimelineActions {
  play(on: boolean, speed: number): void;
  seek(time_s: number): void;
  live(): void;
}

const kFewest_s = 0.2; // of a live run's past, before it can be looked at

// What of it is there to be shown; null: nothing.
function shownOf({ hello, playback, past, kept }: Readonly<PageState>): Shown | null {
  if (hello?.mode === "log") return playback;
  if (past) return past;
  return kept.end - kept.begin > kFewest_s
    ? { ...kept, now: kept.end, speed: 1, playing: true }
    : null;
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
  private held = false;
  private lastSeek = 0;

  constructor(
    private readonly place: HTMLElement,
    private readonly page: Page,
    private readonly actions: TimelineActions,
  ) {
    this.button = iconButton("play", "play or pause (space)", () => this.toggle());
    this.live = h(
      "button",
      { id: "live", title: "what runs now (End)", click: () => actions.live() },
      "Live",
    );
    this.speed.value = "1";
    this.speed.addEventListener("change", () => {
      this.speed.blur(); // space is for playing
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
    place.append(this.button, this.slider, this.time, this.speed, this.live);
    page.watch(["playback", "past", "kept", "hello"], (state) => this.show(shownOf(state)));
  }

  private toggle(): void {
    const { past, kept } = this.page.now,
      shown = shownOf(this.page.now);
    if (this.page.now.hello?.mode === "live" && !past)
      this.actions.seek(kept.end); // it stands still from here on
    else this.actions.play(!shown?.playing, Number(this.speed.value));
  }

  private go(now: boolean): void {
    if (!now && performance.now() - this.lastSeek < 50) return;
    this.lastSeek = performance.now();
    this.actions.seek(Number(this.slider.value));
  }

  private show(shown: Shown | null): void {
    this.place.hidden = shown === null;
    const { hello, past } = this.page.now,
      isLive = hello?.mode === "live";
    this.live.hidden = !isLive;
    this.speed.hidden = isLive && !past;
    this.live.classList.toggle("on", !past);
    if (!shown) return;
    this.slider.min = String(shown.begin);
    this.slider.max = String(shown.end);
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
  }
}
