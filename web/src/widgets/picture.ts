// Camera pictures, JPEG and raw, on a canvas: the browser's cache of images would keep old
// pictures.
import { image_t } from "../../generated/messages";
import { h, say } from "./elements";

// Where a picture comes from: the kind of its device ("" where that is not known), and what its
// labels are called.
export interface Source {
  kind: string;
  nameOf(label: number): string;
}

const kMostPixels = 1 << 24;
const kMostLabels = 16; // in the legend
const kCount_K = 0.01; // of a thermal camera, unless its file says otherwise

// The kinds of pixels of a raw picture.
export type Quantity = "colour" | "depth" | "labels" | "temperature";
export function quantityOf({ pixelformat }: image_t, deviceKind = ""): Quantity {
  if (pixelformat === image_t.PIXEL_FORMAT_FLOAT_GRAY32) return "depth";
  if (pixelformat === image_t.PIXEL_FORMAT_GRAY && deviceKind === "segmentation_camera")
    return "labels";
  if (pixelformat !== image_t.PIXEL_FORMAT_LE_GRAY16) return "colour";
  return deviceKind === "thermal_camera" ? "temperature" : "labels";
}

// The value of a pixel in m or K, or its label; NaN outside of the data.
export function valueOf(picture: image_t, x: number, y: number, quantity: Quantity): number {
  const { data, row_stride, height, pixelformat } = picture,
    view = new DataView(data.buffer, data.byteOffset, data.byteLength),
    row = y * (row_stride || data.length / height),
    size = quantity === "depth" ? 4 : pixelformat === image_t.PIXEL_FORMAT_GRAY ? 1 : 2,
    at = row + size * x;
  if (at + size > view.byteLength) return NaN;
  if (quantity === "depth") return view.getFloat32(at, true);
  if (size === 1) return view.getUint8(at);
  return view.getUint16(at, true) * (quantity === "temperature" ? kCount_K : 1);
}

const words = (value: number, quantity: Quantity): string => {
  if (value === Infinity) return "nothing";
  if (value === -Infinity) return "too near";
  return quantity === "depth" ? `${value.toFixed(3)} m` : `${value.toFixed(2)} K`;
};

export class Picture {
  private readonly canvas: HTMLCanvasElement;
  private readonly caption = h("figcaption");
  private readonly legend = h("div", { class: "xy-legend", hidden: true }); // of labels
  readonly element: HTMLElement;
  private next: Blob | null = null; // the newest JPEG, while another one is being decoded
  private reading = false;
  private raw: image_t | null = null; // the newest picture
  private source: Source = { kind: "", nameOf: String };
  private quantity: Quantity = "colour";
  private pointer: [x: number, y: number] | null = null; // shares of the picture
  private range: [low: number, high: number] = [0, 1]; // of its finite values

  constructor(readonly name: string) {
    this.canvas = h("canvas", {
      class: "picture",
      role: "img",
      "aria-label": `picture of ${name}`,
      hidden: true,
    });
    this.element = h("figure", { "data-camera": name }, this.canvas, this.caption, this.legend);
    say(this.caption, `${name}: no picture yet`);
    this.canvas.addEventListener("pointermove", ({ offsetX, offsetY }) => {
      this.pointer = [offsetX / this.canvas.clientWidth, offsetY / this.canvas.clientHeight];
      this.tell();
    });
    this.canvas.addEventListener("pointerleave", () => {
      this.pointer = null;
      this.tell();
    });
  }

