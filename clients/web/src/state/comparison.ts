// Another log beside the one that is shown: what differs, as the program found it.
import type { RunEvent } from "../wire/link";

export interface Difference {
  t: number; // s, the time line's
  channel: string;
  field: string; // "" where a message is in one log only
  shown: string; // its value in the log that is shown, and in the other one
  other: string;
}

export interface Comparison {
  other: string; // its file's name
  same?: boolean; // no message differs
  first?: Difference;
  channels?: string[]; // that differ
  robots: { name: string; distance: number; t: number }[]; // of both: how far apart at most, when
  missing: string[]; // robots of the other log alone
  extra: string[]; // and of the one that is shown
  fault: string; // why messages were not compared
}

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
