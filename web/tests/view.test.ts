// The view of the scene: camera, level of detail, and lights.
import * as THREE from "three";
import { displayFor } from "../src/state/display";
import { describe, expect, it } from "vitest";
import { Crowd } from "../src/scene/crowd";
import type { Movers } from "../src/scene/build";
import { metrePixels, shareOut } from "../src/scene/detail";
import { Lights } from "../src/scene/lights";
import { RobotOverlay } from "../src/scene/overlays";
import { depthOf, homeOf, shownOf, viewOf } from "../src/scene/viewpoint";
import { drawable, padded, ticksText } from "../src/widgets/plots";
import type { Description } from "../src/wire/description";
import type { device_info_t, planar_lidar_t } from "../generated/messages";

function box(): THREE.BufferGeometry {
  const geometry = new THREE.BoxGeometry(1, 1, 1),
    white = new Float32Array(3 * geometry.getAttribute("position").count).fill(1);
  return geometry.setAttribute("color", new THREE.BufferAttribute(white, 3));
}

describe("home", () => {
  it("has all corners of a world in view, and one of them at the edge", () => {
    for (const [low, high, aspect] of [
      [[-10, -2, 0], [30, 5, 2], 16 / 9],
      [[-1, -40, 0], [4, 40, 8], 390 / 844],
      [[-50, -50, -1], [50, 50, 0.2], 2],
    ] as const) {
      const world = shownOf({ low: [...low], high: [...high], floor: low[2], ceiling: null });
      const camera = new THREE.PerspectiveCamera(50, aspect, 0.05, 400);
      const { eye, target } = homeOf(world, camera.fov, aspect);
      camera.up.set(0, 0, 1);
      camera.position.copy(eye);
      camera.lookAt(target);
      camera.updateMatrixWorld();
      const reach = [world.low[0]!, world.high[0]!].flatMap((x) =>
        [world.low[1]!, world.high[1]!].flatMap((y) =>
          [world.low[2]!, world.high[2]!].map((z) => {
            const at = new THREE.Vector3(x, y, z).project(camera);
            return Math.max(Math.abs(at.x), Math.abs(at.y));
          }),
        ),
      );
      expect(Math.max(...reach)).toBeCloseTo(0.95, 6);
    }
  });

  it("is of what is under a roof and above the floor, and of a small world from 3 m around", () => {
    expect(shownOf({ low: [0, 0, -3], high: [1, 1, 9], floor: 0, ceiling: 2 })).toEqual({
      low: [-2.5, -2.5, 0],
      high: [3.5, 3.5, 2],
    });
    expect(shownOf({ low: [-900, -20, 0], high: [1100, 20, 1], floor: 0, ceiling: null })).toEqual({
      low: [-900, -20, 0],
      high: [1100, 20, 1],
    });
    expect(shownOf(null)).toEqual({ low: [-3, -3, 0], high: [3, 3, 1] });
  });

  it("is the file's own view, if it has one: of the floor, or of what is 5 m ahead", () => {
    const down = Math.PI / 6, // pitch of 60 degrees, over a floor 4 m below
      { eye, target } = viewOf([1, 2, 5, Math.cos(down), 0, Math.sin(down), 0], 1);
    expect(eye.toArray()).toEqual([1, 2, 5]);
    expect(target.z).toBeCloseTo(1, 9);
    expect(target.x).toBeCloseTo(1 + 4 / Math.tan(2 * down), 9);
    expect(viewOf([0, 0, 2, 1, 0, 0, 0], 0).target.toArray()).toEqual([5, 0, 2]);
  });

  it("keeps what lies 1 mm above a floor apart from it, as far as it is looked at", () => {
    for (const reach of [0.5, 5, 30, 150, 1000]) {
      const { near, far } = depthOf(reach),
        step = (reach * reach * (1 / near - 1 / far)) / 2 ** 24; // of a depth buffer of 24 bits
      expect(step).toBeLessThan(reach < 100 ? 0.001 : reach / 20_000);
    }
  });
});

describe("rays and cones", () => {
  it("of many robots are fainter, so that what lies below stays to be seen", () => {
    const overlay = new RobotOverlay([], [0, 0, 0, 1, 0, 0, 0], "key"),
      device = { name: "lrf", kind: "lrf", position: [0, 0, 0], orientation: [1, 0, 0, 0] },
      scan = { ranges: [1, 2], intensities: [], rad0: 0, radstep: 0.1 };
    overlay.scan(device as unknown as device_info_t, scan as unknown as planar_lidar_t);
    const opacities = () => {
      const found: number[] = [];
      overlay.group.traverse((object) => {
        if (object instanceof THREE.Mesh || object instanceof THREE.LineSegments) {
          const { transparent, opacity } = object.material as THREE.Material;
          if (transparent) found.push(opacity);
        }
      });
      return found;
    };
    const alone = opacities();
    overlay.style((layer) => displayFor(new Map(), layer, ""), 4);
    expect(alone.length).toBe(2);
    expect(opacities()).toEqual(alone.map((opacity) => opacity / 4));
  });
});

