// Encodes and decodes LCM messages of any type, by the description generated from proto/*.lcm.
// Arrays of several dimensions are flat, row by row.
import { kTypes, type Field, type Messages } from "../../generated/messages";

export type TypeName = keyof Messages & string;

const mask = (value: bigint) => BigInt.asIntN(64, value);
const stir = (hash: bigint, code: number) => mask(((hash << 8n) ^ (hash >> 55n)) + BigInt(code));

function stirText(hash: bigint, text: string): bigint {
  let result = stir(hash, text.length);
  for (const character of text) result = stir(result, character.charCodeAt(0));
  return result;
}

// LCM's hash of a type: of the names, primitive types and dimensions of its members, and of the
// types they contain.
function computeFingerprint(name: string, parents: string[] = []): bigint {
  if (parents.includes(name)) return 0n;
  let hash = 0x12345678n;
  let inner = 0n;
  for (const field of kTypes[name] ?? []) {
    hash = stirText(hash, field.name);
    if (kTypes[field.type]) inner += computeFingerprint(field.type, [...parents, name]);
    else hash = stirText(hash, field.type);
    hash = stir(hash, field.sizes.length);
    for (const size of field.sizes)
      hash = stirText(stir(hash, typeof size === "number" ? 0 : 1), String(size));
  }
  const sum = mask(hash + inner);
  return mask((sum << 1n) + ((sum >> 63n) & 1n));
}

const fingerprints = new Map<string, bigint>();
export function fingerprint(name: string): bigint {
  let value = fingerprints.get(name);
  if (value === undefined) fingerprints.set(name, (value = computeFingerprint(name)));
  return value;
}

// Adds types that the server knows and this page does not. Ruedo's own types are not replaced.
export function addTypes(types: Record<string, Field[]>): void {
  for (const [name, fields] of Object.entries(types)) kTypes[name] ??= fields;
  fingerprints.clear();
  typesByFingerprint = undefined;
}

let typesByFingerprint: Map<bigint, TypeName> | undefined;
export function typeOf(message: Uint8Array): TypeName | undefined {
  if (!typesByFingerprint)
    typesByFingerprint = new Map(
      Object.keys(kTypes).map((name) => [fingerprint(name), name as TypeName]),
    );
  if (message.length < 8) return undefined;
  return typesByFingerprint.get(new DataView(message.buffer, message.byteOffset).getBigInt64(0));
}

type Value = unknown;
const utf8 = new TextDecoder();

class Reader {
  at = 0;
  private readonly view: DataView;
  constructor(private readonly bytes: Uint8Array) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  one(type: string): Value {
    const { view, at } = this;
    switch (type) {
      case "boolean":
        this.at += 1;
        return view.getInt8(at) !== 0;
      case "byte":
        this.at += 1;
        return view.getUint8(at);
      case "int8_t":
        this.at += 1;
        return view.getInt8(at);
      case "int16_t":
        this.at += 2;
        return view.getInt16(at);
      case "int32_t":
        this.at += 4;
        return view.getInt32(at);
      case "int64_t":
        this.at += 8;
        return view.getBigInt64(at);
      case "float":
        this.at += 4;
        return view.getFloat32(at);
      case "double":
        this.at += 8;
        return view.getFloat64(at);
      case "string": {
        const size = view.getInt32(at);
        if (size < 1 || at + 4 + size > this.bytes.length)
          throw new RangeError("a text is longer than the message");
        this.at += 4 + size;
        return utf8.decode(this.bytes.subarray(at + 4, at + 3 + size));
      }
      default:
        return this.struct(type);
    }
  }

