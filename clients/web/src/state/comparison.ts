// Another log beside the one that is shown: what differs, as the program found it.
import type { Comparison, Difference, RunEvent } from "../wire/protocol";

export const kStates = "compared/ruedo/world"; // the other run's, as a channel
export const apartChannel = (robot: string) => `compared/${robot}`; // with distance and angle
export const isCompared = (channel: string) => channel.startsWith("compared/");

export function wordsOf({ channel, field, shown, other }: Difference, name: string): string {
  return `${channel}${field ? ` ${field}` : ""}: ${shown}, in ${name} ${other}`;
}

// The first difference as something that happened.
export function eventOf(comparison: Comparison | null): RunEvent | null {
  if (!comparison?.first) return null;
  const { first, other } = comparison;
  return { t: first.t, kind: "difference", robot: "", text: wordsOf(first, other) };
}
