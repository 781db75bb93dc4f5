// The time line: what of a run can be shown, what happened around a moment, and when what plays
// begins anew.
import type { RunEvent } from "../wire/protocol";
import type { PageState } from "./page";

export interface Shown {
  begin: number;
  end: number;
  now: number;
  speed: number;
  playing: boolean;
}

const kFewest_s = 0.2; // of a live run's past, before it can be looked at

// Null: nothing.
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

// The next one in time; of several at once the first. Null: there is none.
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

// Where what played a moment before goes on; null: as it is.
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
