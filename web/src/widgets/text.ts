// A message as text: one line for each member, long lists shortened.
const kFewShown = 12; // elements shown of an array, unless told

export function textOf(value: unknown, depth = 0, most = kFewShown): string {
  if (typeof value === "number")
    return Number.isInteger(value) ? String(value) : value.toPrecision(5);
  if (typeof value === "bigint" || typeof value === "boolean") return String(value);
  if (typeof value === "string") return JSON.stringify(value);
  if (value instanceof Uint8Array) return `${value.length} bytes`;
  if (ArrayBuffer.isView(value) || Array.isArray(value)) {
    const list = value as unknown as ArrayLike<unknown>;
    const shown = Array.from({ length: Math.min(list.length, most) }, (_, i) =>
      textOf(list[i], depth + 1, most),
    );
    return `[${shown.join(", ")}${list.length > most ? `, … ${list.length}` : ""}]`;
  }
  const members = Object.entries(value as object).map(
    ([name, inner]) => `${name}: ${textOf(inner, depth + 1, most)}`,
  );
  return depth > 0 ? `{${members.join(", ")}}` : members.join("\n");
}
