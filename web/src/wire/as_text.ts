// Messages as JSON that people write: every member of the type, and nothing else.
import { kTypes, type Field } from "../../generated/messages";

const kWhole: Record<string, [low: number, high: number]> = {
  int64_t: [-(2 ** 63), 2 ** 63],
  int32_t: [-(2 ** 31), 2 ** 31 - 1],
  int16_t: [-(2 ** 15), 2 ** 15 - 1],
  int8_t: [-(2 ** 7), 2 ** 7 - 1],
  byte: [0, 255],
};

// A message of that type with nothing in it.
export function blankOf(type: string): Record<string, unknown> {
  const blank = ({ type: of }: Field): unknown => {
    if (of === "string") return "";
    if (of === "boolean") return false;
    return kTypes[of] ? blankOf(of) : 0;
  };
  return Object.fromEntries(
    (kTypes[type] ?? []).map((field) => {
      const count = field.sizes.reduce<number>(
        (n, size) => n * (typeof size === "number" ? size : 0),
        1,
      );
      const value =
        field.sizes.length > 0 ? Array.from({ length: count }, () => blank(field)) : blank(field);
      return [field.name, value];
    }),
  );
}

// As encode() takes it. Throws, with the member's name and what is allowed. Arrays of several
// dimensions are flat.
export function checkedMessage(type: string, value: unknown, at = ""): Record<string, unknown> {
  const fields = kTypes[type] ?? [],
    path = (name: string) => (at ? `${at}.${name}` : name);
  if (typeof value !== "object" || value === null || Array.isArray(value))
    throw new Error(`${at || type} is an object { }`);
  const given = value as Record<string, unknown>;
  const odd = Object.keys(given).find((name) => !fields.some((field) => field.name === name));
  if (odd !== undefined)
    throw new Error(`${path(odd)} is not one of ${fields.map(({ name }) => name).join(", ")}`);
  const message: Record<string, unknown> = {};
  for (const field of fields) {
    if (!(field.name in given)) throw new Error(`${path(field.name)} is missing`);
    message[field.name] = checkedField(field, given[field.name], message, path(field.name));
  }
  return message;
}

function checkedField(
  { type, sizes }: Field,
  value: unknown,
  message: Record<string, unknown>,
  at: string,
): unknown {
  if (sizes.length === 0) return checkedOne(type, value, at);
  const count = sizes.reduce<number>(
    (n, size) => n * (typeof size === "number" ? size : Number(message[size])),
    1,
  );
  if (!Array.isArray(value) || value.length !== count)
    throw new Error(`${at} has ${count} elements (${sizes.join(" x ")})`);
  return value.map((each, i) => checkedOne(type, each, `${at}[${i}]`));
}

function checkedOne(type: string, value: unknown, at: string): unknown {
  if (kTypes[type]) return checkedMessage(type, value, at);
  const whole = kWhole[type];
  if (type === "string" || type === "boolean") {
    if (typeof value !== type)
      throw new Error(`${at} is a ${type === "string" ? "text" : "true or false"}`);
  } else if (typeof value !== "number") throw new Error(`${at} is a number`);
  else if (whole && !(Number.isInteger(value) && value >= whole[0] && value <= whole[1]))
    throw new Error(`${at} is a whole number from ${whole[0]} to ${whole[1]}`);
  return type === "int64_t" ? BigInt(value as number) : value;
}
