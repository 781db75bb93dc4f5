// The comparison with another log, as the server made it.
import type { Comparison, Difference, RunEvent } from "../wire/protocol";

export const kStates = "compared/ruedo/world"; // the other run's states, as a channel
export const apartChannel = (robot: string) => `compared/${robot}`; // with distance and angle
export const isCompared = (channel: string) => channel.startsWith("compared/");

export function wordsOf({ channel, field, shown, other }: Difference, name: string): string {
  return `${channel}${field ? ` ${field}` : ""}: ${shown}, in ${name} ${other}`;
}

// The first difference as an event.
export function eventOf(comparison: Comparison | null): RunEvent | null {
  if (!comparison?.first) return null;
  const { first, other } = comparison;
  return { t: first.t, kind: "difference", robot: "", text: wordsOf(first, other) };
}
