// Undo and redo, and SDF as text: shapes that are drawn, scaled, and cut.
import { describe, expect, it } from "vitest";
import { History } from "../src/edit/history";
import type { HistoryState } from "../src/state/page";
import { numbersOf, poseFrom, poseNow } from "../src/edit/pose";
import type { ModelDescription } from "../src/wire/description";
import { Poses } from "../src/state/poses";
import { boxModel, places, roomModel, scaled, wallModel, withDoor } from "../src/edit/sdf";
import { stateOf } from "./told";

describe("history", () => {
  function recorded() {
    const said: string[] = [],
      states: HistoryState[] = [],
      history = new History((state) => states.push(state));
    const step = (name: string, good = true) => ({
      name,
      apply: () => {
        said.push(`+${name}`);
        return Promise.resolve(good);
      },
      revert: () => {
        said.push(`-${name}`);
        return Promise.resolve(good);
      },
    });
    return { said, states, history, step };
  }

  it("undoes and redoes, in order, one at a time", async () => {
    const { said, states, history, step } = recorded();
    void history.do(step("a"));
    void history.do(step("b"));
    await history.undo();
    await history.undo();
    await history.redo();
    await history.do(step("c"));
    expect(await history.redo()).toBe(false); // a new step clears what was undone
    expect(said).toEqual(["+a", "+b", "-b", "-a", "+a", "+c"]);
    expect(states.at(-1)).toEqual({ undo: "c", redo: null, changes: 6 });
  });

  it("has no step that did not happen", async () => {
    const { states, history, step } = recorded();
    expect(await history.do(step("a", false))).toBe(false);
    expect(states.at(-1)).toEqual({ undo: null, redo: null, changes: 0 });
  });
});

describe("poses", () => {
  it("are six numbers and back: roll, pitch and yaw about fixed axes", () => {
    // 90 degrees about z after 90 about x: x to y, y to z, z to x; the quaternion (1, 1, 1, 1) / 2
    // turns like that.
    expect(poseFrom([1, 2, 3, 90, 0, 90]).map((v) => Number(v.toFixed(6)))).toEqual([
      1, 2, 3, 0.5, 0.5, 0.5, 0.5,
    ]);
    expect(numbersOf([1, 2, 3, 0.5, 0.5, 0.5, 0.5]).map((v) => Number(v.toFixed(6)))).toEqual([
      1, 2, 3, 90, 0, 90,
    ]);
  });

  it("are the received ones, without invented ones", () => {
    const poses = new Poses(),
      model = { name: "box", body: 1, pose: [0, 0, 0.5, 1, 0, 0, 0] } as ModelDescription;
    expect(poseNow(model, poses)).toBeNull();
    const told = (body: number) => poses.add(stateOf(body, [3, 4, 1]), 0);
    told(2); // another one, of a higher number
    expect(poseNow(model, poses)).toBeNull();
    told(1);
    expect(poseNow(model, poses)).toEqual([3, 4, 1.5, 1, 0, 0, 0]);
    expect(poseNow({ ...model, body: -1 }, poses)).toEqual(model.pose);
  });
});

