// A field of a channel, or a formula over fields, over time.
import { formulaOf, formulaOver, type Formula } from "./formula";
import { valueAt } from "../wire/fields";
import type { History } from "../wire/protocol";

const kMostPoints = 40_000; // then every second one is dropped

export class Series {
  times: number[] = [];
  values: number[] = [];
  note = ""; // what is missing; "" for nothing
  name = ""; // of an element, as that of a joint
  private formula: Formula;
  private held: number[]; // the newest value of each of the formula's fields
  private stride = 1; // every n-th value is kept
  private skipped = 0;

  // path: a field of the channel, or a formula. Throws if it is neither.
  constructor(
    readonly channel: string,
    readonly path: string,
  ) {
    this.formula = formulaOf(channel, path);
    this.held = [];
  }

  get label(): string {
    const text = this.path.includes("{") ? this.path : `${this.channel} ${this.path}`;
    return this.name ? `${text} (${this.name})` : text;
  }

  get channels(): string[] {
    return [...new Set(this.formula.refs.map(({ channel }) => channel))];
  }

  // False if nothing is new in it.
  hear(channel: string, time_s: number, message: object): boolean {
    const { refs, at } = this.formula;
    let isMine = false;
    refs.forEach((ref, i) => {
      if (ref.channel !== channel) return;
      isMine = true;
      this.held[i] = valueAt(message, ref.path);
    });
    if (!isMine || refs.some((_, i) => this.held[i] === undefined)) return false;
    this.take(time_s, at(time_s, this.held));
    return true;
  }

  private take(time_s: number, value: number): void {
    const { times, values } = this,
      last_s = times.at(-1) ?? -Infinity;
    if (time_s < last_s) return; // the past, which is here already
    if (time_s === last_s) return void (values[values.length - 1] = value);
    if (++this.skipped < this.stride) return;
    this.skipped = 0;
    times.push(time_s);
    values.push(value);
    if (times.length <= kMostPoints) return;
    this.times = times.filter((_, i) => i % 2 === 0);
    this.values = values.filter((_, i) => i % 2 === 0);
    this.stride *= 2;
  }

  // The history, followed by what has arrived meanwhile. of: for each channel its fields' history.
  async fill(of: (channel: string, paths: string[]) => Promise<History>): Promise<void> {
    const fresh = formulaOf(this.channel, this.path),
      pathsOf = (channel: string) =>
        fresh.refs.filter((ref) => ref.channel === channel).map(({ path }) => path);
    const histories = new Map(
      await Promise.all(
        this.channels.map(
          async (channel) => [channel, await of(channel, pathsOf(channel))] as const,
        ),
      ),
    );
    const { times, values } = formulaOver(
      fresh,
      fresh.refs.map(({ channel, path }) => {
        const history = histories.get(channel)!,
          at = pathsOf(channel).indexOf(path);
        return { times: history.times, values: history.columns[at] ?? [] };
      }),
    );
    const every = Math.max(...[...histories.values()].map((history) => history.every));
    if (every > 1) this.note = `1 of ${every} messages`;
    const [laterTimes, laterValues] = [this.times, this.values];
    Object.assign(this, { times, values });
    laterTimes.forEach((time_s, i) => this.take(time_s, laterValues[i]!));
  }

  clear(): void {
    this.times = [];
    this.values = [];
    this.held = [];
  }
}
