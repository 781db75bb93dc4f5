// Turns the description into instanced meshes: all links of a kind are one mesh for each of its
// surfaces, so that a thousand robots take a few draw calls.
import * as THREE from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { Crowd } from "./crowd";
import { arrived, finishesOf } from "./finish";
import { kFewLinks, plainKinds } from "./plain";
import { levelsOf, lift, sheetsOf } from "./sheets";
import {
  Flag,
  type LinkData,
  type MeshData,
  type Part,
  type SceneFiles,
} from "../wire/description";

const kSmall = 0.5; // share of a link's largest part; smaller parts are left out at a distance

// Links of one kind that move, and the meshes that show them.
export interface Movers {
  links: LinkData[];
  indices: number[];
  meshes: THREE.InstancedMesh[];
  far: Far | null;
  shown: number[];
} // shown: the near ones, as indices into `indices`
// For numerous links: the mesh of the distant ones, and the matrices of all. always: at every
// quality, since they are costly.
export interface Far {
  always: boolean;
  mesh: Crowd;
  matrices: Float32Array;
  shown: number[];
}
export interface Built {
  still: THREE.Group;
  moving: THREE.Group;
  movers: Movers[];
  standing: Movers[]; // what does not move
  grounds: THREE.Mesh[];
}

interface Surface {
  geometry: THREE.BufferGeometry;
  material: THREE.Material;
  shadow: boolean;
  ground: boolean;
}

const sRGB = (rgb: number[]) =>
  new THREE.Color().setRGB(rgb[0]!, rgb[1]!, rgb[2]!, THREE.SRGBColorSpace);

function gridTexture(): THREE.Texture {
  const size = 256;
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = size;
  const pen = canvas.getContext("2d")!;
  pen.fillStyle = "#ffffff";
  pen.fillRect(0, 0, size, size);
  pen.strokeStyle = "rgba(0, 0, 0, 0.16)";
  pen.lineWidth = 3;
  pen.strokeRect(0, 0, size, size);
  const texture = new THREE.CanvasTexture(canvas);
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.anisotropy = 8;
  return texture;
}

// Frees the GPU memory.
export function disposeOf({ still, moving }: Built): void {
  for (const group of [still, moving]) {
    group.traverse((object) => {
      if (!(object instanceof THREE.InstancedMesh || object instanceof Crowd)) return;
      (object.geometry as THREE.BufferGeometry).dispose();
      for (const material of finishesOf(object)) {
        (material as THREE.MeshStandardMaterial).map?.dispose();
        material.dispose();
      }
      object.dispose();
    });
  }
}

// The transform from a part's mesh to its link.
function matrixOf({ matrix: m }: Part): THREE.Matrix4 {
  return new THREE.Matrix4().fromArray([...m, 0, 0, 0, 1]).transpose();
}

// Collects triangles, each vertex of a part once.
class Corners {
  private readonly positions: number[] = [];
  private readonly normals: number[] = [];
  private readonly uvs: number[] = [];
  private readonly colours: number[] = [];
  private readonly indices: number[] = [];

  add(part: Part, { vertices, indices }: MeshData, first: number, count: number, flags: number) {
    const matrix = matrixOf(part),
      normalMatrix = new THREE.Matrix3().getNormalMatrix(matrix);
    const colour = sRGB(part.diffuse),
      v = new THREE.Vector3();
    const places = new Map<number, number>();
    for (let i = first; i < first + count; ++i) {
      // A scale with an odd number of negative factors turns triangles inside out.
      const corner = flags & Flag.mirrored ? [0, 2, 1][(i - first) % 3]! - ((i - first) % 3) : 0;
      const vertex = indices[i + corner]!;
      let place = places.get(vertex);
      if (place === undefined) {
        place = this.positions.length / 3;
        places.set(vertex, place);
        const at = 8 * vertex; // position, normal, texture coordinates
        v.fromArray(vertices, at).applyMatrix4(matrix);
        this.positions.push(v.x, v.y, v.z);
        v.fromArray(vertices, at + 3)
          .applyMatrix3(normalMatrix)
          .normalize();
        this.normals.push(v.x, v.y, v.z);
        this.uvs.push(vertices[at + 6]!, vertices[at + 7]!);
        this.colours.push(colour.r, colour.g, colour.b);
      }
      this.indices.push(place);
    }
  }

