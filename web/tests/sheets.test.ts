// Which thin parts lie on which, so that none of them flickers.
import { expect, it } from "vitest";
import { levelsOf, type Sheet } from "../src/scene/sheets";

const sheet = (low: number[], high: number[], top: number, thin = true) =>
  ({ part: {}, low, high, top, thin }) as unknown as Sheet;
const levels = (...sheets: Sheet[]) => {
  const found = levelsOf(sheets);
  return sheets.map(({ part }) => found.get(part));
};

it("marks lie on a road, and the road on the floor, in whatever order they come", () => {
  const mark = sheet([-1, -0.1], [1, 0.1], 0.004),
    road = sheet([-20, -3], [20, 3], 0.002),
    floor = sheet([-50, -50], [50, 50], 0);
  expect(levels(mark, road, floor)).toEqual([2, 1, 0]);
  expect(levels(floor, mark, road)).toEqual([0, 2, 1]);
});

it("of two at the same height the smaller one is on top", () => {
  expect(levels(sheet([0, 0], [1, 1], 0), sheet([-9, -9], [9, 9], 0, false))).toEqual([1, 0]);
});

it("tiles beside each other do not lie on each other, nor on what is far below", () => {
  const tiles = [0, 1, 2].map((x) => sheet([x, 0], [x + 1, 1], 0.001 * x));
  expect(levels(...tiles, sheet([-9, -9], [9, 9], -0.5))).toEqual([0, 0, 0, 0]);
});

it("thick parts stay as they are", () => {
  expect(levels(sheet([0, 0], [1, 1], 0.01, false), sheet([-9, -9], [9, 9], 0))).toEqual([0, 0]);
});
