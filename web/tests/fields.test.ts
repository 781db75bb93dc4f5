// Fields of messages by their paths, statistics of their values, and tables of them.
import { describe, expect, it } from "vitest";
import { csvOf, fieldsOf, statisticsOf, valueAt } from "../src/wire/fields";

describe("fields", () => {
  it("are listed down to the numbers", () => {
    expect(fieldsOf("odometry_t")).toEqual(expect.arrayContaining(["utime", "x", "theta", "v"]));
    expect(fieldsOf("pose_t")).toEqual(
      expect.arrayContaining(["pos[0]", "pos[2]", "orientation[3]"]),
    );
    expect(fieldsOf("contact_t")).toEqual(expect.arrayContaining(["points[0].position[2]"]));
    expect(fieldsOf("contact_t").some((path) => path.endsWith("body"))).toBe(false); // a text
    expect(fieldsOf("no_such_t")).toEqual([]);
  });

  it("are read by their paths", () => {
    const message = { a: [{ b: new Float64Array([1, 2]) }], t: 5n, on: true, s: "x" };
    expect(
      ["a[0].b[1]", "t", "on", "s", "a[1].b[0]", "c.d"].map((p) => valueAt(message, p)),
    ).toEqual([2, 5, 1, NaN, NaN, NaN]);
  });

  it("have statistics of what is finite", () => {
    // Mean 5, variance 32 / 8 = 4.
    expect(statisticsOf([2, 4, 4, 4, NaN, 5, 5, 7, 9, Infinity])).toEqual({
      count: 8,
      min: 2,
      max: 9,
      mean: 5,
      deviation: 2,
    });
    expect(statisticsOf([NaN])).toBeNull();
  });

  it("are a table", () => {
    expect(
      csvOf(
        ["a,b", "c"],
        [
          [
            [0, 1],
            [5, 6],
          ],
          [
            [1, 2],
            [7.5, 8],
          ],
        ],
      ),
    ).toBe('time_s,"a,b",c\n0,5,\n1,6,7.5\n2,,8\n');
  });
});
