// The time line of a recorded run: play, scrub, speed.
import type { Page } from "../state/page";
import type { Playback } from "../wire/link";
import { h, say } from "./dom";
import { icon, iconButton } from "./bar";

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
  private readonly speed = h(
    "select",
    { "aria-label": "speed" },
    ...["0.25", "0.5", "1", "2", "5", "10"].map((value) => h("option", { value }, `× ${value}`)),
  );
  private held = false;
  private lastSeek = 0;

  constructor(
    private readonly place: HTMLElement,
    page: Page,
    play: (on: boolean, speed: number) => void,
    private readonly seek: (time_s: number) => void,
  ) {
    const playback = () => page.now.playback;
    this.button = iconButton("play", "play or pause (space)", () =>
      play(!playback()?.playing, Number(this.speed.value)),
    );
    this.speed.value = "1";
    this.speed.addEventListener("change", () => {
      this.speed.blur(); // space is for playing
      play(playback()?.playing ?? false, Number(this.speed.value));
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
    place.append(this.button, this.slider, this.time, this.speed);
    page.watch(["playback"], (state) => {
      if (state.playback) this.show(state.playback);
    });
  }

  private go(now: boolean): void {
    if (!now && performance.now() - this.lastSeek < 50) return;
    this.lastSeek = performance.now();
    this.seek(Number(this.slider.value));
  }

  private show(playback: Playback): void {
    this.place.hidden = false;
    this.slider.min = String(playback.begin);
    this.slider.max = String(playback.end);
    if (!this.held) this.slider.value = String(playback.now);
    say(
      this.time,
      `${(playback.now - playback.begin).toFixed(1)} / ${(playback.end - playback.begin).toFixed(1)} s`,
    );
    const speed = String(playback.speed);
    if (![...this.speed.options].some((option) => option.value === speed))
      this.speed.append(h("option", { value: speed }, `× ${speed}`));
    if (document.activeElement !== this.speed) this.speed.value = speed;
    this.button.replaceChildren(icon(playback.playing ? "pause" : "play"));
  }
}
