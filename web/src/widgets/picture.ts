// Camera pictures, JPEG and raw, on a canvas: the browser's cache of images would keep those that
// nobody sees any more.
import { image_t } from "../../generated/messages";
import { h, say } from "./elements";

const kMostPixels = 1 << 24;

export class Picture {
  private readonly canvas: HTMLCanvasElement;
  private readonly caption = h("figcaption");
  readonly element: HTMLElement;
  private next: Blob | null = null; // the newest JPEG, while another one is being decoded
  private reading = false;

  constructor(readonly name: string) {
    this.canvas = h("canvas", {
      class: "picture",
      role: "img",
      "aria-label": `picture of ${name}`,
      hidden: true,
    });
    this.element = h("figure", { "data-camera": name }, this.canvas, this.caption);
    say(this.caption, `${name}: no picture yet`);
  }

  show(message: image_t): void {
    const { width, height, pixelformat, data } = message;
    say(
      this.caption,
      `${this.name} · ${width} × ${height} · ${(Number(message.utime) * 1e-6).toFixed(2)} s`,
    );
    if (pixelformat === image_t.PIXEL_FORMAT_MJPEG) {
      this.next = new Blob([data as BlobPart], { type: "image/jpeg" });
      void this.read();
      return;
    }
    this.next = null;
    if (width > 0 && height > 0 && width * height <= kMostPixels)
      this.draw(width, height, (context) => context.putImageData(pixelsOf(message), 0, 0));
  }

  // One at a time; of those that arrive meanwhile, only the newest.
  private async read(): Promise<void> {
    if (this.reading) return;
    this.reading = true;
    for (let blob = this.next; blob; blob = this.next) {
      this.next = null;
      // damaged: the last picture stays
      const bitmap = await createImageBitmap(blob).catch(() => null);
      if (!bitmap) continue;
      this.draw(bitmap.width, bitmap.height, (context) => context.drawImage(bitmap, 0, 0));
      bitmap.close();
    }
    this.reading = false;
  }

  private draw(
    width: number,
    height: number,
    paint: (context: CanvasRenderingContext2D) => void,
  ): void {
    const { canvas } = this;
    if (canvas.width !== width || canvas.height !== height)
      Object.assign(canvas, { width, height });
    canvas.hidden = false;
    paint(canvas.getContext("2d")!);
  }
}

function pixelsOf({ width, height, pixelformat, data, row_stride }: image_t): ImageData {
  const pixels = new ImageData(width, height),
    view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const stride = row_stride || data.length / height;
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const [r, g, b] = pixel(pixelformat, view, y * stride, x);
      pixels.data.set([r, g, b, 255], 4 * (y * width + x));
    }
  }
  return pixels;
}

function pixel(format: number, view: DataView, row: number, x: number): [number, number, number] {
  const byte = (at: number) => (at < view.byteLength ? view.getUint8(at) : 0);
  switch (format) {
    case image_t.PIXEL_FORMAT_RGB:
      return [byte(row + 3 * x), byte(row + 3 * x + 1), byte(row + 3 * x + 2)];
    case image_t.PIXEL_FORMAT_BGR:
      return [byte(row + 3 * x + 2), byte(row + 3 * x + 1), byte(row + 3 * x)];
    case image_t.PIXEL_FORMAT_FLOAT_GRAY32: {
      // near is bright
      const depth =
        row + 4 * x + 4 <= view.byteLength ? view.getFloat32(row + 4 * x, true) : Infinity;
      const grey = Number.isFinite(depth) ? 255 / (1 + depth / 3) : 0;
      return [grey, grey, grey];
    }
    case image_t.PIXEL_FORMAT_LE_GRAY16: {
      // a colour for each label
      const label = row + 2 * x + 2 <= view.byteLength ? view.getUint16(row + 2 * x, true) : 0;
      return label === 0
        ? [0, 0, 0]
        : [((label * 97) % 200) + 55, ((label * 57) % 200) + 55, ((label * 151) % 200) + 55];
    }
    default: {
      const grey = byte(row + x);
      return [grey, grey, grey];
    }
  }
}
