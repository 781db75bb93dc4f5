// The level of detail of numerous links: fine, as boxes, or not drawn, by their size on the screen.
import type * as THREE from "three";
import type { Movers } from "./build";

// Links are boxes where half a metre covers fewer pixels than this; wheels are not drawn where 0.2
// m covers fewer.
const kFine_px = 20,
  kWheel_px = 1.5;

export interface Eye {
  position: { x: number; y: number; z: number };
  metre_px: number; // pixels that 1 m covers at a distance of 1 m
}

// Pixels that 1 m covers at a distance of 1 m.
export const metrePixels = (height_px: number, fov_deg: number) =>
  height_px / 2 / Math.tan((fov_deg * Math.PI) / 360);

// Assigns the links to the near and the far meshes, by their matrices. plain: distant links are
// boxes even if they are cheap.
export function shareOut(
  { links, indices, meshes, far, shown }: Movers,
  { position, metre_px }: Eye,
  plain: boolean,
  isWheel: (link: number) => boolean,
): void {
  if (!far) return;
  shown.length = far.shown.length = 0;
  const near = meshes[0]!.instanceMatrix.array as Float32Array,
    away = far.mesh.matrices,
    { matrices } = far;
  const boxes = far.always || plain,
    fine_m = boxes ? (0.5 * metre_px) / kFine_px : Infinity,
    wheels_m = boxes ? (0.2 * metre_px) / kWheel_px : Infinity;
  let nearOnes = 0,
    farOnes = 0;
  for (let i = 0; i < links.length; ++i) {
    const at = 16 * i,
      distance_m = Math.hypot(
        matrices[at + 12]! - position.x,
        matrices[at + 13]! - position.y,
        matrices[at + 14]! - position.z,
      );
    if (distance_m > wheels_m && isWheel(indices[i]!)) continue;
    const isFar = distance_m > fine_m,
      into = isFar ? away : near,
      place = 16 * (isFar ? farOnes++ : nearOnes++);
    for (let k = 0; k < 16; ++k) into[place + k] = matrices[at + k]!;
    (isFar ? far.shown : shown).push(i);
  }
  far.mesh.showFirst(farOnes);
  for (const mesh of meshes) mesh.count = nearOnes;
  spread(meshes);
}

// Copies the first mesh's matrices to the others.
export function spread(meshes: THREE.InstancedMesh[]): void {
  for (const mesh of meshes) {
    if (mesh !== meshes[0])
      (mesh.instanceMatrix.array as Float32Array).set(meshes[0]!.instanceMatrix.array);
    mesh.instanceMatrix.needsUpdate = true;
  }
}
