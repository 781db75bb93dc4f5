// The time line: which part of a run can be shown, the events around a moment, and when a loop
// starts over.
import type { RunEvent } from "../wire/protocol";
import type { PageState, Span } from "./page";

export interface Shown {
  begin: number;
  end: number;
  now: number;
  speed: number;
  playing: boolean;
}

const kFewest_s = 0.2; // least length of a live run's past before it is offered

// Null if there is nothing to show.
export function shownOf({
  hello,
  playback,
  past,
  kept,
}: Pick<PageState, "hello" | "playback" | "past" | "kept">): Shown | null {
  if (hello?.mode === "log") return playback;
  if (past) return past;
  return kept.end - kept.begin > kFewest_s
    ? { ...kept, now: kept.end, speed: 1, playing: true }
    : null;
}

const kShortest_s = 0.05; // part of the time line that can be shown

// The part of the time line that is shown, within what there is; it follows the shown moment.
export function spanOf(span: Span | null, shown: Shown): Span {
  if (!span) return { begin: shown.begin, end: shown.end };
  const length = Math.min(span.end - span.begin, shown.end - shown.begin);
  let { begin } = span;
  if (shown.now < begin || shown.now > begin + length) begin = shown.now - length / 2;
  begin = Math.max(shown.begin, Math.min(shown.end - length, begin));
  return { begin, end: begin + length };
}

// So many times as long, with a moment in its place; null: everything.
export function zoomed(
  span: Span | null,
  shown: Shown,
  around_s: number,
  times: number,
): Span | null {
  const { begin, end } = spanOf(span, shown),
    length = Math.max(kShortest_s, times * (end - begin));
  if (length >= shown.end - shown.begin) return null;
  const share = (around_s - begin) / (end - begin);
  return { begin: around_s - share * length, end: around_s + (1 - share) * length };
}

// The next event; of several at the same time, the first. Null if there is none.
export function eventAfter(events: readonly RunEvent[], now_s: number): RunEvent | null {
  let found: RunEvent | null = null;
  for (const event of events) {
    if (event.t > now_s && (!found || event.t < found.t)) found = event;
  }
  return found;
}

export function eventBefore(events: readonly RunEvent[], now_s: number): RunEvent | null {
  let found: RunEvent | null = null;
  for (const event of events) {
    if (event.t < now_s && (!found || event.t > found.t)) found = event;
  }
  return found;
}

// Where looping playback continues; null: no jump.
export function loopedTo(
  { loop, marks }: Pick<PageState, "loop" | "marks">,
  { begin, end, now }: Shown,
  played: boolean,
): number | null {
  if (!loop || !played) return null;
  const from = Math.max(begin, marks.begin ?? begin),
    to = Math.min(end, marks.end ?? end);
  return from < to && now >= to ? from : null;
}
