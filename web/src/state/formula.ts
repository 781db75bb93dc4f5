// Formulas over fields: "x - y", "min(ranges)", "derivative(pos[0])",
// "{p3at/pose pos[0]} - {p3at/odometry x}". A field without a channel is one of the series' own.
import { kOverAll } from "../wire/fields";

export interface Ref {
  channel: string;
  path: string; // as valueAt() takes it
}

export interface Formula {
  refs: Ref[];
  // The value at that time, from the values of the refs; NaN for none. To be called with ascending
  // times.
  at: Evaluate;
}

type Evaluate = (time_s: number, values: number[]) => number;

const kFunctions: Record<string, (...of: number[]) => number> = {
  abs: Math.abs,
  sqrt: Math.sqrt,
  sin: Math.sin,
  cos: Math.cos,
  atan2: Math.atan2,
  min: Math.min,
  max: Math.max,
};
const kTokens =
  /\s*(\{[^{}]+ [^{} ]+\}|\d+(?:\.\d+)?(?:e[-+]?\d+)?|[A-Za-z_]\w*(?:\[\d+\]|\.[A-Za-z_]\w*)*|[-+*/(),])/gy;

class Parser {
  readonly refs: Ref[] = [];
  private readonly tokens: string[] = [];
  private at = 0;

  constructor(
    private readonly channel: string,
    text: string,
  ) {
    kTokens.lastIndex = 0;
    let end = 0;
    for (let found = kTokens.exec(text); found; found = kTokens.exec(text)) {
      this.tokens.push(found[1]!);
      end = kTokens.lastIndex;
    }
    if (text.slice(end).trim()) throw new Error(`"${text.slice(end).trim()}" is not understood`);
  }

  whole(): Evaluate {
    const value = this.sum();
    if (this.at < this.tokens.length) throw new Error(`"${this.tokens[this.at]}" is too much`);
    return value;
  }

  private take(...wanted: string[]): string | undefined {
    const token = this.tokens[this.at];
    if (token === undefined || !wanted.includes(token)) return undefined;
    ++this.at;
    return token;
  }

  private need(token: string): void {
    if (!this.take(token)) throw new Error(`"${token}" is missing`);
  }

  private sum(): Evaluate {
    let left = this.product();
    for (let sign = this.take("+", "-"); sign; sign = this.take("+", "-")) {
      const a = left,
        b = this.product(),
        by = sign === "+" ? 1 : -1;
      left = (t, v) => a(t, v) + by * b(t, v);
    }
    return left;
  }

  private product(): Evaluate {
    let left = this.factor();
    for (let sign = this.take("*", "/"); sign; sign = this.take("*", "/")) {
      const a = left,
        b = this.factor();
      left = sign === "*" ? (t, v) => a(t, v) * b(t, v) : (t, v) => a(t, v) / b(t, v);
    }
    return left;
  }

  private factor(): Evaluate {
    if (this.take("-")) {
      const value = this.factor();
      return (t, v) => -value(t, v);
    }
    if (this.take("(")) {
      const value = this.sum();
      this.need(")");
      return value;
    }
    const token = this.tokens[this.at++];
    if (token === undefined) throw new Error("it ends too early");
    if (/^\d/.test(token)) return () => Number(token);
    if (token.startsWith("{")) return this.ref(...splitRef(token));
    if (!/^[A-Za-z_]/.test(token)) throw new Error(`"${token}" is too much`);
    return this.tokens[this.at] === "(" ? this.call(token) : this.ref(this.channel, token);
  }

  private call(name: string): Evaluate {
    this.need("(");
    const array = this.tokens[this.at]!,
      isOverAll = (kOverAll as readonly string[]).includes(name);
    // of all elements of an array, as a field of its own
    if (isOverAll && this.tokens[this.at + 1] === ")" && /^[A-Za-z_{]/.test(array)) {
      this.at += 2;
      const [channel, path] = array.startsWith("{") ? splitRef(array) : [this.channel, array];
      return this.ref(channel, `${name}(${path})`);
    }
    const of = [this.sum()];
    while (this.take(",")) of.push(this.sum());
    this.need(")");
    if (name === "derivative") return derivative(of[0]!);
    const call = kFunctions[name];
    if (!call) throw new Error(`there is no function ${name}`);
    return (t, v) => call(...of.map((each) => each(t, v)));
  }

  private ref(channel: string, path: string): Evaluate {
    let index = this.refs.findIndex((ref) => ref.channel === channel && ref.path === path);
    if (index < 0) index = this.refs.push({ channel, path }) - 1;
    return (_, values) => values[index] ?? NaN;
  }
}

function splitRef(token: string): [channel: string, path: string] {
  const space = token.lastIndexOf(" ");
  return [token.slice(1, space), token.slice(space + 1, -1)];
}

// From the value before, per second. Of several values at the same time the last one counts.
function derivative(of: Evaluate): Evaluate {
  type Sample = [time_s: number, value: number];
  let before: Sample | null = null,
    last: Sample | null = null;
  return (time_s, values) => {
    const value = of(time_s, values);
    if (!Number.isFinite(value)) return NaN;
    if (last && last[0] < time_s) before = last;
    last = [time_s, value];
    return before ? (value - before[1]) / (time_s - before[0]) : NaN;
  };
}

// Throws, with the reason, if the text is not a formula.
export function formulaOf(channel: string, text: string): Formula {
  const parser = new Parser(channel, text),
    at = parser.whole();
  if (parser.refs.length === 0) throw new Error("it has no field in it");
  return { refs: parser.refs, at };
}

interface Column {
  times: number[];
  values: number[];
}

// The formula over histories of its refs, in their order: at each time at which one of them has a
// value, with the last values of the others.
export function formulaOver({ refs, at }: Formula, columns: Column[]): Column {
  const times = [...new Set(columns.flatMap((column) => column.times))].sort((a, b) => a - b),
    next = refs.map(() => 0),
    held = refs.map(() => NaN),
    found: Column = { times: [], values: [] };
  for (const time of times) {
    columns.forEach((column, i) => {
      while (next[i]! < column.times.length && column.times[next[i]!]! <= time)
        held[i] = column.values[next[i]!++]!;
    });
    if (columns.some((_, i) => next[i] === 0)) continue; // one has none yet
    found.times.push(time);
    found.values.push(at(time, held));
  }
  return found;
}
