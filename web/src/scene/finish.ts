// How surfaces are drawn: finely, or, where a software rasteriser draws something that moves,
// plainly: without gloss, and with one texture sample per pixel. Colours and lights stay the same.
import * as THREE from "three";
import { plainMaterial } from "./plain_material";

// Gives a mesh that finish. Meshes whose only material is plain keep it.
export function setFinish(mesh: THREE.Mesh, plain: boolean): void {
  const fine = (mesh.userData.fine ?? mesh.material) as THREE.Material;
  if (!(fine instanceof THREE.MeshStandardMaterial)) return;
  mesh.userData.fine = fine;
  mesh.material = plain ? plainOf(fine) : fine;
}

// All materials of a mesh.
export function finishesOf(mesh: THREE.Mesh): THREE.Material[] {
  const fine = (mesh.userData.fine ?? mesh.material) as THREE.Material;
  const plain = fine.userData.plain as THREE.Material | undefined;
  return plain ? [fine, plain] : [fine];
}

function plainOf(fine: THREE.MeshStandardMaterial): THREE.MeshLambertMaterial {
  const { vertexColors, emissive, side, transparent, opacity, depthWrite, alphaTest, wireframe } =
    fine;
  const { clippingPlanes, clipShadows } = fine,
    { polygonOffset, polygonOffsetFactor, polygonOffsetUnits } = fine;
  fine.userData.plain ??= plainMaterial({
    vertexColors,
    emissive,
    side,
    transparent,
    opacity,
    depthWrite,
    alphaTest,
    wireframe,
    clippingPlanes,
    clipShadows,
    polygonOffset,
    polygonOffsetFactor,
    polygonOffsetUnits,
    map: fine.map && plainPicture(fine.map),
  });
  return fine.userData.plain as THREE.MeshLambertMaterial;
}

// The same texture with cheaper sampling; one for all surfaces that have it.
function plainPicture(fine: THREE.Texture): THREE.Texture {
  if (fine.userData.plain) return fine.userData.plain as THREE.Texture;
  const plain = fine.clone();
  plain.anisotropy = 1;
  plain.colorSpace = THREE.NoColorSpace; // see plainMaterial
  plain.minFilter = THREE.LinearMipmapNearestFilter;
  plain.version = 0; // a clone would be uploaded at once, with a warning a frame until it can be
  fine.userData.plain = plain;
  arrived(fine);
  return plain;
}

// A texture's image has been loaded; its plain twin shares it.
export function arrived(fine: THREE.Texture): void {
  const plain = fine.userData.plain as THREE.Texture | undefined;
  if (plain && fine.image) plain.needsUpdate = true;
}
