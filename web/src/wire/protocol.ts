// The messages between the server and a page, through a socket or from a log in the page itself.

// world: tells world files apart; save: the file that SAVE writes; compared: the other log; "" if
// there is none.
export interface Hello {
  mode: "live" | "log";
  title: string;
  version: string;
  world: string;
  info: string;
  fault: string;
  save: string;
  compared: string;
}
export interface Playback {
  begin: number;
  end: number;
  now: number;
  speed: number;
  playing: boolean;
  jumps: number;
}
// Something that happened in a run.
export interface RunEvent {
  t: number; // s, on the time line
  kind: string;
  robot: string; // "" for the whole run
  text: string;
}
// silent: connected, but the server does not answer.
export type LinkState = "connecting" | "open" | "silent" | "lost" | "ended";

// The first difference between the shown log and the other one.
export interface Difference {
  t: number; // s, on the time line
  channel: string;
  field: string; // "" if only one log has the message
  shown: string; // its value in the shown log, and in the other one
  other: string;
}

export interface Comparison {
  other: string; // its file's name
  same?: boolean; // no message differs
  first?: Difference;
  channels?: string[]; // those that differ
  // in both logs: the largest distance, and when
  robots: { name: string; distance: number; t: number }[];
  missing: string[]; // robots of the other log only
  extra: string[]; // robots of the shown log only
  fault: string; // why the messages could not be compared; "" if they were
}

export interface LinkHandler {
  state(state: LinkState, words: string): void;
  hello(hello: Hello): void;
  scene(number: number): void; // another scene is to be shown; for a log, its number
  playback(playback: Playback): void;
  // Events from that index on. From 0 on: earlier ones are no longer valid.
  events(first: number, events: RunEvent[]): void;
  // The program's warnings, from that index on.
  warnings(first: number, warnings: Warning[]): void;
  // The result of the comparison with the other log.
  comparison(comparison: Comparison): void;
  message(channel: string, bytes: Uint8Array): void;
  traffic(channels: string[], messages: Uint32Array, sizes: Uint32Array): void;
  refused(channel: string): void;
}

export interface Warning {
  kind: string; // "warning", "error", "unsupported" or "repaired"
  text: string;
}

// The requests of a page to a run, through a socket or to a log in the page itself.
export interface RunLink {
  connect(handler: LinkHandler): void;
  want(channels: Iterable<string>): void;
  watchTraffic(on: boolean): void;
  command(channel: string, message: Uint8Array): boolean;
  play(on: boolean, speed: number): void;
  seek(time_s: number): void;
  // To the next state of the bodies, or the previous one.
  step(ahead: boolean): void;
  // The values of fields of a channel up to now.
  history(channel: string, paths: string[]): Promise<History>;
}

// Fields of a channel over the time of the time line, ascending.
export interface History {
  every: number; // every n-th message was taken; 1 for all
  times: number[];
  columns: number[][]; // of each field its values; NaN: it had none then
}
