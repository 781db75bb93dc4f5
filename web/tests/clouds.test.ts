// Points of 3-D range finders and depth cameras, by hand; and frames in words.
import * as THREE from "three";
import { describe, expect, it } from "vitest";
import { image_t, type lidar_t } from "../generated/messages";
import { pointsOfDepth, pointsOfLidar } from "../src/scene/clouds";
import { PastPoints } from "../src/scene/past_points";
import { poseWords } from "../src/ui/frames";

const near = (found: Float32Array | null, wanted: number[]) => {
  expect(found).toHaveLength(wanted.length);
  found!.forEach((value, i) => expect(value).toBeCloseTo(wanted[i]!, 5));
};

describe("clouds", () => {
  it("of a 3-D range finder are its returns, ahead, left and up", () => {
    const scan = {
      nlayers: 2,
      ncolumns: 2,
      ranges: new Float32Array([2, Infinity, -Infinity, 4]),
      azimuth0: 0,
      azimuth_step: Math.PI / 2,
      elevation0: 0,
      elevation_step: Math.PI / 6,
    } as unknown as lidar_t;
    // Ahead on the lower layer; to the left on the upper one, 30 degrees up: 4 cos 30, 4 sin 30.
    near(pointsOfLidar(scan), [2, 0, 0, 0, 2 * Math.sqrt(3), 2]);
  });

  const picture = (depths: number[], width: number, more: Partial<image_t> = {}) =>
    ({
      width,
      height: depths.length / width,
      row_stride: 4 * width,
      pixelformat: image_t.PIXEL_FORMAT_FLOAT_GRAY32,
      data: new Uint8Array(new Float32Array(depths).buffer),
      ...more,
    }) as unknown as image_t;

  it("of a depth camera lie where the pixels look", () => {
    // 90 degrees over two pixels: the focal length is one pixel, their centres half a pixel away.
    near(pointsOfDepth(picture([2, 4, 6, Infinity], 2), Math.PI / 2), [
      ...[2, 1, 1],
      ...[4, -2, 2],
      ...[6, 3, -3],
    ]);
  });

  it("are none of other pictures, and of those that are cut off", () => {
    const grey = picture([1], 1, { pixelformat: image_t.PIXEL_FORMAT_GRAY });
    expect(pointsOfDepth(grey, 1)).toBeNull();
    expect(pointsOfDepth(picture([1, 2], 2, { data: new Uint8Array(7) }), 1)).toBeNull();
    expect(pointsOfDepth(picture([1], 1, { width: 0 }), 1)).toBeNull();
    expect(pointsOfDepth(picture([1], 1, { width: 1 << 30 }), 1)).toBeNull();
  });

  it("say frames in words", () => {
    const half = Math.SQRT1_2;
    expect(poseWords([1, -0.00001, 0.2], [half, 0, 0, half])).toBe(
      "1.000 m, 0.000 m, 0.200 m, yaw 90.0°",
    );
    expect(poseWords([0, 0, 0], [half, half, 0, 0])).toBe("0.000 m, 0.000 m, 0.000 m, roll 90.0°");
  });
});

describe("points that stay", () => {
  const seen = (x: number) => ({
    points: new Float32Array([x, 0, 0]),
    colours: new Float32Array([1, 1, 0]),
  });
  const at = (past: PastPoints) => [
    ...(past.object.geometry.getAttribute("position").array as Float32Array),
  ];
  it("are where they were in the world, for that long", () => {
    const past = new PastPoints(),
      robot = new THREE.Matrix4();
    past.add(1, 2, seen(1), robot);
    past.add(2, 2, seen(1), robot.makeTranslation(5, 0, 0));
    expect(at(past)).toEqual([1, 0, 0, 6, 0, 0]);
    past.add(3.5, 2, seen(1), robot.makeTranslation(7, 0, 0));
    expect(at(past)).toEqual([6, 0, 0, 8, 0, 0]);
    past.add(3.6, 0, seen(1), robot);
    expect(at(past)).toEqual([]);
  });
  it("are those before the shown moment alone", () => {
    const past = new PastPoints();
    past.add(1, 9, seen(1), new THREE.Matrix4());
    past.add(5, 9, seen(2), new THREE.Matrix4());
    past.add(3, 9, seen(3), new THREE.Matrix4());
    expect(at(past)).toEqual([1, 0, 0, 3, 0, 0]);
  });
});