  geometry(): THREE.BufferGeometry {
    const geometry = new THREE.BufferGeometry();
    const set = (name: string, values: number[], size: number) =>
      geometry.setAttribute(name, new THREE.Float32BufferAttribute(values, size));
    set("position", this.positions, 3);
    set("normal", this.normals, 3);
    set("uv", this.uvs, 2);
    set("color", this.colours, 3);
    geometry.setIndex(this.indices);
    return geometry;
  }
}

export class SceneBuilder {
  readonly loading: Promise<void>[] = []; // textures being loaded
  private readonly textures = new Map<number, THREE.Texture>();
  private readonly levels: ReadonlyMap<Part, number>; // of what lies on something else

  constructor(private readonly files: SceneFiles) {
    this.levels = levelsOf(sheetsOf(files));
  }

  build(): Built {
    const still = new THREE.Group(),
      moving = new THREE.Group();
    const built: Built = { still, moving, movers: [], standing: [], grounds: [] };
    const { kinds } = this.files.description,
      indicesOf: number[][] = kinds.map(() => []);
    this.files.links.forEach((link, index) => indicesOf[link.kind]?.push(index));
    const plain = plainKinds(
      kinds.map((parts) => this.triangles(parts)),
      indicesOf.map(({ length }) => length),
    );
    kinds.forEach((parts, kind) => {
      const indices = indicesOf[kind]!;
      if (indices.length === 0) return;
      const surfaces = this.surfaces(parts, plain.has(kind));
      const place = (moves: boolean, into: THREE.Group): Movers | undefined => {
        const chosen = indices.filter((index) => this.files.links[index]!.body >= 0 === moves);
        if (chosen.length === 0) return undefined;
        const links = chosen.map((index) => this.files.links[index]!);
        const meshes = surfaces.map((surface) => {
          const mesh = new THREE.InstancedMesh(surface.geometry, surface.material, links.length);
          mesh.castShadow = surface.shadow;
          mesh.receiveShadow = true;
          mesh.frustumCulled = !moves;
          // drawn last, since things on it hide much of it
          mesh.renderOrder = surface.ground ? 1 : 0;
          mesh.userData = { links: chosen, ground: surface.ground };
          if (moves) mesh.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
          into.add(mesh);
          if (surface.ground) built.grounds.push(mesh);
          return mesh;
        });
        return {
          links,
          indices: chosen,
          meshes,
          shown: chosen.map((_, i) => i),
          far:
            moves && links.length > kFewLinks
              ? this.far(parts, links.length, plain.has(kind), into)
              : null,
        };
      };
      const stillOnes = place(false, still);
      if (stillOnes) built.standing.push(stillOnes);
      const movers = place(true, moving);
      if (movers) built.movers.push(movers);
    });
    return built;
  }

  private triangles(parts: Part[]): number {
    return parts.reduce((sum, part) => sum + this.batch(part, false)[2] / 3, 0);
  }

  // The surfaces of a kind of link, in the link's frame: all plain opaque parts are one surface
  // with vertex colours.
  private surfaces(parts: Part[], many: boolean): Surface[] {
    const groups = new Map<string, Part[]>();
    for (const part of parts) {
      const flags = this.batch(part, many)[4];
      const alone = part.diffuse[3]! < 0.996 || flags & (Flag.textured | Flag.ground);
      const key = alone
        ? `alone ${groups.size}`
        : `${flags & Flag.doubleSided} ${part.specular[0]! > 0.3} ${part.emissive.join()} ${part.shadow} ${this.levels.get(part) ?? 0}`;
      groups.set(key, [...(groups.get(key) ?? []), part]);
    }
    return [...groups.values()].map((group) => {
      const first = group[0]!;
      const [, , , texture, flags] = this.batch(first, many);
      return {
        geometry: this.merge(group, many),
        material: this.material(first, texture, flags),
        shadow: first.shadow,
        ground: (flags & Flag.ground) !== 0,
      };
    });
  }

