// The static part of the scene, as the server provides it: one JSON text and two blobs.
export interface Part {
  batch: number;
  small: number;
  shadow: boolean;
  matrix: number[]; // rows of [M | t], from the mesh to the link
  diffuse: number[];
  specular: number[];
  emissive: number[];
}
export interface LightDescription {
  type: "directional" | "point" | "spot";
  link: number;
  position: number[];
  direction: number[];
  colour: number[];
  range: number;
  outer_angle: number;
  inner_angle: number;
  intensity: number;
  constant: number;
  linear: number;
  quadratic: number;
  shadows: boolean;
}
// fast: it never moves. body: the one that carries the model, -1 if none does. pose: x, y, z, qw,
// qx, qy, qz of the model in that body, or in the world. A removed model has no name.
export interface ModelDescription {
  name: string;
  first_link: number;
  links: number;
  fast: boolean;
  robot: boolean;
  path: boolean;
  body: number;
  pose: number[];
}
// Of a robot. lower, upper: rad, or m if it slides; null: no limit.
export interface JointDescription {
  robot: string;
  name: string;
  slides: boolean;
  lower: number | null;
  upper: number | null;
}
export interface Description {
  version: number;
  world: string;
  sky: boolean;
  shadows: boolean;
  ambient: number[];
  background: number[];
  low: number[];
  high: number[];
  floor: number; // m: what robots stand on
  ceiling: number | null; // things above this height hide what is below; null for an open world
  viewpoint?: number[]; // where the file looks from: x y z, quaternion w x y z; x ahead
  meshes: [vertices: number, indices: number][];
  textures: boolean[];
  batches: [mesh: number, first: number, count: number, texture: number, flags: number][];
  kinds: Part[][];
  lights: LightDescription[];
  models: ModelDescription[];
  wheels: number[][]; // link, robot, index among its wheels, a point on the axis, the axis
  bases: { robot: string; body: number; pose: number[]; start: number[] }[];
  joints?: JointDescription[]; // pages of older logs have none
  classes?: [label: number, ...models: string[]][]; // of segmentation cameras
}
export const enum Flag {
  textured = 1,
  specular = 2,
  ground = 4,
  doubleSided = 8,
  mirrored = 16,
}

export interface MeshData {
  vertices: Float32Array;
  indices: Uint32Array;
} // a vertex: position, normal, u, v
export interface LinkData {
  kind: number;
  body: number;
  pose: Float32Array;
}

// textureUrl: the URL of that texture.
export interface SceneFiles {
  description: Description;
  meshes: MeshData[];
  links: LinkData[];
  textureUrl(index: number): string;
}

// A page with an embedded log has the scene's files in it, too.
export interface FileStore {
  file(path: string): Uint8Array<ArrayBuffer> | null;
  url(path: string): string; // the URL of a file
}

// Null without a world to show. base: the folder of its files. store: the files in the page;
// null: they come from the server.
export async function loadScene(
  store: FileStore | null,
  base = "/scene",
): Promise<SceneFiles | null> {
  const ask = async (path: string): Promise<Response> => {
    if (!store) return fetch(path);
    const bytes = store.file(path);
    return new Response(bytes, { status: bytes ? 200 : 404 });
  };
  const get = async (path: string): Promise<Response> => {
    const response = await ask(path);
    if (!response.ok) throw new Error(`${path}: ${response.status}`);
    return response;
  };
  const answer = await ask(`${base}.json`);
  if (answer.status === 404) return null;
  if (!answer.ok) throw new Error(await answer.text());
  const [description, meshBytes, linkBytes] = await Promise.all([
    answer.json() as Promise<Description>,
    get(`${base}/meshes`).then((r) => r.arrayBuffer()),
    get(`${base}/links`).then((r) => r.arrayBuffer()),
  ]);
  let at = 0;
  const meshes = description.meshes.map(([vertices, indices]) => {
    const data = {
      vertices: new Float32Array(meshBytes, at, 8 * vertices),
      indices: new Uint32Array(meshBytes, at + 32 * vertices, indices),
    };
    at += 32 * vertices + 4 * indices;
    return data;
  });
  const links: LinkData[] = [];
  const view = new DataView(linkBytes);
  for (let offset = 0; offset + 36 <= linkBytes.byteLength; offset += 36) {
    links.push({
      kind: view.getInt32(offset, true),
      body: view.getInt32(offset + 4, true),
      pose: new Float32Array(linkBytes, offset + 8, 7),
    });
  }
  const textureUrl = (index: number) => {
    const path = `${base}/textures/${index}`;
    return store ? store.url(path) : path;
  };
  return { description, meshes, links, textureUrl };
}