  private many(type: string, count: number): Value {
    if (count < 0 || count > this.bytes.length - this.at)
      throw new RangeError("an array is longer than the message");
    if (type === "byte") return this.bytes.slice(this.at, (this.at += count));
    const { view } = this;
    let at = this.at;
    if (type === "double" || type === "float" || type === "int32_t") {
      const width = type === "double" ? 8 : 4;
      if (count * width > this.bytes.length - at)
        throw new RangeError("an array is longer than the message");
      this.at += count * width;
      if (type === "double") {
        const values = new Float64Array(count);
        for (let i = 0; i < count; ++i, at += 8) values[i] = view.getFloat64(at);
        return values;
      }
      const values = type === "float" ? new Float32Array(count) : new Int32Array(count);
      for (let i = 0; i < count; ++i, at += 4)
        values[i] = type === "float" ? view.getFloat32(at) : view.getInt32(at);
      return values;
    }
    return Array.from({ length: count }, () => this.one(type));
  }

  struct(name: string): Record<string, Value> {
    const result: Record<string, Value> = {};
    for (const field of kTypes[name]!) {
      result[field.name] =
        field.sizes.length === 0
          ? this.one(field.type)
          : this.many(field.type, countOf(field, result));
    }
    return result;
  }
}

function countOf(field: Field, message: Record<string, Value>): number {
  return field.sizes.reduce<number>(
    (count, size) => count * Number(typeof size === "number" ? size : message[size]),
    1,
  );
}

// Throws RangeError if the bytes are not such a message.
export function decode<T extends TypeName>(type: T, bytes: Uint8Array): Messages[T] {
  const reader = new Reader(bytes);
  if (reader.one("int64_t") !== fingerprint(type)) throw new RangeError(`this is not a ${type}`);
  const message = reader.struct(type);
  if (reader.at !== bytes.length)
    throw new RangeError(`a ${type} with ${bytes.length - reader.at} bytes left over`);
  return message as unknown as Messages[T];
}

class Writer {
  private bytes = new Uint8Array(256);
  private view = new DataView(this.bytes.buffer);
  private size = 0;

  private room(count: number): number {
    const at = this.size;
    this.size += count;
    if (this.size > this.bytes.length) {
      const larger = new Uint8Array(Math.max(this.size, 2 * this.bytes.length));
      larger.set(this.bytes);
      this.bytes = larger;
      this.view = new DataView(larger.buffer);
    }
    return at;
  }

  one(type: string, value: Value): void {
    switch (type) {
      case "boolean": {
        const at = this.room(1);
        this.view.setInt8(at, value ? 1 : 0);
        return;
      }
      case "byte": {
        const at = this.room(1);
        this.view.setUint8(at, Number(value));
        return;
      }
      case "int8_t": {
        const at = this.room(1);
        this.view.setInt8(at, Number(value));
        return;
      }
      case "int16_t": {
        const at = this.room(2);
        this.view.setInt16(at, Number(value));
        return;
      }
      case "int32_t": {
        const at = this.room(4);
        this.view.setInt32(at, Number(value));
        return;
      }
      case "int64_t": {
        const at = this.room(8);
        this.view.setBigInt64(at, BigInt(value as bigint));
        return;
      }
      case "float": {
        const at = this.room(4);
        this.view.setFloat32(at, Number(value));
        return;
      }
      case "double": {
        const at = this.room(8);
        this.view.setFloat64(at, Number(value));
        return;
      }
      case "string": {
        const text = new TextEncoder().encode(String(value));
        const at = this.room(5 + text.length);
        this.view.setInt32(at, text.length + 1);
        this.bytes.set(text, at + 4);
        this.view.setUint8(at + 4 + text.length, 0);
        return;
      }
      default:
        this.struct(type, value as Record<string, Value>);
    }
  }

  struct(name: string, message: Record<string, Value>): void {
    for (const field of kTypes[name]!) {
      const value = message[field.name];
      if (field.sizes.length === 0) this.one(field.type, value);
      else for (const element of value as Iterable<Value>) this.one(field.type, element);
    }
  }

  take(): Uint8Array {
    return this.bytes.subarray(0, this.size);
  }
}

export function encode<T extends TypeName>(type: T, message: Messages[T]): Uint8Array {
  const writer = new Writer();
  writer.one("int64_t", fingerprint(type));
  writer.struct(type, message as unknown as Record<string, Value>);
  return writer.take();
}
