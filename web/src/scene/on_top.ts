// Lines and points that lie over all else in the scene. The floor is drawn last of what is opaque,
// over all that does not hide it by its depth: so they are drawn after it, as if transparent.
import type { Object3D } from "three";

export const kOnTop = {
  depthTest: false,
  transparent: true,
  toneMapped: false,
  fog: false,
} as const;

export function putOnTop(object: Object3D): void {
  object.renderOrder = 2;
  object.frustumCulled = false;
}