  // The bounding boxes of the larger parts: a dozen triangles each, for links of a few pixels.
  private far(parts: Part[], links: number, always: boolean, into: THREE.Group): Far | null {
    const boxes = parts
      .map((part) => this.boxAround(part))
      .sort((a, b) => b.boundingSphere!.radius - a.boundingSphere!.radius);
    const seen = boxes.filter(
      (box, i) =>
        box.boundingSphere!.radius >= kSmall * boxes[0]!.boundingSphere!.radius &&
        !boxes.slice(0, i).some((larger) => larger.boundingBox!.containsBox(box.boundingBox!)),
    );
    const geometry = seen.length > 0 ? mergeGeometries(seen) : null;
    if (!geometry) return null;
    const mesh = new Crowd(geometry, links);
    into.add(mesh);
    return { mesh, matrices: new Float32Array(16 * links), shown: [], always };
  }

  // A part's bounding box in its colour, in the link's frame.
  private boxAround(part: Part): THREE.BufferGeometry {
    const [meshIndex, first, count] = this.batch(part, true);
    const { vertices, indices } = this.files.meshes[meshIndex]!;
    const box = new THREE.Box3(),
      point = new THREE.Vector3();
    for (let i = first; i < first + count; ++i)
      box.expandByPoint(point.fromArray(vertices, 8 * indices[i]!));
    const size = box.getSize(new THREE.Vector3()),
      centre = box.getCenter(new THREE.Vector3());
    const matrix = matrixOf(part);
    const geometry = new THREE.BoxGeometry(size.x, size.y, size.z)
      .translate(centre.x, centre.y, centre.z)
      .applyMatrix4(matrix);
    if (matrix.determinant() < 0) geometry.getIndex()!.array.reverse(); // keeps the outside out
    const colour = sRGB(part.diffuse).toArray(),
      corners = geometry.getAttribute("position").count;
    const colours = Array.from({ length: corners }, () => colour).flat();
    geometry.setAttribute("color", new THREE.Float32BufferAttribute(colours, 3));
    geometry.computeBoundingSphere();
    geometry.computeBoundingBox();
    return geometry;
  }

  private batch(part: Part, many: boolean) {
    return this.files.description.batches[many ? part.small : part.batch]!;
  }

  private merge(parts: Part[], many: boolean): THREE.BufferGeometry {
    const corners = new Corners();
    for (const part of parts) {
      const [meshIndex, first, count, , flags] = this.batch(part, many);
      corners.add(part, this.files.meshes[meshIndex]!, first, count, flags);
    }
    return corners.geometry();
  }

  private texture(index: number): THREE.Texture | null {
    if (index < 0 || !this.files.description.textures[index]) return null;
    let texture = this.textures.get(index);
    if (!texture) {
      let loaded = () => {};
      this.loading.push(
        new Promise<void>((resolve) => {
          loaded = resolve;
        }),
      );
      texture = new THREE.TextureLoader().load(
        this.files.textureUrl(index),
        (picture) => {
          arrived(picture);
          loaded();
        },
        undefined,
        loaded,
      );
      texture.colorSpace = THREE.SRGBColorSpace;
      texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
      texture.anisotropy = 8;
      this.textures.set(index, texture);
    }
    return texture;
  }

  private material(part: Part, textureIndex: number, flags: number): THREE.Material {
    const opacity = part.diffuse[3]!;
    const shiny = Math.max(...part.specular.slice(0, 3)) > 0.3;
    const material = new THREE.MeshStandardMaterial({
      vertexColors: true,
      roughness: shiny ? 0.45 : 0.85,
      metalness: 0,
      emissive: sRGB(part.emissive),
      side: flags & Flag.doubleSided ? THREE.DoubleSide : THREE.FrontSide,
      shadowSide: THREE.DoubleSide,
      transparent: opacity < 0.996,
      opacity,
      depthWrite: opacity >= 0.996,
    });
    lift(material, this.levels.get(part) ?? 0);
    if (flags & Flag.ground) {
      material.map = gridTexture();
      const extent = Math.hypot(part.matrix[0]!, part.matrix[4]!, part.matrix[8]!),
        across = Math.hypot(part.matrix[1]!, part.matrix[5]!, part.matrix[9]!);
      material.map.repeat.set(extent, across);
    } else if (flags & Flag.textured) {
      material.map = this.texture(textureIndex);
      material.alphaTest = 0.4;
    }
    return material;
  }
}
