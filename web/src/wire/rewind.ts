// The last minutes of a live run as this page has seen them: a link that records what passes, so
// that an earlier moment can be shown while the run continues. Commands always act on the live run.

import { kTypes } from "../../generated/messages";
import { historyOf } from "./link";
import type { History, LinkHandler, RunLink } from "./protocol";
import { newestAt } from "./log_file";
import { typeOf } from "./lcm";

export const kMostBytes = 96 * 1024 * 1024,
  kMostSeconds = 180;
const kTick_ms = 33;

interface Entry {
  time: number;
  messages: Uint8Array[]; // all parts of one message
  size?: number; // bytes of the message itself, where the markers of other layers are kept with it
}
export interface Past {
  begin: number;
  end: number;
  now: number;
  playing: boolean;
  speed: number;
}

const kSizes: Record<string, number> = {
  int64_t: 8,
  double: 8,
  int32_t: 4,
  float: 4,
  int16_t: 2,
  int8_t: 1,
  byte: 1,
  boolean: 1,
};

// The offset of a field in messages of a type; -1 if it has none of that name and type, or if
// arrays, texts or structures come before it.
function offsetOf(field: string, fieldType: string, type: string): number {
  let at = 8; // the fingerprint
  for (const { name, type: of, sizes } of kTypes[type] ?? []) {
    if (name === field && of === fieldType) return at;
    const size = kSizes[of];
    if (size === undefined || sizes.length > 0) return -1;
    at += size;
  }
  return -1;
}

const kMostLayers = 64; // of markers
const utf8 = new TextDecoder();

// The layer of a markers_t: after fingerprint and utime come its length, with the terminating zero,
// and its name.
function layerOf(bytes: Uint8Array): string {
  const size = bytes.length >= 20 ? new DataView(bytes.buffer, bytes.byteOffset).getInt32(16) : 0;
  return utf8.decode(bytes.subarray(20, 19 + Math.max(1, size)));
}

// All that is drawn at that time: the newest message of each layer.
function withLayer(before: Uint8Array[], message: Uint8Array): Uint8Array[] {
  const layer = layerOf(message);
  return [...before.filter((each) => layerOf(each) !== layer), message].slice(-kMostLayers);
}

// passed to the page even while the past is shown
const kNow = new Set(["reply_t", "world_info_t"]);
const partOffsets = new Map<string, number>();

export class Rewind implements RunLink {
  private handler!: LinkHandler;
  private readonly entries = new Map<string, Entry[]>();
  // of all entries, oldest first, starting at `first`
  private readonly order: { channel: string; size: number; time: number }[] = [];
  private first = 0;
  private bytes = 0;
  private newest_s = 0;
  private epoch = -1;
  private drawn: { channel: string; messages: Uint8Array[] } | null = null; // what clients draw now
  private states = ""; // the channel of the bodies' states
  private isLive = true;
  private past: { now: number; playing: boolean; speed: number } | null = null; // null: the present is shown
  private shown = new Map<string, Entry>();
  private last_ms = 0;
  onPast: (past: Past | null, range: { begin: number; end: number }) => void = () => undefined;

  // time: s, sim time
  onKept: (channel: string, bytes: Uint8Array, time: number) => void = () => undefined;

  constructor(private readonly inner: RunLink) {
    setInterval(() => this.tick(), kTick_ms);
  }

  get range(): { begin: number; end: number } {
    return { begin: this.order[this.first]?.time ?? this.newest_s, end: this.newest_s };
  }

  connect(handler: LinkHandler): void {
    this.handler = handler;
    this.inner.connect({
      state: (link, words) => handler.state(link, words),
      hello: (hello) => {
        this.isLive = hello.mode === "live";
        this.drawn = null;
        handler.hello(hello);
      },
      scene: (number) => handler.scene(number),
      playback: (playback) => handler.playback(playback),
      events: (first, events) => handler.events(first, events),
      warnings: (first, warnings) => handler.warnings(first, warnings),
      comparison: (comparison) => handler.comparison(comparison),
      message: (channel, bytes) => this.onMessage(channel, bytes),
      traffic: (channels, messages, sizes) => handler.traffic(channels, messages, sizes),
      refused: (channel) => handler.refused(channel),
    });
  }
  want(channels: Iterable<string>): void {
    this.inner.want(channels);
  }
  watchTraffic(on: boolean): void {
    this.inner.watchTraffic(on);
  }
  command(channel: string, message: Uint8Array): boolean {
    return this.inner.command(channel, message);
  }
  play(on: boolean, speed: number): void {
    if (!this.past) return this.inner.play(on, speed);
    Object.assign(this.past, { playing: on, speed });
    this.tell();
  }
  seek(time_s: number): void {
    this.inner.seek(time_s);
  }

  // For a live run this pauses the past.
  step(ahead: boolean): void {
    if (!this.isLive) return this.inner.step(ahead);
    const states = this.entries.get(this.states) ?? [],
      now = this.past?.now ?? this.range.end,
      at = newestAt(states, now),
      isThere = states[at]?.time === now;
    const to = states[ahead ? at + 1 : isThere ? at - 1 : at];
    if (to) this.show(to.time);
  }