describe("sdf", () => {
  it("finds elements past comments, quotes and CDATA", () => {
    const xml = `<?xml version="1.0"?><!-- <a> --><sdf v="a>b"><x/><y a='/'>1</y><![CDATA[<z>]]></sdf>`,
      [root] = places(xml);
    expect(root!.children.map(({ name, begin, end }) => [name, xml.slice(begin, end)])).toEqual([
      ["x", "<x/>"],
      ["y", "<y a='/'>1</y>"],
    ]);
    expect(() => places("<a><b></a>")).toThrow("not XML");
  });

  it("makes a wall that stands on the ground and a room of four", () => {
    expect(wallModel("w", 3, { height: 1.2, thickness: 0.1 })).toContain(
      "<pose>0 0 0.6 0 0 0</pose>\n          <geometry><box><size>3 0.1 1.2</size></box>",
    );
    const room = roomModel("r", 4, 3, { height: 1, thickness: 0.2 });
    expect(
      [
        ...room.matchAll(
          /<collision name="(\w+)">\s*<pose>(.*?)<\/pose>\s*<geometry><box><size>(.*?)<\/size>/g,
        ),
      ].map((m) => m.slice(1)),
    ).toEqual([
      ["south", "0 -1.6 0.5 0 0 0", "4.4 0.2 1"],
      ["north", "0 1.6 0.5 0 0 0", "4.4 0.2 1"],
      ["west", "-2.1 0 0.5 0 0 0", "0.2 3 1"],
      ["east", "2.1 0 0.5 0 0 0", "0.2 3 1"],
    ]);
  });

  it("scales sizes, places, mass and moments of a box, and leaves the rest as it was written", () => {
    const before = boxModel("b", [1, 2, 3]).replace("<link", "<!-- mine -->\n      <link"),
      after = scaled(before, [2, 1, 1]);
    expect(after).toContain("<!-- mine -->");
    expect(after.match(/<size>(.*?)<\/size>/g)).toEqual([
      "<size>2 2 3</size>",
      "<size>2 2 3</size>",
    ]);
    // 600 kg of 1 x 2 x 3 m become 1200 kg of 2 x 2 x 3 m: m/12 (y^2 + z^2) = 1300, m/12 (x^2 +
    // z^2) = 1300, m/12 (x^2 + y^2) = 800.
    expect(after).toMatch(
      /<mass>1200<\/mass>\s*<inertia><ixx>1300<\/ixx><ixy>0<\/ixy><ixz>0<\/ixz><iyy>1300<\/iyy><iyz>0<\/iyz><izz>800<\/izz>/,
    );
    expect(() => scaled(before, [0, 1, 1])).toThrow("above 0");
    expect(() => scaled("<sdf><include><uri>x</uri></include></sdf>", [2, 2, 2])).toThrow(
      "a file of its own",
    );
    expect(() =>
      scaled(
        "<sdf><model><link><collision><geometry><cylinder><radius>1</radius></cylinder></geometry></collision></link></model></sdf>",
        [2, 1, 1],
      ),
    ).toThrow("keeps its circle");
  });

  it("cuts a door: what is left, right and above stays", () => {
    const wall = withDoor(wallModel("w", 4, { height: 1.2, thickness: 0.1 }), [1, 0], {
      width: 0.8,
      height: 1,
    });
    // From 0.6 to 1.4 m along a wall from -2 to 2.
    expect(
      [
        ...wall.matchAll(
          /<visual name="(\w+)">\s*<pose>(.*?)<\/pose>\s*<geometry><box><size>(.*?)<\/size>/g,
        ),
      ].map((m) => m.slice(1)),
    ).toEqual([
      ["wall_left", "-0.7 0 0.6 0 0 0", "2.6 0.1 1.2"],
      ["wall_right", "1.7 0 0.6 0 0 0", "0.6 0.1 1.2"],
      ["wall_above", "1 0 1.1 0 0 0", "0.8 0.1 0.2"],
    ]);
    expect(() => withDoor(wall, [1, 0], { width: 0.8, height: 1 })).toThrow(/no room|no wall/);
    expect(() => withDoor(wall, [0, 3], { width: 0.8, height: 1 })).toThrow("no wall");
    expect(() =>
      withDoor(wallModel("w", 4, { height: 0.5, thickness: 0.1 }), [0, 0], {
        width: 0.8,
        height: 1,
      }),
    ).toThrow("0.5 m high");
    const along_y = withDoor(roomModel("r", 4, 3, { height: 1, thickness: 0.2 }), [2.1, 0.5], {
      width: 1,
      height: 1,
    });
    expect(
      [
        ...along_y.matchAll(
          /<collision name="(east_\w+)">\s*<pose>(.*?)<\/pose>\s*<geometry><box><size>(.*?)<\/size>/g,
        ),
      ].map((m) => m.slice(1)),
    ).toEqual([
      ["east_left", "2.1 -0.75 0.5 0 0 0", "0.2 1.5 1"],
      ["east_right", "2.1 1.25 0.5 0 0 0", "0.2 0.5 1"],
    ]);
  });
});
