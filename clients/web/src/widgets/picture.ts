// Pictures of a camera: JPEG as it comes, raw formats by way of a canvas.
import { image_t } from "../../generated/messages";
import { h, say } from "./elements";

export class Picture {
  readonly image = h("img", { class: "picture", alt: "" });
  readonly canvas = h("canvas", { class: "picture" });
  readonly caption = h("figcaption");
  readonly element: HTMLElement;
  private url = "";

  constructor(readonly name: string) {
    this.image.alt = `picture of ${name}`;
    this.canvas.hidden = true;
    this.element = h("figure", { "data-camera": name }, this.image, this.canvas, this.caption);
    say(this.caption, `${name}: no picture yet`);
  }

  show(message: image_t): void {
    const { width, height, pixelformat, data, row_stride } = message;
    say(
      this.caption,
      `${this.name} · ${width} × ${height} · ${(Number(message.utime) * 1e-6).toFixed(2)} s`,
    );
    const jpeg = pixelformat === image_t.PIXEL_FORMAT_MJPEG;
    this.image.hidden = !jpeg;
    this.canvas.hidden = jpeg;
    if (jpeg) {
      // At once: on a busy machine the next one comes before this one is read.
      URL.revokeObjectURL(this.url);
      this.url = URL.createObjectURL(new Blob([data as BlobPart], { type: "image/jpeg" }));
      this.image.src = this.url;
      return;
    }
    if (width <= 0 || height <= 0 || width * height > 1 << 24) return;
    this.canvas.width = width;
    this.canvas.height = height;
    const pixels = new ImageData(width, height),
      view = new DataView(data.buffer, data.byteOffset, data.byteLength);
    const stride = row_stride || data.length / height;
    for (let y = 0; y < height; ++y) {
      for (let x = 0; x < width; ++x) {
        const to = 4 * (y * width + x);
        const [r, g, b] = pixel(pixelformat, view, y * stride, x);
        pixels.data[to] = r;
        pixels.data[to + 1] = g;
        pixels.data[to + 2] = b;
        pixels.data[to + 3] = 255;
      }
    }
    this.canvas.getContext("2d")!.putImageData(pixels, 0, 0);
  }
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
