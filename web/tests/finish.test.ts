// The finish of surfaces: what the plain one keeps, and that both are disposed.
import * as THREE from "three";
import { describe, expect, it } from "vitest";
import { arrived, finishesOf, setFinish } from "../src/scene/finish";

const meshOf = (material: THREE.Material) => new THREE.Mesh(new THREE.BufferGeometry(), material);

describe("the finish of a surface", () => {
  it("is plain and fine again, of the same colour, and shared by meshes of one material", () => {
    const fine = new THREE.MeshStandardMaterial({
      vertexColors: true,
      emissive: 0x102030,
      side: THREE.DoubleSide,
      transparent: true,
      opacity: 0.5,
      depthWrite: false,
      alphaTest: 0.4,
    });
    const [one, other] = [meshOf(fine), meshOf(fine)];
    setFinish(one, true);
    setFinish(other, true);
    expect(one.material).toBe(other.material);
    expect(one.material).toBeInstanceOf(THREE.MeshLambertMaterial);
    expect(one.material).toMatchObject({
      vertexColors: true,
      side: THREE.DoubleSide,
      transparent: true,
      opacity: 0.5,
      depthWrite: false,
      alphaTest: 0.4,
    });
    expect((one.material as unknown as THREE.MeshLambertMaterial).emissive.getHex()).toBe(0x102030);
    expect(finishesOf(one)).toEqual([fine, one.material]);
    setFinish(one, false);
    expect(one.material).toBe(fine);
    expect(finishesOf(one)).toHaveLength(2);
  });

  it("has the picture once that is there, also where it comes later", () => {
    const picture = new THREE.Texture();
    const mesh = meshOf(new THREE.MeshStandardMaterial({ map: picture }));
    setFinish(mesh, true);
    const { map } = mesh.material as unknown as THREE.MeshLambertMaterial;
    expect(map!.version).toBe(0); // else it is to be uploaded before it is there
    picture.image = { width: 1, height: 1 };
    arrived(picture);
    expect(map!.version).toBe(1);
    expect(map!.image).toBe(picture.image);
    expect(map!.anisotropy).toBe(1);
  });

  it("has the picture on all surfaces that share it", () => {
    const picture = new THREE.Texture(),
      meshes = [0, 1].map(() => meshOf(new THREE.MeshStandardMaterial({ map: picture })));
    for (const mesh of meshes) setFinish(mesh, true);
    picture.image = { width: 1, height: 1 };
    arrived(picture);
    for (const mesh of meshes)
      expect((mesh.material as unknown as THREE.MeshLambertMaterial).map!.version).toBe(1);
  });

  it("is one alone for what has no gloss to lose", () => {
    const mesh = meshOf(new THREE.MeshLambertMaterial());
    const material = mesh.material;
    setFinish(mesh, true);
    expect(mesh.material).toBe(material);
    expect(finishesOf(mesh)).toEqual([material]);
  });
});
