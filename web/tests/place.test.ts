// Places as the fragment of a URL, and back.
import { describe, expect, it } from "vitest";
import { hashOf, placeOf, type Open } from "../src/state/place";

const nothing = { time_s: null, camera: null, robot: "", selected: "", open: null };

describe("a place", () => {
  it("goes into an address and comes back", () => {
    const place = {
      time_s: 12.345,
      camera: [1, -2, 3.5, 0, 0, 0.25],
      robot: "p3at",
      selected: "a & b",
      open: {
        page: "Plots",
        off: ["rays"],
        panes: [{ xy: true, of: [["p3at/odometry", "x"], ["p3at/lrf", "min(ranges)"]] }], // prettier-ignore
      } as Open,
    };
    expect(placeOf(hashOf(place))).toEqual(place);
    expect(hashOf(nothing)).toBe("#");
  });

  it("has no missing values and no texts", () => {
    for (const hash of [
      "",
      "#",
      "#t=&camera=1,2",
      "#t=x&camera=1,2,3,4,5,y",
      "#t=Infinity",
      "#open={}",
      '#open={"page":"Plots","off":[],"panes":[{"xy":1,"of":[]}]}',
    ])
      expect(placeOf(hash)).toEqual(nothing);
  });
});
