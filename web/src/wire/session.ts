// Requests to the simulation, made as any client makes them: JOIN, then each request with a
// sequence number, repeated until it is answered.
import { reply_t, request_t, type state_reply_t } from "../../generated/messages";
import { decode, encode } from "./lcm";

export const kRequestChannel = "ruedo/request"; // before the world has told it
const kRepeat_ms = 200;
const kPatience_ms = 8000;
const kNothing = new Uint8Array();

interface Asked {
  kind: number;
  body: Uint8Array;
  resolve: (reply: reply_t) => void;
  reject: (error: Error) => void;
}

export class Session {
  requestChannel = "";
  private runId = 0n;
  private session = 0n;
  private sequence = 0n;
  private waiting:
    { sequence: bigint; kind: number; resolve: (reply: reply_t) => void } | undefined;
  private queue: Asked[] = [];
  private busy = false;

  constructor(private readonly publish: (channel: string, message: Uint8Array) => boolean) {}

  // A new run knows none of the old sessions.
  begin(runId: bigint, requestChannel: string): void {
    if (runId === this.runId && requestChannel === this.requestChannel) return;
    this.runId = runId;
    this.requestChannel = requestChannel;
    this.session = this.sequence = 0n;
  }

  // Resolves with the reply if the request succeeded; rejects with the reason if it did not.
  ask(kind: number, body: Uint8Array = kNothing): Promise<reply_t> {
    return new Promise((resolve, reject) => {
      this.queue.push({ kind, body, resolve, reject });
      void this.work();
    });
  }

  state(reply: reply_t): state_reply_t {
    return decode("state_reply_t", reply.body);
  }

  // Asks for ruedo/info; needs no session.
  askForInfo(): void {
    this.publish(kRequestChannel, this.request(request_t.INFO, 1n, kNothing, 0n, 0n));
  }

  onReply(bytes: Uint8Array): void {
    const reply = decode("reply_t", bytes);
    const waiting = this.waiting;
    if (!waiting || reply.sequence !== waiting.sequence || reply.kind !== waiting.kind) return;
    if (waiting.kind !== request_t.JOIN && reply.session !== this.session) return;
    waiting.resolve(reply);
  }

  private request(
    kind: number,
    sequence: bigint,
    body: Uint8Array,
    session: bigint,
    runId: bigint,
  ): Uint8Array {
    return encode("request_t", {
      utime: 0n,
      run_id: runId,
      epoch: -1,
      session,
      sequence,
      kind,
      size: body.length,
      body,
    });
  }

  private async work(): Promise<void> {
    if (this.busy) return;
    this.busy = true;
    for (let asked = this.queue.shift(); asked; asked = this.queue.shift()) {
      try {
        let reply = await this.once(asked);
        if (reply.code === reply_t.UNKNOWN_SESSION) {
          // the server has forgotten this session: join again
          this.session = 0n;
          reply = await this.once(asked);
        }
        if (reply.code === reply_t.OK) asked.resolve(reply);
        else asked.reject(new Error(reply.text || `the server answered with code ${reply.code}`));
      } catch (error) {
        asked.reject(error as Error);
      }
    }
    this.busy = false;
  }

  private async once(asked: Asked): Promise<reply_t> {
    if (!this.requestChannel) throw new Error("this simulation accepts no requests");
    if (this.session === 0n) {
      const random = crypto.getRandomValues(new Uint32Array(1))[0]! >>> 1;
      const body = encode("join_t", { client: `console-${random.toString(16)}` });
      const reply = await this.repeat(request_t.JOIN, BigInt(random) + 1n, body, 0n, 0n);
      if (reply.code !== reply_t.OK) throw new Error(reply.text);
      this.session = reply.session;
      this.sequence = 0n;
    }
    return this.repeat(asked.kind, ++this.sequence, asked.body, this.session, this.runId);
  }

  private repeat(
    kind: number,
    sequence: bigint,
    body: Uint8Array,
    session: bigint,
    runId: bigint,
  ): Promise<reply_t> {
    const message = this.request(kind, sequence, body, session, runId);
    return new Promise((resolve, reject) => {
      const begun = performance.now();
      const send = () => {
        if (performance.now() - begun > kPatience_ms) {
          clearInterval(timer);
          this.waiting = undefined;
          reject(new Error("the server does not answer"));
        } else this.publish(this.requestChannel, message);
      };
      const timer = setInterval(send, kRepeat_ms);
      this.waiting = {
        sequence,
        kind,
        resolve: (reply) => {
          clearInterval(timer);
          this.waiting = undefined;
          resolve(reply);
        },
      };
      send();
    });
  }
}
