// What pixels of pictures of labels are called.
import { describe, expect, it } from "vitest";
import { image_t, type device_info_t } from "../generated/messages";
import { pictureSource } from "../src/state/labels";
import type { PageState } from "../src/state/page";
import { quantityOf, valueOf } from "../src/widgets/picture";

const state = {
  world: { bodies: [{ name: "p3at/base_link" }, { name: "wall/link" }] },
  scene: {
    classes: [
      [7, "car", "van"],
      [9, "a", "b", "c", "d"],
    ],
  },
} as unknown as PageState;
const camera = (kind: string) => ({ kind }) as device_info_t;

describe("labels", () => {
  it("of a camera are bodies by their places in ruedo/info", () => {
    const { nameOf } = pictureSource(state, camera("camera"));
    expect([1, 2, 3].map(nameOf)).toEqual(["1 p3at/base_link", "2 wall/link", "3"]);
  });
  it("of a segmentation camera are classes, or models of a class", () => {
    const { nameOf } = pictureSource(state, camera("segmentation_camera"));
    expect(nameOf(7)).toBe("7 car, van");
    expect(nameOf(8)).toBe("8");
    expect(nameOf(9)).toBe("9 a, b, c …");
    expect(nameOf(256 * 7 + 2)).toBe("7 #2 van");
  });
  it("are 8 or 16 bits wide", () => {
    const picture = (pixelformat: number, data: number[]) =>
      ({ width: 2, height: 1, row_stride: 0, pixelformat, data: Uint8Array.from(data) }) as image_t;
    const classes = picture(image_t.PIXEL_FORMAT_GRAY, [3, 200]),
      models = picture(image_t.PIXEL_FORMAT_LE_GRAY16, [0, 0, 2, 7]);
    for (const each of [classes, models])
      expect(quantityOf(each, "segmentation_camera")).toBe("labels");
    expect(quantityOf(classes, "camera")).toBe("colour");
    expect(valueOf(classes, 1, 0, "labels")).toBe(200);
    expect(valueOf(models, 1, 0, "labels")).toBe(256 * 7 + 2);
  });
});
