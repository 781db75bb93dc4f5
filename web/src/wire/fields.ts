// Numbers in messages, by the path that leads to them: "vel[0]", "points[2].depth".
import { kTypes, type Field } from "../../generated/messages";

const kMostElements = 12; // listed of one array
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

// The fields of a type that can be plotted; of arrays of variable length, the first few elements.
export function fieldsOf(type: string, depth = 0): string[] {
  if (depth > 3) return [];
  return (kTypes[type] ?? []).flatMap((field) => {
    const inner = kNumbers.has(field.type)
      ? [""]
      : fieldsOf(field.type, depth + 1).map((path) => `.${path}`);
    if (inner.length === 0) return [];
    return places(field).flatMap((place) => inner.map((path) => `${field.name}${place}${path}`));
  });
}

function places({ sizes }: Field): string[] {
  if (sizes.length === 0) return [""];
  const count = sizes.reduce<number>(
    (product, size) => product * (typeof size === "number" ? size : kMostElements),
    1,
  );
  return Array.from({ length: Math.min(count, kMostElements) }, (_, i) => `[${i}]`);
}

// The number at a path; NaN if there is none.
export function valueAt(message: unknown, path: string): number {
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
