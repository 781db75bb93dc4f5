// Properties of a model in its text; messages that people write; parts of the time line.
import { describe, expect, it } from "vitest";
import {
  attributeOf,
  propertiesOf,
  textIn,
  withColour,
  withMass,
  withStatic,
  withText,
} from "../src/edit/properties";
import { boxModel, cylinderModel, places, sphereModel, wallModel } from "../src/edit/sdf";
import { spanOf, zoomed } from "../src/state/time";
import { blankOf, checkedMessage } from "../src/wire/as_text";
import { decode, encode } from "../src/wire/lcm";

describe("a model's properties", () => {
  const box = boxModel("box", [0.4, 0.4, 0.5]); // of 100 kg/m^3

  it("are read from its text", () => {
    expect(propertiesOf(box)).toEqual({
      isStatic: false,
      mass: 8,
      colour: "#d99940", // 0.85, 0.6, 0.25
      shape: "box",
      size: [0.4, 0.4, 0.5],
    });
    expect(propertiesOf(cylinderModel("c", 0.2, 0.5)).size).toEqual([0.4, 0.4, 0.5]);
    expect(propertiesOf(sphereModel("s", 0.2)).size).toEqual([0.4, 0.4, 0.4]);
    const wall = propertiesOf(wallModel("w", 3, { height: 1, thickness: 0.1 }));
    expect([wall.isStatic, wall.mass, wall.size]).toEqual([true, null, [3, 0.1, 1]]);
    expect(() => propertiesOf("<sdf><include/></sdf>")).toThrow(/file of its own/);
  });

  it("are any element's text, and the rest stays as it was written", () => {
    const model = (uri: string) =>
      `<sdf><!-- a --><model name='m'><link name="l &amp; k"><uri>${uri}</uri><self/><x> <!-- b --> 1</x></link></model></sdf>`;
    expect(withText(model("a&lt;b"), [0, 0], " c & <d> ")).toBe(model("c &amp; &lt;d>"));
    const link = places(model("a &lt; b"))[0]!.children[0]!.children[0]!,
      [uri, empty, remarked] = link.children.map((place) => textIn(model("a &lt; b"), place));
    expect([uri, empty, remarked]).toEqual(["a < b", null, null]);
    expect(attributeOf(link.tag, "name")).toBe("l &amp; k");
    expect(() => withText(model("a"), [0, 1], "1")).toThrow("<self> has no text");
    expect(withText(model("1 2"), [0, 0], "3 -1e-2")).toBe(model("3 -1e-2"));
    for (const odd of ["much", "3", "3 x", ""])
      expect(() => withText(model("1 2"), [0, 0], odd)).toThrow("<uri> takes 2 numbers");
  });

  it("change alone", () => {
    const heavy = withMass(box, 16);
    expect(propertiesOf(heavy).mass).toBe(16);
    // ixx of 8 kg: 8 / 12 (0.4^2 + 0.5^2)
    const ixx = (text: string) => Number(/<ixx>(.*?)</.exec(text)![1]);
    expect(ixx(heavy)).toBeCloseTo((16 / 12) * (0.4 ** 2 + 0.5 ** 2), 3);
    const red = withColour(box, "#ff0000");
    expect(propertiesOf(red)).toEqual({ ...propertiesOf(box), colour: "#ff0000" });
    expect(propertiesOf(withStatic(box, true)).isStatic).toBe(true);
    expect(withStatic(withStatic(box, true), false)).toContain("<static>false</static>");
    expect(() => withMass(box, 0)).toThrow(/above 0/);
    expect(() => withMass(wallModel("w", 3, { height: 1, thickness: 0.1 }), 1)).toThrow(/no mass/);
  });

  it("keep how transparent it is, and add a colour where there is none", () => {
    const glass = box.replaceAll("0.85 0.6 0.25 1", "0.85 0.6 0.25 0.3");
    expect(withColour(glass, "#000000")).toContain("<diffuse>0 0 0 0.3</diffuse>");
    const bare = box.replace(/<material>.*<\/material>/, "");
    expect(propertiesOf(bare).colour).toBeNull();
    expect(propertiesOf(withColour(bare, "#00ff00")).colour).toBe("#00ff00");
  });
});

describe("an encoded message", () => {
  const drive = { utime: 0, vx: 0.5, vy: 0, omega: -1 };

  it("decodes as its type", () => {
    const bytes = encode(
      "velocity_command_t",
      checkedMessage("velocity_command_t", drive) as never,
    );
    expect(decode("velocity_command_t", bytes)).toEqual({ ...drive, utime: 0n });
    const blank = checkedMessage("joint_command_t", blankOf("joint_command_t")) as never;
    expect(decode("joint_command_t", encode("joint_command_t", blank)).name).toEqual([]);
  });

  it.each([
    [{ ...drive, vx: "fast" }, "vx is a number"],
    [{ ...drive, utime: 0.5 }, "utime is a whole number"],
    [{ ...drive, speed: 1 }, "speed is not one of utime, vx, vy, omega"],
    [{ utime: 0, vx: 0, vy: 0 }, "omega is missing"],
    [[1], "velocity_command_t is an object"],
  ])("%j is refused", (value, words) => {
    expect(() => checkedMessage("velocity_command_t", value)).toThrow(words);
  });

  it("has arrays as long as it says", () => {
    const joints = { utime: 0, n: 2, name: ["a"], mode: [0, 0], value: [0, 0] };
    expect(() => checkedMessage("joint_command_t", joints)).toThrow("name has 2 elements (n)");
  });
});

describe("a part of the time line", () => {
  const shown = { begin: 10, end: 110, now: 50, speed: 1, playing: false };

  it("keeps the moment under the pointer in its place", () => {
    const half = zoomed(null, shown, 35, 0.5)!; // a quarter of the way
    expect(half).toEqual({ begin: 22.5, end: 72.5 });
    expect(zoomed(half, shown, 35, 4)).toBeNull(); // all of it again
  });

  it("follows the shown moment, and ends where the time line does", () => {
    const span = { begin: 20, end: 40 };
    expect(spanOf(span, { ...shown, now: 30 })).toEqual(span);
    expect(spanOf(span, shown)).toEqual({ begin: 40, end: 60 });
    expect(spanOf(span, { ...shown, now: 109 })).toEqual({ begin: 90, end: 110 });
    expect(spanOf(null, shown)).toEqual({ begin: 10, end: 110 });
  });
});
