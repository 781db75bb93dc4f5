// Events below the time line: a mark for each, buttons to jump between them, and the looped part of
// the run.
import { eventOf } from "../state/comparison";
import type { Page, PageState, Span } from "../state/page";
import { eventAfter, eventBefore, shownOf, spanOf, zoomed } from "../state/time";
import type { RunEvent } from "../wire/protocol";
import { iconButton } from "../widgets/icons";
import { h, say } from "../widgets/elements";

const kColours: Record<string, string> = {
  collision: "#ff2d8a",
  blocked: "#ff6b5e",
  command: "#3fb6ff",
  request: "#a08cff",
  reset: "#a08cff",
  watchdog: "#e0a800",
  goal: "#27c46b",
  refused: "#ff9d2e",
  fault: "#e53935",
  lost: "#8a8f98",
  difference: "#b58cff",
};
// half the slider's thumb: the distance of its range's ends from those of the line
const kThumb_px = 8;
const kNear_px = 6;
const kHeight_px = 14;
const kZoom = 1.25; // of one turn of the wheel

export class EventLane {
  readonly canvas = h("canvas", { class: "lane", id: "events", role: "img" });
  readonly text = h("span", { class: "event dim", id: "event", "aria-live": "polite" });
  readonly kinds = h("select", { id: "event-kind", "aria-label": "events" });
  readonly before: HTMLButtonElement;
  readonly after: HTMLButtonElement;
  readonly loop: HTMLButtonElement;

  constructor(
    private readonly page: Page,
    private readonly seek: (time_s: number) => void,
  ) {
    this.before = iconButton("before", "the event before (<)", () => this.jump(false));
    this.after = iconButton("after", "the next event (>)", () => this.jump(true));
    this.loop = iconButton("loop", "play it again and again (O; [ and ] mark a part)", () =>
      page.set({ loop: !page.now.loop }),
    );
    this.kinds.addEventListener("change", () => {
      this.kinds.blur();
      page.set({ eventKind: this.kinds.value });
    });
    this.canvas.addEventListener("pointermove", (event) => {
      const near = this.near(event.offsetX);
      this.canvas.title = near ? wordsOf(near) : "wheel: zoom; double click: everything";
    });
    this.canvas.addEventListener("click", (event) => {
      const near = this.near(event.offsetX);
      if (near) this.goTo(near);
      else this.seek(this.timeAt(event.offsetX));
    });
    this.canvas.addEventListener("wheel", (event) => this.zoom(event), { passive: false });
    this.canvas.addEventListener("dblclick", () => page.set({ span: null }));
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    page.watch(["events", "comparison"], () => this.list(this.all));
    page.watch(["loop"], ({ loop }) => {
      this.loop.classList.toggle("on", loop);
      this.loop.setAttribute("aria-pressed", String(loop));
    });
    page.watch(["events", "comparison", "eventKind", "marks", "kept", "hello", "theme"], () =>
      this.draw(),
    );
    page.watch(["playback", "past", "span"], (state) => {
      const shown = shownOf(state);
      if (!shown) return;
      const { begin, end } = spanOf(state.span, shown);
      if (begin !== this.drawn.begin || end !== this.drawn.end) this.draw();
    });
  }
  private drawn: Span = { begin: 0, end: 0 };

  // Jumps to the next event of the shown kinds, or the previous one.
  jump(ahead: boolean): void {
    const shown = shownOf(this.page.now);
    if (!shown) return;
    const to = (ahead ? eventAfter : eventBefore)(this.events, shown.now);
    if (to) this.goTo(to);
    else say(this.text, ahead ? "no later event" : "no earlier event");
  }

  // Sets the loop's begin or end to the shown moment; a second time clears it.
  mark(which: "begin" | "end"): void {
    const shown = shownOf(this.page.now);
    if (!shown) return;
    const { marks } = this.page.now,
      at = marks[which] === shown.now ? null : shown.now;
    const next = { ...marks, [which]: at };
    const turned = next.begin !== null && next.end !== null && next.begin >= next.end;
    this.page.set({ marks: turned ? { begin: null, end: null, [which]: at } : next, loop: true });
  }

