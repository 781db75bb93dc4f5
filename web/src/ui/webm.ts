// A browser records WebM as if it never ended: the file has no duration, and players show none and
// cannot seek. This writes it into the head of the file.
//
// WebM is EBML (RFC 8794): elements of an id, a size and the content. Browsers write a segment of
// unknown size, so that its first element may grow.
const kInfo = [0x15, 0x49, 0xa9, 0x66],
  kScale = [0x2a, 0xd7, 0xb1], // ns per unit of the times
  kDuration = [0x44, 0x89];
const kDefaultScale_ns = 1e6;
const kLongestHead = 1024; // bytes, in which the element is

// Unchanged if the bytes are not as expected.
export async function withDuration(video: Blob, duration_s: number): Promise<Blob> {
  const head = new Uint8Array(await video.slice(0, kLongestHead).arrayBuffer()),
    found = find(head, kInfo, 0, head.length);
  if (!found || found.end > head.length || find(head, kDuration, found.begin, found.end))
    return video;
  const scale = find(head, kScale, found.begin, found.end),
    scale_ns = scale
      ? head.slice(scale.begin, scale.end).reduce((n, byte) => 256 * n + byte, 0)
      : kDefaultScale_ns;
  const value = new DataView(new ArrayBuffer(8));
  value.setFloat64(0, (duration_s * 1e9) / scale_ns);
  const duration = [...kDuration, 0x88, ...new Uint8Array(value.buffer)],
    size = new DataView(new ArrayBuffer(8));
  size.setBigUint64(0, BigInt(found.end - found.begin + duration.length) | (1n << 56n)); // of 8 bytes
  const parts = [
    head.slice(0, found.at + kInfo.length),
    new Uint8Array(size.buffer),
    head.slice(found.begin, found.end),
    Uint8Array.from(duration),
    video.slice(found.end),
  ];
  return new Blob(parts, { type: video.type });
}

// An element: where it is, and its content.
function find(
  bytes: Uint8Array,
  id: number[],
  from: number,
  to: number,
): { at: number; begin: number; end: number } | null {
  for (let at = from; at + id.length < to; ++at) {
    if (!id.every((byte, i) => bytes[at + i] === byte)) continue;
    const first = bytes[at + id.length]!,
      width = Math.clz32(first) - 23; // bytes of the size: as many as zeros lead it, and one
    if (width > 8) return null;
    let size = first & (0xff >> width);
    for (let i = 1; i < width; ++i) size = 256 * size + (bytes[at + id.length + i] ?? 0);
    const begin = at + id.length + width;
    return { at, begin, end: begin + size };
  }
  return null;
}
