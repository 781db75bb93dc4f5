// The drawings of clients: lines, paths, points, texts and maps, in layers, in the world or moving
// with a robot.
import * as THREE from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { marker_t, type markers_t } from "../../generated/messages";
import type { Page } from "../state/page";
import { matrixOf } from "./matrix";
import type { Stage } from "./stage";

const kMostLayers = 64; // the newest ones are kept
const kTextHeight_px = 64;
const kUnknown = 255;
// Height above the floor that a map lies on
const kMapAbove_m = 0.01;

interface Layer {
  frame: string;
  group: THREE.Group;
}

export class Markers {
  readonly layers = new Map<string, Layer>();
  private readonly at = new THREE.Matrix4();

  constructor(
    private readonly page: Page,
    private readonly stage: Stage,
  ) {
    page.watch(["layers"], () => stage.touch());
  }

  // Replaces everything in its layer.
  take({ layer, frame, markers }: markers_t): void {
    this.drop(layer);
    if (markers.length > 0) {
      if (this.layers.size >= kMostLayers) this.drop([...this.layers.keys()][0]!);
      const group = new THREE.Group();
      group.matrixAutoUpdate = false;
      for (const marker of markers) {
        const object = objectOf(marker);
        if (object) group.add(placed(object, marker));
      }
      this.layers.set(layer, { frame, group });
      this.stage.scene.add(group);
    }
    this.page.set({ drawn: this.layers.size > 0 });
    this.stage.sense();
  }

  // Removes everything.
  clear(): void {
    for (const layer of [...this.layers.keys()]) this.drop(layer);
    this.page.set({ drawn: false });
    this.stage.touch();
  }

  // Moves markers with their robots; those of a missing robot are hidden.
  place(): void {
    const { scene, layers } = this.page.now,
      visible = layers.has("markers");
    for (const { frame, group } of this.layers.values()) {
      const base = frame ? (scene?.bases.findIndex(({ robot }) => robot === frame) ?? -1) : -1;
      group.visible = visible && (!frame || this.stage.bodies.base(base, this.at));
      if (frame && group.visible) group.matrix.copy(this.at);
    }
  }

  private drop(layer: string): void {
    const old = this.layers.get(layer);
    if (!old) return;
    this.layers.delete(layer);
    this.stage.scene.remove(old.group);
    old.group.traverse((object) => {
      if (!(object instanceof THREE.Mesh || object instanceof THREE.Points || isSprite(object)))
        return;
      if (!isSprite(object)) (object.geometry as THREE.BufferGeometry).dispose();
      const material = object.material as THREE.MeshBasicMaterial;
      material.map?.dispose();
      material.dispose();
    });
  }
}

const isSprite = (object: THREE.Object3D): object is THREE.Sprite => object instanceof THREE.Sprite;

function placed(object: THREE.Object3D, { position, orientation }: marker_t): THREE.Object3D {
  object.matrixAutoUpdate = false;
  const size = object.matrix.clone();
  matrixOf([...position, ...orientation], 0, object.matrix).multiply(size);
  return object;
}

function objectOf(marker: marker_t): THREE.Object3D | null {
  switch (marker.kind) {
    case marker_t.LINES:
      return linesOf(marker, marker.points);
    case marker_t.PATH:
      return linesOf(marker, segmentsOf(marker.points));
    case marker_t.POINTS:
      return pointsOf(marker);
    case marker_t.TEXT:
      return textOf(marker);
    case marker_t.MAP:
      return mapOf(marker);
    default:
      return null;
  }
}

const colourOf = ({ color }: marker_t) =>
  new THREE.Color().setRGB(color[0]!, color[1]!, color[2]!, THREE.SRGBColorSpace);

function paintOf(marker: marker_t) {
  const opacity = marker.color[3]!;
  return {
    color: colourOf(marker),
    transparent: opacity !== 1,
    opacity,
    toneMapped: false,
    fog: false,
  };
}

// Both ends of each segment of a path.
export function segmentsOf(points: Float32Array): Float32Array {
  const corners = Math.floor(points.length / 3),
    segments = new Float32Array(6 * Math.max(0, corners - 1));
  for (let i = 0; i + 1 < corners; ++i) segments.set(points.subarray(3 * i, 3 * i + 6), 6 * i);
  return segments;
}

function linesOf(marker: marker_t, ends: Float32Array): THREE.Object3D | null {
  if (ends.length < 6) return null;
  const lines = new LineSegments2(
    new LineSegmentsGeometry().setPositions(ends),
    new LineMaterial({ ...paintOf(marker), worldUnits: true, linewidth: marker.size }),
  );
  lines.frustumCulled = false;
  return lines;
}

function pointsOf(marker: marker_t): THREE.Object3D {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(marker.points, 3));
  const points = new THREE.Points(
    geometry,
    new THREE.PointsMaterial({ ...paintOf(marker), size: marker.size, sizeAttenuation: true }),
  );
  points.frustumCulled = false;
  return points;
}

// Lines of text that face the camera, centred at the marker's position.
function textOf(marker: marker_t): THREE.Object3D {
  const lines = marker.text.split("\n"),
    canvas = document.createElement("canvas"),
    font = `600 ${0.75 * kTextHeight_px}px system-ui, sans-serif`;
  let pen = canvas.getContext("2d")!;
  pen.font = font;
  const width = Math.max(1, ...lines.map((line) => pen.measureText(line).width));
  canvas.width = Math.min(4096, Math.ceil(width) + 8);
  canvas.height = Math.min(4096, kTextHeight_px * lines.length);
  pen = canvas.getContext("2d")!;
  pen.font = font;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = `#${colourOf(marker).getHexString()}`;
  lines.forEach((line, i) =>
    pen.fillText(line, canvas.width / 2, (i + 0.5) * kTextHeight_px, canvas.width),
  );
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  const sprite = new THREE.Sprite(
    new THREE.SpriteMaterial({
      map,
      transparent: true,
      opacity: marker.color[3]!,
      depthWrite: false,
      toneMapped: false,
      fog: false,
    }),
  );
  const height = marker.size * lines.length;
  sprite.matrix.makeScale((height * canvas.width) / canvas.height, height, 1);
  return sprite;
}

// The colour of a map's cell (red, green, blue, alpha): free is transparent, occupied has the
// marker's colour, unknown is grey.
export function cellColour(cell: number, color: Float32Array): [number, number, number, number] {
  const [red, green, blue, alpha] = [...color].map((value) => Math.round(255 * value));
  if (cell === kUnknown) return [128, 128, 128, Math.round(alpha! / 4)];
  return [red!, green!, blue!, Math.round((alpha! * cell) / 100)];
}

function mapOf(marker: marker_t): THREE.Object3D {
  const { columns, ncells, cells, size, color } = marker,
    rows = ncells / columns,
    pixels = new Uint8Array(4 * ncells);
  cells.forEach((cell, i) => pixels.set(cellColour(cell, color), 4 * i));
  const map = new THREE.DataTexture(pixels, columns, rows);
  map.colorSpace = THREE.SRGBColorSpace;
  map.needsUpdate = true;
  const [width, height] = [columns * size, rows * size];
  return new THREE.Mesh(
    new THREE.PlaneGeometry(width, height).translate(width / 2, height / 2, kMapAbove_m),
    new THREE.MeshBasicMaterial({
      map,
      transparent: true,
      depthWrite: false,
      side: THREE.DoubleSide,
      toneMapped: false,
      fog: false,
    }),
  );
}
