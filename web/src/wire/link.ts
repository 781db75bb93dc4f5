// The WebSocket to the server: texts, frames of messages, and requests of this page. Reconnects by
// itself.

import { valueAt } from "./fields";
import { Heartbeat } from "./heartbeat";
import { decode, typeOf } from "./lcm";
import type {
  Comparison,
  Hello,
  History,
  LinkHandler,
  Playback,
  RunEvent,
  RunLink,
  Warning,
} from "./protocol";

// From messages with their times.
export function historyOf(
  entries: { time: number; messages: Uint8Array[] }[],
  paths: string[],
): History {
  const found: History = { every: 1, times: [], columns: paths.map(() => []) };
  for (const { time, messages } of entries) {
    const row = messages[0] && rowOf(messages[0], paths);
    if (!row) continue;
    found.times.push(time);
    row.forEach((value, i) => found.columns[i]!.push(value));
  }
  return found;
}

// The last row of each message: the past is looked through again with each jump in it.
const rows = new WeakMap<Uint8Array, { of: string; row: number[] }>();

// Null unless the bytes are one whole message of a known type.
function rowOf(bytes: Uint8Array, paths: string[]): number[] | null {
  const of = paths.join(),
    kept = rows.get(bytes),
    type = typeOf(bytes);
  if (kept?.of === of) return kept.row;
  if (!type) return null;
  try {
    const message = decode(type, bytes),
      row = paths.map((path) => valueAt(message, path));
    rows.set(bytes, { of, row });
    return row;
  } catch {
    return null; // others say so
  }
}

const enum Operation {
  seen = 1,
  want = 2,
  command = 3,
  traffic = 4,
  play = 5,
  seek = 6,
  step = 7,
}
const enum Frame {
  messages = 1,
  traffic = 2,
}

const kLook_ms = 1000; // between two looks whether the server answers
const kAnswer_ms = 5000; // until the server counts as silent

export class Link implements RunLink {
  private handler!: LinkHandler;
  private socket: WebSocket | undefined;
  private channels: string[] = [];
  private wanted = new Set<string>();
  private wantsTraffic = false;
  private retry_ms = 300;
  private over = false;
  private readonly heartbeat = new Heartbeat(
    () => fetch("/icon.svg", { cache: "no-store", signal: AbortSignal.timeout(kAnswer_ms) }),
    (silent) => {
      if (this.socket?.readyState !== WebSocket.OPEN || this.over) return;
      if (silent) this.handler.state("silent", "The server does not answer. Waiting …");
      else this.handler.state("open", "");
    },
  );

  constructor() {
    setInterval(() => {
      if (this.socket?.readyState === WebSocket.OPEN && !this.over)
        void this.heartbeat.look(performance.now());
    }, kLook_ms);
  }

