// Thin things that lie on others within millimetres, as roads on a floor and their marks on them.
// From far away a pixel covers more than that height, and a rasteriser rounds vertices to a share
// of a pixel: what lies on top is drawn as if it were so many pixels of slope nearer.
import * as THREE from "three";
import type { LinkData, MeshData, Part, SceneFiles } from "../wire/description";
import { matrixOf } from "./matrix";

const kThin_m = 0.05, // height of a sheet, at most
  kNear_m = 0.02, // between the tops of two that lie on each other, at most
  kTouch_m = 0.001, // those that overlap by less lie beside each other
  kMostTriangles = 500, // of a part: larger ones do not count as sheets
  kMostSheets = 4000,
  kHighest = 4; // level

// From above, in the world.
export interface Sheet {
  part: Part;
  low: [x: number, y: number];
  high: [x: number, y: number];
  top: number;
  thin: boolean;
}

// For parts that lie on others, how many are below them.
export function levelsOf(sheets: Sheet[]): Map<Part, number> {
  const levels = new Map<Part, number>();
  if (sheets.length > kMostSheets) return levels;
  const area = ({ low, high }: Sheet) => (high[0] - low[0]) * (high[1] - low[1]),
    inOrder = [...sheets].sort((a, b) => a.top - b.top || area(b) - area(a)),
    found: number[] = [];
  inOrder.forEach((sheet, i) => {
    let level = 0;
    for (let k = i - 1; sheet.thin && k >= 0; --k) {
      const below = inOrder[k]!;
      if (sheet.top - below.top > kNear_m) break;
      if (found[k]! >= level && overlap(sheet, below)) level = found[k]! + 1;
    }
    found.push(Math.min(level, kHighest));
    levels.set(sheet.part, Math.max(levels.get(sheet.part) ?? 0, found[i]!));
  });
  return levels;
}

const overlap = (a: Sheet, b: Sheet) =>
  [0, 1].every((k) => a.low[k]! < b.high[k]! - kTouch_m && b.low[k]! < a.high[k]! - kTouch_m);

// The standing parts of a scene that may lie on each other.
export function sheetsOf({ description, meshes, links }: SceneFiles): Sheet[] {
  const sheets: Sheet[] = [];
  for (const link of links) {
    if (link.body >= 0) continue;
    for (const part of description.kinds[link.kind] ?? []) {
      const [mesh, first, count] = description.batches[part.batch]!;
      if (count <= 3 * kMostTriangles && sheets.length <= kMostSheets)
        sheets.push(sheetOf(part, link, meshes[mesh]!, first, count));
    }
  }
  return sheets;
}

function sheetOf(
  part: Part,
  link: LinkData,
  { vertices, indices }: MeshData,
  first: number,
  count: number,
): Sheet {
  const box = new THREE.Box3();
  matrixOf(link.pose, 0, kMatrix).multiply(
    kPart.fromArray([...part.matrix, 0, 0, 0, 1]).transpose(),
  );
  for (let i = first; i < first + count; ++i)
    box.expandByPoint(kPoint.fromArray(vertices, 8 * indices[i]!).applyMatrix4(kMatrix));
  const { min, max } = box;
  return {
    part,
    low: [min.x, min.y],
    high: [max.x, max.y],
    top: max.z,
    thin: max.z - min.z <= kThin_m,
  };
}

// Draws a material in front of what lies below it.
export function lift(material: THREE.Material, level: number): void {
  if (level === 0) return;
  Object.assign(material, {
    polygonOffset: true,
    polygonOffsetFactor: -level,
    polygonOffsetUnits: -level,
  });
}

const kMatrix = new THREE.Matrix4(),
  kPart = new THREE.Matrix4(),
  kPoint = new THREE.Vector3();
