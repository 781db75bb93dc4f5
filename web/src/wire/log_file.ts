// A recorded run that is embedded in the page: it answers as the server would, from the bytes in
// the page.
import { historyOf } from "./link";
import type { Hello, History, LinkHandler, Playback, RunEvent, RunLink } from "./protocol";
import { typeOf } from "./lcm";

interface Head {
  title: string;
  info: string;
  fault: string;
  begin: number;
  end: number;
  interval: number;
  pictures: number;
  messages: number;
  channels: string[];
  events: RunEvent[];
  scenes: { from: number; files: Record<string, [at: number, size: number]> }[];
}
interface Entry {
  time: number;
  messages: Uint8Array[];
}

const kTick_ms = 33;
const kTraffic_ms = 500;
// The longest interval between two looks at the clock that the log follows; after a longer one it
// does not jump
const kLongestPause_s = 0.5;

const bytesOf = (base64: string) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));

// The newest entry at that time; -1 if there is none yet.
export function newestAt(entries: { time: number }[], time: number): number {
  let low = 0,
    high = entries.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (entries[middle]!.time <= time) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

export class LogFile implements RunLink {
  private readonly entries: Entry[][];
  private readonly shown: number[];
  private readonly playback: Playback;
  private wanted = new Set<string>();
  private traffic = false;
  private scene = 0;
  private last_ms = 0;
  private traffic_ms = -Infinity; // when it was last reported
  private handler: LinkHandler | undefined;
  private readonly urls = new Map<number, string>(); // of files, by their offset

  // Null if the page has no log in it.
  static inPage(): LogFile | null {
    const head = document.getElementById("log"),
      bytes = document.getElementById("bytes");
    return head && bytes
      ? new LogFile(JSON.parse(head.textContent!) as Head, bytesOf(bytes.textContent!))
      : null;
  }

  constructor(
    private readonly head: Head,
    private readonly bytes: Uint8Array,
  ) {
    this.entries = head.channels.map(() => []);
    this.shown = head.channels.map(() => -1);
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    for (let at = head.messages; at + 16 <= bytes.length;) {
      const channel = view.getUint32(at, true),
        count = view.getUint32(at + 4, true),
        entry: Entry = { time: view.getFloat64(at + 8, true), messages: [] };
      at += 16;
      for (let i = 0; i < count; ++i) {
        const size = view.getUint32(at, true);
        entry.messages.push(bytes.subarray(at + 4, at + 4 + size));
        at += 4 + size;
      }
      this.entries[channel]!.push(entry);
    }
    this.playback = {
      begin: head.begin,
      end: head.end,
      now: head.begin,
      speed: 1,
      playing: true,
      jumps: 0,
    };
  }

  get note(): string {
    const { interval, pictures, fault } = this.head,
      thin = (what: string, s: number) => (s > 0 ? `${what} ${s.toFixed(2)} s apart` : "");
    const parts = [
      thin("messages", interval),
      pictures < 0 ? "no pictures" : thin("pictures", pictures),
    ].filter(Boolean);
    return [fault, parts.length > 0 ? `This page has a part of the log: ${parts.join(", ")}.` : ""]
      .filter(Boolean)
      .join(" ");
  }

  // A file of the current scene.
  file(path: string): Uint8Array<ArrayBuffer> | null {
    const place = this.head.scenes[this.scene]?.files[path];
    return place
      ? (this.bytes.slice(place[0], place[0] + place[1]) as Uint8Array<ArrayBuffer>)
      : null;
  }

  // The URL of a file, the same one for the same bytes; "" if there is no such file.
  url(path: string): string {
    const place = this.head.scenes[this.scene]?.files[path],
      bytes = this.file(path);
    if (!place || !bytes) return "";
    let url = this.urls.get(place[0]);
    if (!url) this.urls.set(place[0], (url = URL.createObjectURL(new Blob([bytes]))));
    return url;
  }

  connect(handler: LinkHandler): void {
    this.handler = handler;
    const hello: Hello = {
      mode: "log",
      title: this.head.title,
      version: "",
      world: "",
      info: this.head.info,
      fault: this.note,
      save: "",
      compared: "",
    };
    this.last_ms = performance.now();
    setTimeout(() => {
      handler.state("open", "");
      handler.hello(hello);
      this.tell();
      handler.events(0, this.head.events);
      setInterval(() => this.tick(), kTick_ms);
    });
  }

  want(channels: Iterable<string>): void {
    const wanted = new Set(channels);
    this.head.channels.forEach((name, i) => {
      if (!wanted.has(name)) this.shown[i] = -1;
    });
    this.wanted = wanted;
    queueMicrotask(() => this.show());
  }

  watchTraffic(on: boolean): void {
    this.traffic = on;
  }
  command(channel: string): boolean {
    this.handler?.refused(channel);
    return false;
  }

  play(on: boolean, speed: number): void {
    const { playback } = this;
    playback.speed = speed;
    if (on && playback.now >= playback.end) {
      playback.now = playback.begin;
      ++playback.jumps;
    }
    playback.playing = on;
    this.tell();
  }

  seek(time_s: number): void {
    this.playback.now = Math.max(this.playback.begin, Math.min(this.playback.end, time_s));
    ++this.playback.jumps;
    this.tell();
    this.show();
  }

  // By messages if the log has no states.
  step(ahead: boolean): void {
    const stateful = this.entries.find((entries) => {
        const bytes = entries[0]?.messages[0];
        return bytes && typeOf(bytes) === "world_state_t";
      }),
      entries = stateful ?? this.entries[0] ?? [];
    const { now, begin, end } = this.playback,
      at = newestAt(entries, now),
      to = ahead ? at + 1 : entries[at]?.time === now ? at - 1 : at;
    this.playback.playing = false;
    this.seek(entries[to]?.time ?? (ahead ? end : begin));
  }

  history(channel: string, paths: string[]): Promise<History> {
    const index = this.head.channels.indexOf(channel);
    return Promise.resolve(historyOf(this.entries[index] ?? [], paths));
  }

  private tell(): void {
    this.handler?.playback({ ...this.playback });
  }

  private tick(): void {
    const { playback } = this,
      now = performance.now(),
      passed_s = Math.min(kLongestPause_s, (now - this.last_ms) / 1000);
    this.last_ms = now;
    if (!playback.playing) return;
    playback.now = Math.min(playback.end, playback.now + passed_s * playback.speed);
    playback.playing = playback.now < playback.end;
    this.tell();
    this.show();
  }

  private show(): void {
    const { now } = this.playback,
      { scenes, channels } = this.head;
    const scene = Math.max(
      0,
      newestAt(
        scenes.map(({ from }) => ({ time: from })),
        now,
      ),
    );
    if (scene !== this.scene) {
      this.scene = scene;
      this.handler?.scene(scene);
    }
    channels.forEach((name, i) => {
      if (!this.wanted.has(name)) return;
      let newest = newestAt(this.entries[i]!, now);
      if (newest < 0 && name === this.head.info) newest = 0;
      if (newest === this.shown[i] || newest < 0) return;
      this.shown[i] = newest;
      for (const message of this.entries[i]![newest]?.messages ?? [])
        this.handler?.message(name, message);
    });
    if (this.traffic && performance.now() - this.traffic_ms >= kTraffic_ms) this.tellTraffic(now);
  }

  private tellTraffic(now: number): void {
    this.traffic_ms = performance.now();
    const counts = this.entries.map((entries) => newestAt(entries, now) + 1);
    const sizes = this.entries.map(
      (entries, i) => entries[counts[i]! - 1]?.messages[0]?.length ?? 0,
    );
    this.handler?.traffic(this.head.channels, Uint32Array.from(counts), Uint32Array.from(sizes));
  }
}
