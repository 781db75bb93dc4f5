// Where the bodies are at the display's rate: interpolated between the last two states, one
// interval behind the newest.
import type { world_state_t } from "../../generated/messages";

const kMostBodies = 1_000_000;
const kSeen = 1e-4; // m, or of a quaternion's components: smaller motions cannot be seen
const kJump_m = 1.5; // a longer way in one interval is a jump, not motion

export class Poses {
  size = 0; // bodies known
  now = new Float32Array(0); // x, y, z, qw, qx, qy, qz of each body
  utime = 0; // us, of the newest state
  private from = new Float32Array(0);
  to = new Float32Array(0); // of the newest state
  private seen = new Float32Array(0); // `now` when motion was last reported
  known = new Uint8Array(0);
  private arrived = 0; // when the newest state came
  private interval = 33; // between two states, smoothed
  private shown = -Infinity; // the moment that `now` is for
  private begun = 0; // when the motion from `from` to `to` began
  private epoch = -1;
  private jumped = false;
  settled = false;

  // The next state is of another moment: nothing is interpolated.
  jump(): void {
    this.jumped = true;
  }

  // Something else is drawn from now on: report motion once more.
  forgetSeen(): void {
    this.settled = false;
    this.seen.fill(Infinity);
  }

  // A body that is gone. Another may come in its place.
  forget(body: number): void {
    if (body >= 0 && body < this.size) this.known[body] = 0;
  }

  private grow(size: number): void {
    if (size <= this.size) return;
    const larger = (old: Float32Array) => {
      const next = new Float32Array(7 * size);
      next.set(old);
      return next;
    };
    this.now = larger(this.now);
    this.from = larger(this.from);
    this.to = larger(this.to);
    this.seen = larger(this.seen);
    const known = new Uint8Array(size);
    known.set(this.known);
    this.known = known;
    this.size = size;
  }

  // A state, or one part of it.
  add(state: world_state_t, at_ms: number): void {
    let highest = -1;
    for (const index of state.index) highest = Math.max(highest, index);
    if (highest >= kMostBodies) throw new RangeError(`body ${highest} of ${kMostBodies} at most`);
    this.grow(highest + 1);
    const utime = Number(state.utime);
    const fresh = state.epoch !== this.epoch || utime < this.utime || this.jumped;
    if (state.part === 0) {
      if (!fresh && at_ms > this.arrived)
        this.interval += 0.2 * (Math.min(500, at_ms - this.arrived) - this.interval);
      this.arrived = at_ms;
      // Motion starts at the last frame, not at this message: the next frame's timestamp may be
      // earlier than this moment, and it would repeat the last picture.
      this.begun = Math.min(at_ms, Math.max(this.shown, at_ms - this.interval));
      this.from.set(this.now);
    }
    if (state.part === state.nparts - 1) this.jumped = false;
    this.epoch = state.epoch;
    this.utime = utime;
    this.settled = false;
    for (let i = 0; i < state.index.length; ++i) {
      const body = state.index[i]!,
        at = 7 * body;
      for (let k = 0; k < 3; ++k) this.to[at + k] = state.position[3 * i + k]!;
      for (let k = 0; k < 4; ++k) this.to[at + 3 + k] = state.orientation[4 * i + k]!;
      const moved = Math.hypot(
        this.to[at]! - this.from[at]!,
        this.to[at + 1]! - this.from[at + 1]!,
        this.to[at + 2]! - this.from[at + 2]!,
      );
      if (fresh || !this.known[body] || moved > kJump_m)
        this.from.set(this.to.subarray(at, at + 7), at);
      this.known[body] = 1;
    }
  }

  // Moves `now` to that time; false if nothing has moved visibly since motion was last reported.
  advance(at_ms: number): boolean {
    if (this.settled) return false;
    const { from, to, now, begun, arrived, interval } = this;
    const t = Math.max(0, Math.min(1, (at_ms - begun) / (arrived + interval - begun)));
    this.shown = at_ms;
    for (let at = 0; at < now.length; at += 7) {
      for (let k = 0; k < 3; ++k) now[at + k] = from[at + k]! + t * (to[at + k]! - from[at + k]!);
      let dot = 0;
      for (let k = 3; k < 7; ++k) dot += from[at + k]! * to[at + k]!;
      const sign = dot < 0 ? -1 : 1;
      let norm = 0;
      for (let k = 3; k < 7; ++k) {
        const value = sign * from[at + k]! + t * (to[at + k]! - sign * from[at + k]!);
        now[at + k] = value;
        norm += value * value;
      }
      const scale = norm > 0 ? 1 / Math.sqrt(norm) : 1;
      for (let k = 3; k < 7; ++k) now[at + k]! *= scale;
    }
    if (t >= 1) this.settled = true;
    const moved = now.some((value, i) => Math.abs(value - this.seen[i]!) > kSeen);
    if (moved) this.seen.set(now);
    return moved;
  }
}