  connect(handler: LinkHandler): void {
    this.handler = handler;
    const address = new URL("/socket", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.channels = [];
    socket.onopen = () => {
      this.retry_ms = 300;
      this.over = false;
      this.heartbeat.restart(performance.now());
      this.wanted.clear(); // the greeting decides which channels are wanted
      this.handler.state("open", "");
      if (this.wantsTraffic) this.send([Operation.traffic, 1]);
    };
    socket.onmessage = (event: MessageEvent<ArrayBuffer | string>) => {
      this.heartbeat.heard(performance.now());
      if (typeof event.data === "string") this.onText(event.data);
      else this.onFrame(event.data);
    };
    socket.onclose = () => {
      if (this.socket !== socket) return;
      if (!this.over)
        this.handler.state("lost", "The connection to the server is lost. Trying again …");
      setTimeout(() => this.connect(handler), this.retry_ms);
      this.retry_ms = Math.min(3000, this.retry_ms * 1.5);
    };
  }

  want(channels: Iterable<string>): void {
    const wanted = new Set(channels);
    if (wanted.size === this.wanted.size && [...wanted].every((name) => this.wanted.has(name)))
      return;
    this.wanted = wanted;
    this.sendWanted();
  }

  watchTraffic(on: boolean): void {
    this.wantsTraffic = on;
    this.send([Operation.traffic, on ? 1 : 0]);
  }

  // Publishes a message on a channel, as any client would. False if there is no connection.
  command(channel: string, message: Uint8Array): boolean {
    const name = new TextEncoder().encode(channel);
    return this.send([Operation.command, name.length, ...name], message);
  }

  play(on: boolean, speed: number): void {
    const bytes = new DataView(new ArrayBuffer(8));
    bytes.setFloat64(0, speed, true);
    this.send([Operation.play, on ? 1 : 0], new Uint8Array(bytes.buffer));
  }

  seek(time_s: number): void {
    const bytes = new DataView(new ArrayBuffer(8));
    bytes.setFloat64(0, time_s, true);
    this.send([Operation.seek], new Uint8Array(bytes.buffer));
  }

  step(ahead: boolean): void {
    this.send([Operation.step, ahead ? 1 : 0]);
  }

  async history(channel: string, paths: string[]): Promise<History> {
    const place = [paths.join(), ...channel.split("/")].map(encodeURIComponent).join("/");
    const answer = await fetch(`/history/${place}`);
    if (!answer.ok) throw new Error(`${channel} is not in the log`);
    const numbers = new Float64Array(await answer.arrayBuffer()),
      width = paths.length + 1;
    const column = (at: number) =>
      Array.from(
        { length: Math.floor((numbers.length - 1) / width) },
        (_, row) => numbers[1 + row * width + at]!,
      );
    return {
      every: numbers[0] ?? 1,
      times: column(0),
      columns: paths.map((_, i) => column(i + 1)),
    };
  }

  private sendWanted(): void {
    const names = new TextEncoder().encode([...this.wanted].join("\n"));
    this.send([Operation.want], names);
  }

  private send(head: number[], rest: Uint8Array = new Uint8Array()): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    const bytes = new Uint8Array(head.length + rest.length);
    bytes.set(head);
    bytes.set(rest, head.length);
    this.socket.send(bytes);
    return true;
  }

  private onText(text: string): void {
    const said = JSON.parse(text) as {
      hello?: Hello;
      scene?: number;
      playback?: Playback;
      first?: number;
      channels?: string[];
      events?: RunEvent[];
      warnings?: Warning[];
      comparison?: Comparison;
      ended?: string;
      refused?: string;
    };
    if (said.hello) this.handler.hello(said.hello);
    if (said.scene !== undefined) this.handler.scene(said.scene);
    if (said.playback) this.handler.playback(said.playback);
    if (said.channels)
      said.channels.forEach((name, i) => {
        this.channels[said.first! + i] = name;
      });
    if (said.events) this.handler.events(said.first!, said.events);
    if (said.warnings) this.handler.warnings(said.first!, said.warnings);
    if (said.comparison) this.handler.comparison(said.comparison);
    if (said.refused !== undefined) this.handler.refused(said.refused);
    if (said.ended !== undefined) {
      this.over = true;
      this.handler.state("ended", said.ended);
    }
  }

  private onFrame(buffer: ArrayBuffer): void {
    const view = new DataView(buffer);
    if ((view.getUint32(0, true) as Frame) === Frame.traffic) {
      const count = (buffer.byteLength - 4) / 8;
      const messages = new Uint32Array(count),
        sizes = new Uint32Array(count);
      for (let i = 0; i < count; ++i) {
        messages[i] = view.getUint32(4 + 8 * i, true);
        sizes[i] = view.getUint32(8 + 8 * i, true);
      }
      this.handler.traffic(this.channels, messages, sizes);
      return;
    }
    for (let at = 4; at + 8 <= buffer.byteLength;) {
      const channel = this.channels[view.getUint32(at, true)];
      const size = view.getUint32(at + 4, true);
      if (channel !== undefined)
        this.handler.message(channel, new Uint8Array(buffer, at + 8, size));
      at += 8 + size;
    }
    // Acknowledged once the page has drawn, so that a slow page gets fewer frames instead of a
    // growing queue.
    requestAnimationFrame(() => this.send([Operation.seen]));
  }
}