  // Its size and time, and of values the range and what is under the pointer.
  private tell(): void {
    const { raw, quantity, pointer } = this;
    if (!raw) return;
    const { width, height, utime } = raw,
      parts = [this.name, `${width} × ${height}`, `${(Number(utime) * 1e-6).toFixed(2)} s`];
    if (quantity === "depth" || quantity === "temperature")
      parts.push(`dark to bright: ${this.darkToBright()}`);
    if (pointer && quantity !== "colour") {
      const [x, y] = [Math.floor(pointer[0] * width), Math.floor(pointer[1] * height)];
      parts.push(`here ${this.told(valueOf(raw, x, y, quantity))}`);
    }
    say(this.caption, parts.join(" · "));
  }
  private told(value: number): string {
    if (this.quantity !== "labels") return words(value, this.quantity);
    return value > 0 ? `label ${this.source.nameOf(value)}` : "nothing";
  }
  private darkToBright(): string {
    const [low, high] = this.range,
      [from, to] = this.quantity === "depth" ? [high, low] : [low, high];
    return `${words(from, this.quantity)} to ${words(to, this.quantity)}`;
  }

  private measure(message: image_t): void {
    let [low, high] = [Infinity, -Infinity];
    for (let y = 0; y < message.height; ++y)
      for (let x = 0; x < message.width; ++x) {
        const value = valueOf(message, x, y, this.quantity);
        if (!Number.isFinite(value)) continue;
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    this.range = low <= high ? [low, high] : [0, 1];
  }

  // The colours of the labels in the picture, the most frequent ones first.
  private explain(message: image_t): void {
    const counts = new Map<number, number>();
    for (let y = 0; y < message.height; ++y)
      for (let x = 0; x < message.width; ++x) {
        const label = valueOf(message, x, y, "labels");
        if (label > 0) counts.set(label, (counts.get(label) ?? 0) + 1);
      }
    const shown = [...counts].sort((a, b) => b[1] - a[1]).slice(0, kMostLabels),
      words = shown.map(([label]) => this.source.nameOf(label)).join();
    this.legend.hidden = shown.length === 0;
    if (this.legend.dataset.labels === words) return;
    this.legend.dataset.labels = words;
    this.legend.replaceChildren(
      ...shown.map(([label]) =>
        h(
          "span",
          {},
          h("i", { style: `--colour: rgb(${colourOf(label).join()})` }),
          this.source.nameOf(label),
        ),
      ),
    );
  }

  show(message: image_t, source: Source): void {
    const { width, height, pixelformat, data } = message;
    Object.assign(this, { raw: message, source });
    this.quantity = quantityOf(message, source.kind);
    if (this.quantity !== "colour" && width * height <= kMostPixels) this.measure(message);
    if (this.quantity === "labels" && width * height <= kMostPixels) this.explain(message);
    this.tell();
    if (pixelformat === image_t.PIXEL_FORMAT_MJPEG) {
      this.next = new Blob([data as BlobPart], { type: "image/jpeg" });
      void this.read();
      return;
    }
    this.next = null;
    if (width > 0 && height > 0 && width * height <= kMostPixels)
      this.draw(width, height, (context) =>
        context.putImageData(pixelsOf(message, this.quantity, this.range), 0, 0),
      );
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

function pixelsOf(message: image_t, quantity: Quantity, [low, high]: [number, number]): ImageData {
  const { width, height, pixelformat, data, row_stride } = message,
    pixels = new ImageData(width, height),
    view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const stride = row_stride || data.length / height;
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      let [r, g, b] = [0, 0, 0];
      if (quantity === "temperature")
        r = g = b = (255 * (valueOf(message, x, y, quantity) - low)) / Math.max(0.1, high - low);
      else if (quantity === "labels") [r, g, b] = colourOf(valueOf(message, x, y, quantity));
      else [r, g, b] = pixel(pixelformat, view, y * stride, x);
      pixels.data.set([r, g, b, 255], 4 * (y * width + x));
    }
  }
  return pixels;
}

// Black for nothing.
const colourOf = (label: number): [number, number, number] =>
  label > 0
    ? [((label * 97) % 200) + 55, ((label * 57) % 200) + 55, ((label * 151) % 200) + 55]
    : [0, 0, 0];

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
    default: {
      const grey = byte(row + x);
      return [grey, grey, grey];
    }
  }
}
