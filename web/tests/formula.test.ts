// Formulas over fields of channels.
import { describe, expect, it } from "vitest";
import { formulaOf, formulaOver } from "../src/state/formula";
import { fieldsOf, nameOf, valueAt } from "../src/wire/fields";

const value = (text: string, ...values: number[]) => formulaOf("c", text).at(0, values);

describe("a formula", () => {
  it("computes as usual", () => {
    expect(value("x - y - z", 7, 2, 1)).toBe(4);
    expect(value("x + y * z", 1, 2, 3)).toBe(7);
    expect(value("-(x + y) / 2", 1, 3)).toBe(-2);
    expect(value("abs(-x) + max(x, y) - 1e1 * 0.5", 2, 5)).toBe(2);
    expect(value("atan2(y[1], x.z)", 1, 0)).toBeCloseTo(Math.PI / 2, 12);
  });

  it("names its fields once each, of its own channel and of others", () => {
    expect(formulaOf("c", "min(ranges) - {a/b x[2]} + x - min(ranges)").refs).toEqual([
      { channel: "c", path: "min(ranges)" },
      { channel: "a/b", path: "x[2]" },
      { channel: "c", path: "x" },
    ]);
  });

  it.each([
    ["x -", "ends too early"],
    ["min(x", '"\\)" is missing'],
    ["x y", '"y" is too much'],
    ["x $ y", '"\\$ y" is not understood'],
    ["sinus(x)", "no function sinus"],
    ["1 + 2", "no field"],
    ["", "ends too early"],
  ])("%s is refused", (text, words) => {
    expect(() => formulaOf("c", text)).toThrow(new RegExp(words));
  });

  it("uses the last value of a slower channel", () => {
    const often = { times: [0, 1, 2, 3], values: [1, 2, 3, 4] },
      seldom = { times: [0.5, 2], values: [10, 20] };
    expect(formulaOver(formulaOf("c", "x + {d y}"), [often, seldom])).toEqual({
      times: [0.5, 1, 2, 3],
      values: [11, 12, 23, 24],
    });
  });

  it("has a derivative: 2 t of t^2, between the times", () => {
    const times = [0, 1, 3, 4],
      { values } = formulaOver(formulaOf("c", "derivative(x)"), [
        { times, values: times.map((t) => t * t) },
      ]);
    expect(values).toEqual([NaN, 1, 4, 7]);
    const twice = formulaOf("c", "derivative(x)");
    twice.at(1, [5]);
    twice.at(2, [6]);
    expect(twice.at(2, [8])).toBe(3); // two channels spoke at 2 s: the later value counts
  });
});

describe("fields of arrays", () => {
  it("are all elements that a message has", () => {
    const message = { nranges: 40, ranges: new Float32Array(40) };
    expect(fieldsOf("planar_lidar_t", message)).toContain("ranges[39]");
    expect(fieldsOf("planar_lidar_t", message)).not.toContain("ranges[40]");
  });

  it("summarise all of them, without those that are not finite", () => {
    const message = {
      ranges: new Float32Array([3, Infinity, 1, NaN, 2]),
      points: [{ d: 1 }, { d: 5 }],
    };
    const over = (name: string) => valueAt(message, `${name}(ranges)`);
    expect(["min", "max", "mean", "sum"].map(over)).toEqual([1, 3, 2, 6]);
    expect(valueAt(message, "max(points.d)")).toBe(5);
    expect(valueAt(message, "min(nothing)")).toBeNaN();
  });

  it("have names where a message has them", () => {
    const message = { joint_name: ["left", "right"], joint_position: [0, 1] };
    expect(nameOf(message, "joint_position[1]")).toBe("right");
    expect(nameOf(message, "other[1]")).toBe("");
    expect(nameOf(undefined, "joint_position[1]")).toBe("");
  });
});