  goToDifference(): void {
    const difference = eventOf(this.page.now.comparison);
    if (difference) this.goTo(difference);
  }

  private goTo(event: RunEvent): void {
    say(this.text, wordsOf(event));
    this.seek(event.t);
  }

  // Includes the first difference to the other log.
  private get all(): readonly RunEvent[] {
    const { events, comparison } = this.page.now,
      difference = eventOf(comparison);
    return difference ? [...events, difference] : events;
  }

  private get events(): readonly RunEvent[] {
    const { eventKind } = this.page.now;
    return eventKind ? this.all.filter(({ kind }) => kind === eventKind) : this.all;
  }

  private list(events: readonly RunEvent[]): void {
    const counts = new Map<string, number>();
    for (const { kind } of events) counts.set(kind, (counts.get(kind) ?? 0) + 1);
    const { eventKind } = this.page.now;
    this.kinds.replaceChildren(
      h("option", { value: "" }, `${events.length} event${events.length === 1 ? "" : "s"}`),
      ...[...counts].map(([kind, count]) => h("option", { value: kind }, `${kind}: ${count}`)),
    );
    this.kinds.value = counts.has(eventKind) ? eventKind : "";
    if (this.kinds.value !== eventKind) this.page.set({ eventKind: this.kinds.value });
    for (const element of [this.kinds, this.before, this.after])
      element.disabled = events.length === 0;
    this.canvas.setAttribute("aria-label", `${events.length} events along the time line`);
    if (events.length === 0) say(this.text, "");
  }

  private get span(): Span {
    return spanOf(this.page.now.span, shownOf(this.page.now)!);
  }

  // Shows a part of the time line, around what is under the pointer; or all of it.
  private zoom(event: WheelEvent): void {
    const shown = shownOf(this.page.now);
    if (!shown) return;
    event.preventDefault();
    const around_s = this.timeAt(event.offsetX),
      times = kZoom ** Math.sign(event.deltaY);
    this.page.set({ span: zoomed(this.page.now.span, shown, around_s, times) });
  }

  private place(time_s: number): number {
    const { begin, end } = this.span,
      share = end > begin ? (time_s - begin) / (end - begin) : 0;
    return kThumb_px + share * (this.canvas.clientWidth - 2 * kThumb_px);
  }
  private timeAt(x: number): number {
    const { begin, end } = this.span,
      share = (x - kThumb_px) / Math.max(1, this.canvas.clientWidth - 2 * kThumb_px);
    return begin + Math.max(0, Math.min(1, share)) * (end - begin);
  }

  private near(x: number): RunEvent | null {
    if (!shownOf(this.page.now)) return null;
    let found: RunEvent | null = null,
      nearest = kNear_px;
    for (const event of this.events) {
      const away = Math.abs(this.place(event.t) - x);
      if (away < nearest) [found, nearest] = [event, away];
    }
    return found;
  }

  private draw(): void {
    const shown = shownOf(this.page.now),
      width = this.canvas.clientWidth,
      context = this.canvas.getContext("2d");
    if (!shown || width === 0 || !context) return;
    const span = (this.drawn = this.span);
    const ratio = devicePixelRatio;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(kHeight_px * ratio);
    context.scale(ratio, ratio);
    this.shade(context, this.page.now, span);
    for (const { t, kind } of this.events) {
      if (t < span.begin || t > span.end) continue;
      context.fillStyle = kColours[kind] ?? kColours.lost!;
      context.fillRect(Math.round(this.place(t)) - 1, 1, 2, kHeight_px - 2);
    }
  }

  private shade(
    context: CanvasRenderingContext2D,
    { marks }: Readonly<PageState>,
    { begin, end }: { begin: number; end: number },
  ): void {
    if (marks.begin === null && marks.end === null) return;
    const from = this.place(Math.max(begin, marks.begin ?? begin)),
      to = this.place(Math.min(end, marks.end ?? end));
    context.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--accent");
    context.globalAlpha = 0.25;
    context.fillRect(from, 0, to - from, kHeight_px);
    context.globalAlpha = 1;
  }
}

const wordsOf = ({ t, robot, text }: RunEvent) =>
  `${t.toFixed(2)} s  ${robot ? `${robot}: ` : ""}${text}`;
