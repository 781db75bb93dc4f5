// What the program tells a page and takes from it, whether by a socket or out of the page itself.

// save: the file that SAVE writes; compared: the log beside this one; "" for none.
export interface Hello {
  mode: "live" | "log";
  title: string;
  version: string;
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
  t: number; // s, the time line's
  kind: string;
  robot: string; // "" for the whole run
  text: string;
}
// silent: it is connected, but the server does not answer.
export type LinkState = "connecting" | "open" | "silent" | "lost" | "ended";

// Where another log first differs from the one that is shown.
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

export interface LinkHandler {
  state(state: LinkState, words: string): void;
  hello(hello: Hello): void;
  scene(number: number): void; // another one is to be shown; of a log its number
  playback(playback: Playback): void;
  // What happened, from the event of that number on; from 0 on: earlier ones hold no more.
  events(first: number, events: RunEvent[]): void;
  // What differs from the other log.
  comparison(comparison: Comparison): void;
  message(channel: string, bytes: Uint8Array): void;
  traffic(channels: string[], messages: Uint32Array, sizes: Uint32Array): void;
  refused(channel: string): void;
}

// What a page has of a run: the socket's end, or a log in the page itself.
export interface RunLink {
  connect(handler: LinkHandler): void;
  want(channels: Iterable<string>): void;
  watchTraffic(on: boolean): void;
  command(channel: string, message: Uint8Array): boolean;
  play(on: boolean, speed: number): void;
  seek(time_s: number): void;
  // To the next state of the bodies, or the one before.
  step(ahead: boolean): void;
  // What is known of a field so far.
  history(channel: string, path: string): Promise<History>;
}

// A field over time, which only goes ahead: the time line's.
export interface History {
  every: number; // so many messages: 1 for all of them
  times: number[];
  values: number[];
}
