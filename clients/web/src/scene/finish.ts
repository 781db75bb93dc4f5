// How surfaces are drawn: finely, or plainly, where the processor draws and something moves:
// without gloss, and with one sample of a picture a pixel. Colours and lights stay as they are.
import * as THREE from "three";
import { plainMaterial } from "./plain_material";

// Gives a mesh the finish; what was made with its fine material alone stays as it is.
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
  const { clippingPlanes, clipShadows } = fine;
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
    map: fine.map && plainPicture(fine.map),
  });
  return fine.userData.plain as THREE.MeshLambertMaterial;
}

// The same picture for the graphics memory, sampled otherwise.
function plainPicture(fine: THREE.Texture): THREE.Texture {
  const plain = fine.clone();
  plain.anisotropy = 1;
  plain.colorSpace = THREE.NoColorSpace; // see plainMaterial
  plain.minFilter = THREE.LinearMipmapNearestFilter;
  fine.userData.plain = plain;
  arrived(fine);
  return plain;
}

// A picture's data are there: those of its plain twin, too.
export function arrived(fine: THREE.Texture): void {
  const plain = fine.userData.plain as THREE.Texture | undefined;
  if (plain && fine.image) plain.needsUpdate = true;
}
