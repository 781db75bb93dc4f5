// Point clouds of 3-D range finders and depth cameras, in the device's frame.
import * as THREE from "three";
import { image_t, type device_info_t, type lidar_t } from "../../generated/messages";
import type { Display } from "../state/display";
import { coloursOf } from "./colouring";
import { matrixOf } from "./matrix";

const kSize_px = 2.5,
  kPlain = new THREE.Color(0xffd24a);
const kMostPoints = 40_000; // of a picture; of larger ones every second or third row and column

// x, y, z of each return in turn.
export function pointsOfLidar(scan: lidar_t): Float32Array {
  const { nlayers, ncolumns, ranges } = scan,
    points = new Float32Array(3 * ranges.length);
  let at = 0;
  for (let layer = 0; layer < nlayers; ++layer) {
    const elevation = scan.elevation0 + layer * scan.elevation_step,
      flat = Math.cos(elevation),
      up = Math.sin(elevation);
    for (let column = 0; column < ncolumns; ++column) {
      const range = ranges[layer * ncolumns + column]!;
      if (!Number.isFinite(range)) continue;
      const azimuth = scan.azimuth0 + column * scan.azimuth_step;
      points[at++] = range * flat * Math.cos(azimuth);
      points[at++] = range * flat * Math.sin(azimuth);
      points[at++] = range * up;
    }
  }
  return points.subarray(0, at);
}

// The brightness of each return, 0 to 1; null if the scanner does not measure it.
export function intensitiesOf({
  ranges,
  intensities,
}: Pick<lidar_t, "ranges" | "intensities">): Float32Array | null {
  if (intensities.length !== ranges.length) return null;
  return intensities.filter((_, i) => Number.isFinite(ranges[i]));
}

// The points of a picture of depths along the optical axis: x forward, y left, z up, in the
// device's frame. Null for pictures of another kind.
export function pointsOfDepth(picture: image_t, fov: number): Float32Array | null {
  const { width, height, pixelformat, data, row_stride } = picture;
  if (pixelformat !== image_t.PIXEL_FORMAT_FLOAT_GRAY32 || width < 1 || height < 1) return null;
  const stride = row_stride || 4 * width;
  if (data.length < (height - 1) * stride + 4 * width) return null;
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength),
    focus = width / (2 * Math.tan(fov / 2)),
    every = Math.max(1, Math.ceil(Math.sqrt((width * height) / kMostPoints))),
    points = new Float32Array(3 * Math.ceil(width / every) * Math.ceil(height / every));
  let at = 0;
  for (let v = 0; v < height; v += every) {
    for (let u = 0; u < width; u += every) {
      const depth = view.getFloat32(v * stride + 4 * u, true);
      if (!Number.isFinite(depth)) continue;
      points[at++] = depth;
      points[at++] = (depth * ((width - 1) / 2 - u)) / focus;
      points[at++] = (depth * ((height - 1) / 2 - v)) / focus;
    }
  }
  return points.subarray(0, at);
}

export class Cloud {
  readonly object = new THREE.Points(
    new THREE.BufferGeometry(),
    new THREE.PointsMaterial({
      size: kSize_px,
      sizeAttenuation: false,
      vertexColors: true,
      toneMapped: false,
      fog: false,
    }),
  );
  readonly mount = new THREE.Matrix4();
  private points = new Float32Array();
  private intensities: Float32Array | null = null;
  private colouring: Display["colouring"] = "range";

  constructor(device: device_info_t) {
    matrixOf([...device.position, ...device.orientation], 0, this.mount);
    this.object.matrixAutoUpdate = false;
    this.object.frustumCulled = false;
  }

  show(points: Float32Array, intensities: Float32Array | null): void {
    const { geometry } = this.object;
    Object.assign(this, { points, intensities });
    geometry.dispose();
    geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
    geometry.setDrawRange(0, points.length / 3);
    this.paint();
  }

  get seen(): { points: Float32Array; colours: Float32Array } {
    const colours = this.object.geometry.getAttribute("color") as THREE.BufferAttribute;
    return { points: this.points, colours: colours.array as Float32Array };
  }

  style({ size, opacity, colouring }: Display): void {
    const { material } = this.object;
    Object.assign(material, { size: kSize_px * size, opacity, transparent: opacity < 1 });
    this.colouring = colouring;
    this.paint();
  }

  private paint(): void {
    const { points, intensities, colouring, mount, object } = this,
      colours = coloursOf(points, intensities, colouring, mount.elements[14]!, kPlain);
    object.geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  }

  place(base: THREE.Matrix4, visible: boolean): void {
    this.object.matrix.multiplyMatrices(base, this.mount);
    this.object.visible = visible;
  }
}