  // Shows that sim time, if it is kept.
  show(time_s: number): void {
    const { begin, end } = this.range,
      now = Math.max(begin, Math.min(end, time_s));
    this.past = { now, playing: false, speed: this.past?.speed ?? 1 };
    this.shown.clear();
    this.last_ms = performance.now();
    this.tell();
    this.bring();
  }

  // Back to the present.
  live(): void {
    if (!this.past) return;
    this.past = null;
    this.tell();
    for (const [channel, entries] of this.entries)
      for (const message of entries.at(-1)?.messages ?? []) this.handler.message(channel, message);
  }

  // Drops everything: it is of another run.
  clear(): void {
    this.entries.clear();
    this.order.length = this.first = this.bytes = this.newest_s = 0;
    // Its clients have not drawn it again.
    if (this.drawn) this.draw(this.drawn.channel, 0, this.drawn.messages);
    this.live();
    this.tell();
  }

  // For a live run: what is kept.
  history(channel: string, paths: string[]): Promise<History> {
    if (!this.isLive) return this.inner.history(channel, paths);
    return Promise.resolve(historyOf(this.entries.get(channel) ?? [], paths));
  }

  private onMessage(channel: string, bytes: Uint8Array): void {
    const type = typeOf(bytes);
    if (!type || kNow.has(type) || !this.isLive) return this.handler.message(channel, bytes);
    if (type === "world_state_t" || type === "tick_t") this.heed(type, bytes);
    if (type === "world_state_t") this.states = channel;
    this.onKept(channel, bytes, this.keep(channel, type, bytes));
    if (!this.past) this.handler.message(channel, bytes);
  }

  // A reset world has no past.
  private heed(type: string, bytes: Uint8Array): void {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength),
      at = offsetOf("epoch", "int32_t", type);
    if (bytes.length < at + 4) return;
    const epoch = view.getInt32(at);
    if (epoch === this.epoch) return;
    this.epoch = epoch;
    this.clear();
  }

  // Returns the message's sim time, s.
  private keep(channel: string, type: string, bytes: Uint8Array): number {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength),
      drawn = type === "markers_t", // stamped by the client's own clock
      hasTime = !drawn && kTypes[type]?.[0]?.name === "utime" && bytes.length >= 16;
    const time = hasTime ? Number(view.getBigInt64(8)) * 1e-6 : this.newest_s;
    this.newest_s = Math.max(this.newest_s, time);
    let offset = partOffsets.get(type);
    if (offset === undefined) partOffsets.set(type, (offset = offsetOf("part", "int16_t", type)));
    let entries = this.entries.get(channel);
    if (!entries) this.entries.set(channel, (entries = []));
    const last = entries.at(-1),
      later = offset >= 0 && bytes.length >= offset + 2 && view.getInt16(offset) !== 0;
    // a copy, so that a small message does not keep its whole frame alive
    const copy = bytes.slice();
    this.bytes += bytes.length;
    if (drawn) {
      this.draw(channel, time, withLayer(this.drawn?.messages ?? [], copy), bytes.length);
      this.forget();
      return time;
    }
    if (later && last) last.messages.push(copy);
    else if (last && last.time >= time)
      last.messages = [copy]; // the same moment: the newer message wins
    else {
      entries.push({ time, messages: [copy] });
      this.order.push({ channel, size: 0, time });
    }
    this.order.at(-1)!.size += bytes.length;
    this.forget();
    return time;
  }

  private draw(channel: string, time: number, messages: Uint8Array[], size = 0): void {
    this.drawn = { channel, messages };
    const entries = this.entries.get(channel) ?? [];
    this.entries.set(channel, entries);
    entries.push({ time, messages, size });
  }

  // Drawings from before the oldest kept moment are still visible: the newest version is kept.
  private forgetDrawn(): void {
    const entries = this.drawn ? this.entries.get(this.drawn.channel)! : [];
    while (entries.length > 1 && entries[1]!.time <= this.range.begin)
      this.bytes -= entries.shift()!.size ?? 0;
  }

  private forget(): void {
    while (
      this.first < this.order.length - 1 &&
      (this.bytes > kMostBytes || this.order[this.first]!.time < this.newest_s - kMostSeconds)
    ) {
      const { channel, size } = this.order[this.first++]!;
      this.entries.get(channel)?.shift();
      this.bytes -= size;
      this.forgetDrawn();
    }
    if (this.first <= 4096) return;
    this.order.splice(0, this.first);
    this.first = 0;
  }

  private tick(): void {
    const { past } = this,
      now_ms = performance.now(),
      passed_s = Math.min(0.5, (now_ms - this.last_ms) / 1000);
    this.last_ms = now_ms;
    if (past) {
      const { begin, end } = this.range;
      past.now = Math.max(
        begin,
        past.playing ? Math.min(end, past.now + passed_s * past.speed) : past.now,
      );
      past.playing &&= past.now < end;
      this.bring();
    }
    this.tell();
  }

  private bring(): void {
    if (!this.past) return;
    for (const [channel, entries] of this.entries) {
      const entry = entries[newestAt(entries, this.past.now)];
      if (!entry || this.shown.get(channel) === entry) continue;
      this.shown.set(channel, entry);
      for (const message of entry.messages) this.handler.message(channel, message);
    }
  }

  private tell(): void {
    this.onPast(this.past && { ...this.range, ...this.past }, this.range);
  }
}
