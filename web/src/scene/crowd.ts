// Many copies of one small geometry, each with its own matrix. Instancing is the usual means, but
// software rasterisers draw instance by instance, and for boxes of a dozen triangles that overhead
// exceeds the drawing. Here one instance is a block of copies: its geometry contains all of them,
// and each vertex reads its copy's matrix from a texture with one row for each block.
import * as THREE from "three";
import { kTexels, plainMaterial } from "./plain_material";

const kBlock = 64; // copies in a block

export class Crowd extends THREE.Mesh {
  declare geometry: THREE.InstancedBufferGeometry;
  // 16 numbers for each copy, column by column.
  readonly matrices: Float32Array;
  private shown = 0;
  private readonly picture: THREE.DataTexture;
  private readonly one: THREE.Mesh; // a single copy, for raycasts

  // most: the largest number of copies.
  constructor(geometry: THREE.BufferGeometry, most: number) {
    const blocks = Math.max(1, Math.ceil(most / kBlock)),
      matrices = new Float32Array(blocks * kBlock * 16);
    const picture = new THREE.DataTexture(
      matrices,
      kTexels * kBlock,
      blocks,
      THREE.RGBAFormat,
      THREE.FloatType,
    );
    super(blockOf(geometry), plainMaterial({ vertexColors: true }, picture));
    this.matrices = matrices;
    this.picture = picture;
    this.one = new THREE.Mesh(geometry, this.material);
    this.frustumCulled = false;
    this.showFirst(0);
  }

  // Shows the first copies, with their current matrices.
  showFirst(count: number): void {
    const blocks = Math.ceil(count / kBlock);
    this.shown = count;
    this.visible = count > 0;
    this.geometry.instanceCount = blocks;
    // the unused copies of the last block have no size
    this.matrices.fill(0, 16 * count, 16 * kBlock * blocks);
    if (count > 0) this.picture.needsUpdate = true;
  }

  override raycast(caster: THREE.Raycaster, hits: THREE.Intersection[]): void {
    const found: THREE.Intersection[] = [];
    for (let i = 0; i < this.shown; ++i) {
      this.one.matrixWorld.fromArray(this.matrices, 16 * i).premultiply(this.matrixWorld);
      this.one.raycast(caster, found);
      for (const hit of found) hits.push({ ...hit, object: this, instanceId: i });
      found.length = 0;
    }
  }

  override dispose(): void {
    this.picture.dispose();
    this.one.geometry.dispose();
  }
}

// The geometry repeated for a block; the attribute `copy` says which copy a vertex belongs to.
function blockOf(one: THREE.BufferGeometry): THREE.InstancedBufferGeometry {
  const block = new THREE.InstancedBufferGeometry(),
    vertices = one.getAttribute("position").count,
    index = one.getIndex()!.array;
  for (const name of ["position", "normal", "color"]) {
    const { array, itemSize } = one.getAttribute(name) as THREE.BufferAttribute,
      all = new Float32Array(array.length * kBlock);
    for (let copy = 0; copy < kBlock; ++copy) all.set(array, array.length * copy);
    block.setAttribute(name, new THREE.BufferAttribute(all, itemSize));
  }
  const copies = new Float32Array(vertices * kBlock),
    indices = new Uint32Array(index.length * kBlock);
  for (let copy = 0; copy < kBlock; ++copy) {
    copies.fill(copy, vertices * copy, vertices * (copy + 1));
    for (let i = 0; i < index.length; ++i)
      indices[index.length * copy + i] = index[i]! + vertices * copy;
  }
  block.setAttribute("copy", new THREE.BufferAttribute(copies, 1));
  block.setIndex(new THREE.BufferAttribute(indices, 1));
  return block;
}
