// A standard LCM log, made from messages as they come.
const kSync = 0xeda1da01;
const kHead_bytes = 28; // of an event, big endian: sync, number, time, lengths of channel and data
const utf8 = new TextEncoder();

export class LcmLog {
  size = 0; // bytes
  private readonly parts: Uint8Array<ArrayBuffer>[] = [];
  private first_us: number | null = null;
  private last_us = 0;
  private base_us = 0; // added to times, for sim time may begin again

  // header: log_header_t.
  constructor(private readonly header: Uint8Array) {}

  // utime: us, sim time. Times of a log do not go back.
  add(channel: string, utime: number, message: Uint8Array): void {
    this.last_us = Math.max(this.last_us, this.base_us + utime);
    this.first_us ??= this.last_us;
    const event = eventOf(this.parts.length + 1, this.last_us, channel, message);
    this.parts.push(event);
    this.size += event.length;
  }

  // Sim time begins again at 0.
  reset(): void {
    this.base_us = this.last_us;
  }

  blob(): Blob {
    const header = eventOf(0, this.first_us ?? 0, "ruedo/header", this.header);
    return new Blob([header, ...this.parts]);
  }
}

function eventOf(
  number: number,
  utime: number,
  channel: string,
  message: Uint8Array,
): Uint8Array<ArrayBuffer> {
  const name = utf8.encode(channel),
    bytes = new Uint8Array(kHead_bytes + name.length + message.length),
    view = new DataView(bytes.buffer);
  view.setUint32(0, kSync);
  view.setBigInt64(4, BigInt(number));
  view.setBigInt64(12, BigInt(Math.round(utime)));
  view.setInt32(20, name.length);
  view.setInt32(24, message.length);
  bytes.set(name, kHead_bytes);
  bytes.set(message, kHead_bytes + name.length);
  return bytes;
}