describe("plots", () => {
  it("leave a gap for what is not finite", () => {
    expect([1, Infinity, -Infinity, NaN, 0].map(drawable)).toEqual([1, null, null, null, 0]);
    expect(drawable(Number.MAX_VALUE)).toBe(null); // as a sensor's "nothing"
  });

  it("show a range in which numbers can be told apart", () => {
    for (const value of [0, 5, -1e-9, 1_799_000_000, 2 ** 60, -1e29]) {
      const [low, high] = padded(value, value, 0);
      expect(low).toBeLessThan(value - 1e-7 * Math.abs(value));
      expect(high).toBeGreaterThan(value + 1e-7 * Math.abs(value));
    }
    const [low, high] = padded(1e-6, 2e-6, 0);
    expect(low).toBeCloseTo(0.9e-6, 12);
    expect(high).toBeCloseTo(2.1e-6, 12);
    expect(padded(1e-6, 2e-6, 0.02)[1]).toBeCloseTo(0.02, 3);
  });

  it("write ticks in few places", () => {
    expect(ticksText([-0.5, 0, 0.5])).toEqual(["-0.5", "0.0", "0.5"]);
    expect(ticksText([0, 0.00002])).toEqual(["0", "2e-5"]);
    expect(ticksText([999_000, 1_000_000, 1_001_000])).toEqual([
      "9.990e+5",
      "1.000e+6",
      "1.001e+6",
    ]);
    expect(ticksText([2 ** 60])).toEqual(["1e+18"]);
  });
});

describe("many links", () => {
  // In a row along x, at those distances from the origin.
  function row(distances: number[], always: boolean): Movers {
    const far = new Crowd(box(), distances.length),
      near = new THREE.InstancedMesh(box(), new THREE.MeshBasicMaterial(), distances.length),
      matrices = new Float32Array(16 * distances.length);
    distances.forEach((x, i) =>
      new THREE.Matrix4().makeTranslation(x, 0, 0).toArray(matrices, 16 * i),
    );
    const indices = distances.map((_, i) => 100 + i),
      links = indices.map(() => ({ kind: 0, body: 0, pose: new Float32Array(7) }));
    return {
      links,
      indices,
      meshes: [near],
      shown: [],
      far: { always, mesh: far, matrices, shown: [] },
    };
  }
  const position = { x: 0, y: 0, z: 0 };

  it("are boxes where half a metre is fewer than 20 pixels, in a picture of fewer ones nearer", () => {
    const movers = row([5, 9, 11, 17, 19], true);
    const shown = (height_px: number) => {
      shareOut(movers, { position, metre_px: metrePixels(height_px, 90) }, false, () => false);
      return [movers.shown, movers.far!.shown];
    };
    // At 90 degrees a metre is half the height, a metre away: 720 / 2 * 0.5 / 20 = 9 m
    expect(shown(800)).toEqual([
      [0, 1],
      [2, 3, 4],
    ]);
    expect(shown(1440)).toEqual([[0, 1, 2, 3], [4]]);
    expect(movers.meshes[0]!.count).toBe(4);
    expect(movers.far!.mesh.matrices[12]).toBe(19);
  });

  it("are boxes only where the picture is plain, unless they cost too much", () => {
    const movers = row([5, 50], false),
      eye = { position, metre_px: 100 };
    shareOut(movers, eye, false, () => false);
    expect([movers.shown, movers.far!.shown]).toEqual([[0, 1], []]);
    shareOut(movers, eye, true, () => false);
    expect([movers.shown, movers.far!.shown]).toEqual([[], [0, 1]]);
  });

  it("have no wheels where those are less than two pixels", () => {
    const movers = row([1, 12, 15, 40], true);
    shareOut(movers, { position, metre_px: 100 }, true, (link) => link !== 103);
    expect(movers.far!.shown).toEqual([1, 3]); // 0.2 m is 1.5 pixels at 13.3 m
  });
});

describe("a crowd", () => {
  const at = (crowd: Crowd, i: number, x: number) =>
    new THREE.Matrix4().makeTranslation(x, 0, 0).toArray(crowd.matrices, 16 * i);

  it("is hit where its copies are, those that are shown", () => {
    const crowd = new Crowd(box(), 70);
    for (let i = 0; i < 70; ++i) at(crowd, i, 3 * i);
    crowd.showFirst(69);
    const caster = new THREE.Raycaster(
      new THREE.Vector3(3 * 67, 0, 5),
      new THREE.Vector3(0, 0, -1),
    );
    expect(caster.intersectObject(crowd)[0]).toMatchObject({ instanceId: 67, distance: 4.5 });
    caster.ray.origin.x = 3 * 69;
    expect(caster.intersectObject(crowd)).toEqual([]);
  });

  it("draws whole blocks, in which copies that are not shown have no size", () => {
    const crowd = new Crowd(box(), 70);
    crowd.matrices.fill(1);
    crowd.showFirst(3);
    expect(crowd.geometry.instanceCount).toBe(1);
    expect(crowd.matrices.slice(16 * 3, 16 * 64).every((value) => value === 0)).toBe(true);
    crowd.showFirst(65);
    expect(crowd.geometry.instanceCount).toBe(2);
    crowd.showFirst(0);
    expect(crowd.visible).toBe(false);
  });
});

it("shadows are drawn again if something moved, or the sun's view did", () => {
  const lights = new Lights(),
    sun = {
      type: "directional",
      colour: [1, 1, 1],
      position: [0, 0, 9],
      direction: [0, 0, -1],
      intensity: 1,
    };
  lights.show({ ambient: [1, 1, 1], lights: [sun] } as unknown as Description);
  const target = new THREE.Vector3(1, 2, 0);
  expect(lights.aim(target)).toBe(false); // it casts none
  lights.cast(true);
  expect([lights.aim(target), lights.aim(target)]).toEqual([true, false]);
  lights.moved();
  expect([lights.aim(target), lights.aim(target)]).toEqual([true, false]);
  expect(lights.aim(target.setX(1.4))).toBe(false);
  expect(lights.aim(target.setX(1.6))).toBe(true);
});
