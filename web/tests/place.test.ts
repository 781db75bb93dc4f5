// Places as the fragment of a URL, and back.
import { describe, expect, it } from "vitest";
import { hashOf, placeOf } from "../src/state/place";

describe("a place", () => {
  it("goes into an address and comes back", () => {
    const place = {
      time_s: 12.345,
      camera: [1, -2, 3.5, 0, 0, 0.25],
      robot: "p3at",
      selected: "a & b",
    };
    expect(placeOf(hashOf(place))).toEqual(place);
    expect(hashOf({ time_s: null, camera: null, robot: "", selected: "" })).toBe("#");
  });

  it("has nothing that is not there, or is no number", () => {
    const nothing = { time_s: null, camera: null, robot: "", selected: "" };
    for (const hash of ["", "#", "#t=&camera=1,2", "#t=x&camera=1,2,3,4,5,y", "#t=Infinity"])
      expect(placeOf(hash)).toEqual(nothing);
  });
});
