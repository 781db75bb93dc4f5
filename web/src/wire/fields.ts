// Numbers in messages, by the path that leads to them: "vel[0]", "points[2].depth"; or of all
// elements of an array: "min(ranges)".
import { kTypes, type Field } from "../../generated/messages";

const kFewElements = 12, // listed of an array whose length is not known
  kMostElements = 1000;
const kNumbers = new Set([
  "double",
  "float",
  "int64_t",
  "int32_t",
  "int16_t",
  "int8_t",
  "byte",
  "boolean",
]);

// The fields of a type that can be plotted: all elements that a message has; without one, of arrays
// of variable length the first few.
export function fieldsOf(type: string, message?: unknown, depth = 0): string[] {
  if (depth > 3) return [];
  const members = message as Record<string, unknown> | undefined;
  return (kTypes[type] ?? []).flatMap((field) => {
    const value = members?.[field.name],
      first: unknown =
        field.sizes.length > 0 ? (value as ArrayLike<unknown> | undefined)?.[0] : value;
    const inner = kNumbers.has(field.type)
      ? [""]
      : fieldsOf(field.type, first, depth + 1).map((path) => `.${path}`);
    if (inner.length === 0) return [];
    return places(field, members).flatMap((place) =>
      inner.map((path) => `${field.name}${place}${path}`),
    );
  });
}

function places({ sizes }: Field, members: Record<string, unknown> | undefined): string[] {
  if (sizes.length === 0) return [""];
  const count = sizes.reduce<number>(
    (product, size) =>
      product * (typeof size === "number" ? size : Number(members?.[size] ?? kFewElements)),
    1,
  );
  const most = members ? kMostElements : kFewElements;
  return Array.from({ length: Math.min(count, most) }, (_, i) => `[${i}]`);
}

// Paths that lead to all elements of an array at once.
export function arraysOf(type: string): string[] {
  return (kTypes[type] ?? [])
    .filter(({ type: of, sizes }) => sizes.length > 0 && kNumbers.has(of))
    .map(({ name }) => name);
}

// The name of an array's element in its message: that of a joint, by the joints' names; "" if it
// has none.
export function nameOf(message: unknown, path: string): string {
  const [, field, index] = /^(\w+)\[(\d+)\]$/.exec(path) ?? [],
    [stem] = field?.split("_") ?? [];
  const names = (message as Record<string, unknown> | undefined)?.[`${stem}_name`];
  const name: unknown =
    Array.isArray(names) && field !== `${stem}_name` ? names[Number(index)] : "";
  return typeof name === "string" ? name : "";
}

export const kOverAll = ["min", "max", "mean", "sum"] as const;
type Over = (typeof kOverAll)[number];

// Of the finite numbers; NaN without one.
function overAll(over: Over, values: number[]): number {
  const finite = values.filter(Number.isFinite),
    total = finite.reduce((sum, value) => sum + value, 0);
  if (finite.length === 0) return NaN;
  if (over === "sum") return total;
  if (over === "mean") return total / finite.length;
  return finite.reduce((a, b) => (over === "min" ? Math.min(a, b) : Math.max(a, b)));
}

function elementsAt(value: unknown, steps: string[]): number[] {
  if (Array.isArray(value) || ArrayBuffer.isView(value))
    return Array.from(value as ArrayLike<unknown>).flatMap((each) => elementsAt(each, steps));
  const [step, ...rest] = steps;
  if (step === undefined) return [Number(value)];
  return value === null || typeof value !== "object"
    ? []
    : elementsAt((value as Record<string, unknown>)[step], rest);
}

// The number at a path; NaN if there is none.
export function valueAt(message: unknown, path: string): number {
  const [, over, array] = /^(\w+)\((.*)\)$/.exec(path) ?? [];
  if (over && array) return overAll(over as Over, elementsAt(message, array.split(".")));
  let value: unknown = message;
  for (const step of path.split(/[.[\]]+/).filter(Boolean)) {
    if (value === null || typeof value !== "object") return NaN;
    value = (value as Record<string, unknown>)[step];
  }
  if (typeof value === "bigint" || typeof value === "boolean") return Number(value);
  return typeof value === "number" ? value : NaN;
}

export interface Statistics {
  count: number;
  min: number;
  max: number;
  mean: number;
  deviation: number; // standard deviation of the values, not of their mean
}

// Statistics of the finite values; null if there are none.
export function statisticsOf(values: Iterable<number>): Statistics | null {
  let count = 0,
    min = Infinity,
    max = -Infinity,
    mean = 0,
    squares = 0;
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    ++count;
    const away = value - mean;
    mean += away / count;
    squares += away * (value - mean);
    min = Math.min(min, value);
    max = Math.max(max, value);
  }
  return count === 0 ? null : { count, min, max, mean, deviation: Math.sqrt(squares / count) };
}

// CSV: a row for each time and a column for each series. A cell is empty if its series has no value
// at that time.
export function csvOf(names: string[], columns: [times: number[], values: number[]][]): string {
  const rows = new Map<number, (number | undefined)[]>();
  columns.forEach(([times, values], column) => {
    times.forEach((time, i) => {
      let row = rows.get(time);
      if (!row) rows.set(time, (row = []));
      row[column] = values[i];
    });
  });
  const quoted = (name: string) => (/[",\n]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name);
  const lines = [...rows.entries()]
    .sort(([a], [b]) => a - b)
    .map(([time, row]) => [time, ...names.map((_, i) => row[i] ?? "")].join(","));
  return `${["time_s", ...names.map(quoted)].join(",")}\n${lines.join("\n")}${lines.length > 0 ? "\n" : ""}`;
}
