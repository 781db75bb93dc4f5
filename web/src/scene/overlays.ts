// Sensor data and trails drawn over the scene: rays and points of range finders, sonar cones,
// trails, contacts and frames; of the chosen robot, or of all if they are few.
import * as THREE from "three";
import type {
  contact_t,
  device_info_t,
  odometry_t,
  planar_lidar_t,
  pose_t,
  sonar_t,
} from "../../generated/messages";
import { displayFor, type Display } from "../state/display";
import type { Layer } from "../state/layers";
import { Cloud, intensitiesOf } from "./clouds";
import { coloursOf } from "./colouring";
import { matrixOf } from "./matrix";
import { kOnTop, putOnTop } from "./on_top";
import { PastPoints } from "./past_points";

const kColours = {
  rays: 0xff5a4d,
  points: 0xffd24a,
  sonar: 0x3fb6ff,
  trail: 0x27c46b,
  odometry: 0xff9d2e,
  contacts: 0xff2d8a,
};
const kMostTrail = 20000; // points
const kTrailStep_m = 0.02,
  kTruthAbove_m = 0.02,
  kOdometryAbove_m = 0.025;

function devicePose(device: device_info_t, into: THREE.Matrix4): THREE.Matrix4 {
  return matrixOf([...device.position, ...device.orientation], 0, into);
}

// A geometry with a varying number of vertices.
class Strip<T extends THREE.Object3D & { geometry: THREE.BufferGeometry }> {
  private capacity = 0;
  constructor(readonly object: T) {
    object.frustumCulled = false;
  }
  write(count: number, fill: (positions: Float32Array) => void): void {
    if (count > this.capacity) {
      this.capacity = Math.max(256, 2 * count);
      this.object.geometry.setAttribute(
        "position",
        new THREE.BufferAttribute(new Float32Array(3 * this.capacity), 3).setUsage(
          THREE.DynamicDrawUsage,
        ),
      );
    }
    const attribute = this.object.geometry.getAttribute("position") as
      THREE.BufferAttribute | undefined;
    if (attribute) {
      fill(attribute.array as Float32Array);
      attribute.needsUpdate = true;
    }
    this.object.geometry.setDrawRange(0, count);
  }
  // The colours of the vertices.
  paint(colours: Float32Array): void {
    const { geometry } = this.object;
    let attribute = geometry.getAttribute("color") as THREE.BufferAttribute | undefined;
    if (!attribute || attribute.count < this.capacity) {
      attribute = new THREE.BufferAttribute(new Float32Array(3 * this.capacity), 3);
      geometry.setAttribute("color", attribute.setUsage(THREE.DynamicDrawUsage));
    }
    (attribute.array as Float32Array).set(colours);
    attribute.needsUpdate = true;
  }
}

// Makes a material see-through, or not.
const fade = <M extends THREE.Material>(material: M, opacity: number) =>
  Object.assign(material, { opacity, transparent: opacity < 1 });

const glow = (colour: number, opacity: number) =>
  new THREE.MeshBasicMaterial({
    color: colour,
    transparent: true,
    opacity,
    side: THREE.DoubleSide,
    depthWrite: false,
    fog: false,
    toneMapped: false,
  });

// Opacities of one robot's
const kFan = 0.1,
  kRays = 0.35,
  kCones = 0.16;
const kPoint_px = 4,
  kPast_px = 2.5;
const kContact_px = 9;
const kPlainPoints = new THREE.Color(kColours.points);
const kInto = new THREE.Matrix4();

// How a layer of the robot is drawn.
export type DisplayOf = (layer: Layer) => Display;

class ScanView {
  readonly group = new THREE.Group();
  private readonly fan = new Strip(
    new THREE.Mesh(new THREE.BufferGeometry(), glow(kColours.rays, kFan)),
  );
  private readonly lines = new Strip(
    new THREE.LineSegments(
      new THREE.BufferGeometry(),
      new THREE.LineBasicMaterial({
        color: kColours.rays,
        transparent: true,
        opacity: kRays,
        toneMapped: false,
        fog: false,
      }),
    ),
  );
  private readonly points = new Strip(
    new THREE.Points(
      new THREE.BufferGeometry(),
      new THREE.PointsMaterial({
        vertexColors: true,
        size: kPoint_px,
        sizeAttenuation: false,
        toneMapped: false,
        fog: false,
      }),
    ),
  );
  readonly mount = new THREE.Matrix4();
  private hits = 0;
  private colours: Float32Array = new Float32Array();
  private intensities: Float32Array | null = null;
  private colouring: Display["colouring"] = "plain";

  constructor(private readonly device: device_info_t) {
    devicePose(device, this.mount);
    this.group.add(this.fan.object, this.lines.object, this.points.object);
    this.group.matrixAutoUpdate = false;
  }

  // Its latest sample, in its own frame.
  get seen(): { points: Float32Array; colours: Float32Array } {
    const all = this.points.object.geometry.getAttribute("position") as THREE.BufferAttribute,
      points = (all.array as Float32Array).subarray(0, 3 * this.hits);
    return { points, colours: this.colours };
  }

  style(of: DisplayOf, share: number): void {
    const { strength } = of("rays"),
      { size, opacity, colouring } = of("points"),
      { material } = this.points.object;
    this.fan.object.material.opacity = Math.min(1, kFan * strength * share);
    this.lines.object.material.opacity = Math.min(1, kRays * strength * share);
    fade(material, opacity).size = kPoint_px * size;
    this.colouring = colouring;
    if (this.hits > 0) this.paint();
  }

  private paint(): void {
    this.colours = coloursOf(
      this.seen.points,
      this.intensities,
      this.colouring,
      this.mount.elements[14]!,
      kPlainPoints,
    );
    this.points.paint(this.colours);
  }

  show(scan: planar_lidar_t): void {
    const { ranges, rad0, radstep } = scan,
      limit = this.device.range_max,
      n = ranges.length;
    const end = (i: number) => {
      const r = ranges[i]!;
      return r === -Infinity ? 0 : Math.min(r, limit);
    };
    let hits = 0;
    this.points.write(n, (p) => {
      for (let i = 0; i < n; ++i) {
        const r = ranges[i]!;
        if (!Number.isFinite(r)) continue;
        const a = rad0 + i * radstep;
        p[3 * hits] = r * Math.cos(a);
        p[3 * hits + 1] = r * Math.sin(a);
        p[3 * hits + 2] = 0;
        ++hits;
      }
    });
    this.points.object.geometry.setDrawRange(0, hits);
    this.hits = hits;
    this.intensities = intensitiesOf(scan);
    if (n > 0) this.paint();
    const every = Math.max(1, Math.round(n / 180));
    const shown = Math.ceil(n / every);
    this.lines.write(2 * shown, (p) => {
      for (let k = 0; k < shown; ++k) {
        const i = k * every,
          a = rad0 + i * radstep,
          r = end(i);
        p.fill(0, 6 * k, 6 * k + 6);
        p[6 * k + 3] = r * Math.cos(a);
        p[6 * k + 4] = r * Math.sin(a);
      }
    });
    this.fan.write(3 * Math.max(0, n - 1), (p) => {
      for (let i = 0; i + 1 < n; ++i) {
        const a = rad0 + i * radstep,
          b = a + radstep,
          r = end(i),
          s = end(i + 1);
        p.fill(0, 9 * i, 9 * i + 9);
        p[9 * i + 3] = r * Math.cos(a);
        p[9 * i + 4] = r * Math.sin(a);
        p[9 * i + 6] = s * Math.cos(b);
        p[9 * i + 7] = s * Math.sin(b);
      }
    });
  }

  place(base: THREE.Matrix4, layers: ReadonlySet<Layer>): void {
    this.group.matrix.multiplyMatrices(base, this.mount);
    this.lines.object.visible = this.fan.object.visible = layers.has("rays");
    this.points.object.visible = layers.has("points");
  }
}

class SonarView {
  readonly group = new THREE.Group();
  private readonly cones = new Strip(
    new THREE.Mesh(new THREE.BufferGeometry(), glow(kColours.sonar, kCones)),
  );
  private readonly arcs = new Strip(
    new THREE.LineSegments(
      new THREE.BufferGeometry(),
      new THREE.LineBasicMaterial({
        color: kColours.sonar,
        transparent: true,
        opacity: 0.9,
        toneMapped: false,
        fog: false,
      }),
    ),
  );
  private readonly mount = new THREE.Matrix4();

  constructor(private readonly device: device_info_t) {
    devicePose(device, this.mount);
    this.group.add(this.cones.object, this.arcs.object);
    this.group.matrixAutoUpdate = false;
  }

  style(of: DisplayOf, share: number): void {
    this.cones.object.material.opacity = Math.min(1, kCones * of("sonar").strength * share);
  }

  show(sonar: sonar_t): void {
    const pieces = 8,
      half = this.device.fov_horizontal / 2;
    const shown: number[] = [];
    for (let i = 0; i < Math.min(sonar.n, this.device.nelements); ++i) {
      if (Number(sonar.fired_utime[i]!) >= 0) shown.push(i);
    }
    const arc = (element: number, share: number, p: Float32Array, at: number) => {
      const pose = this.device.element_pose,
        yaw = pose[6 * element + 5]! + half * (2 * share - 1),
        r = sonar.range[element]!;
      p[at] = pose[6 * element]! + r * Math.cos(yaw);
      p[at + 1] = pose[6 * element + 1]! + r * Math.sin(yaw);
      p[at + 2] = pose[6 * element + 2]!;
    };
    this.cones.write(3 * pieces * shown.length, (p) => {
      shown.forEach((element, s) => {
        for (let k = 0; k < pieces; ++k) {
          const at = 9 * (s * pieces + k);
          for (let c = 0; c < 3; ++c) p[at + c] = this.device.element_pose[6 * element + c]!;
          arc(element, k / pieces, p, at + 3);
          arc(element, (k + 1) / pieces, p, at + 6);
        }
      });
    });
    const echoes = shown.filter((element) => sonar.range[element]! < this.device.range_max - 1e-3);
    this.arcs.write(2 * pieces * echoes.length, (p) => {
      echoes.forEach((element, s) => {
        for (let k = 0; k < pieces; ++k) {
          arc(element, k / pieces, p, 6 * (s * pieces + k));
          arc(element, (k + 1) / pieces, p, 6 * (s * pieces + k) + 3);
        }
      });
    });
  }

  place(base: THREE.Matrix4, layers: ReadonlySet<Layer>): void {
    this.group.matrix.multiplyMatrices(base, this.mount);
    this.group.visible = layers.has("sonar");
  }
}

class Trail {
  readonly strip: Strip<THREE.Line>;
  private points: number[] = [];
  constructor(colour: number) {
    this.strip = new Strip(
      new THREE.Line(
        new THREE.BufferGeometry(),
        new THREE.LineBasicMaterial({ color: colour, toneMapped: false, fog: false }),
      ),
    );
  }
  add(x: number, y: number, z: number): void {
    const n = this.points.length;
    if (n >= 3 && Math.hypot(x - this.points[n - 3]!, y - this.points[n - 2]!) < kTrailStep_m)
      return;
    this.points.push(x, y, z);
    if (this.points.length > 3 * kMostTrail) this.points.splice(0, 3 * (kMostTrail / 4));
    this.strip.write(this.points.length / 3, (p) => p.set(this.points));
  }
  clear(): void {
    this.set([]);
  }
  set(points: [number, number, number][]): void {
    this.points = [];
    const step2 = kTrailStep_m ** 2;
    let [x0, y0] = [Infinity, Infinity];
    for (const [x, y, z] of points) {
      if ((x - x0) ** 2 + (y - y0) ** 2 < step2) continue;
      this.points.push(x, y, z);
      [x0, y0] = [x, y];
    }
    this.points.splice(0, this.points.length - 3 * kMostTrail);
    this.strip.write(this.points.length / 3, (p) => p.set(this.points));
  }
}

// All overlays of one robot.
export class RobotOverlay {
  readonly group = new THREE.Group();
  private readonly scans = new Map<string, ScanView>();
  private readonly sonars = new Map<string, SonarView>();
  readonly clouds = new Map<string, Cloud>();
  private readonly past = new Map<string, PastPoints>(); // of each device
  private readonly base = new THREE.Matrix4();
  private readonly truth = new Trail(kColours.trail);
  private readonly odometry = new Trail(kColours.odometry);
  private readonly contacts = new Strip(
    new THREE.Points(
      new THREE.BufferGeometry(),
      new THREE.PointsMaterial({
        color: kColours.contacts,
        size: kContact_px,
        sizeAttenuation: false,
        ...kOnTop,
      }),
    ),
  );
  private readonly frames = new THREE.Group();
  private readonly baseFrame = new THREE.Group();
  private readonly odom = new THREE.Matrix4(); // odom in the world
  private readonly point = new THREE.Vector3();
  private changed = true;
  private share = 1; // of the opacity of rays and cones
  private display: DisplayOf = (layer) => displayFor(new Map(), layer, "");

  constructor(
    devices: device_info_t[],
    start: number[],
    readonly key: string,
  ) {
    putOnTop(this.contacts.object);
    matrixOf(start, 0, this.odom);
    const odomFrame = new THREE.AxesHelper(0.35);
    odomFrame.applyMatrix4(this.odom);
    this.baseFrame.add(new THREE.AxesHelper(0.5));
    this.frames.add(this.baseFrame, odomFrame);
    this.baseFrame.matrixAutoUpdate = false;
    for (const device of devices) {
      const axes = new THREE.AxesHelper(0.14);
      if (!["odometry", "pose", "motion", "collisions", "joints"].includes(device.kind)) {
        axes.applyMatrix4(devicePose(device, new THREE.Matrix4()));
        this.baseFrame.add(axes);
      }
    }
    this.group.add(
      this.truth.strip.object,
      this.odometry.strip.object,
      this.contacts.object,
      this.frames,
    );
  }

  scan(device: device_info_t, message: planar_lidar_t): void {
    const view = this.view(this.scans, device, ScanView);
    view.show(message);
    this.stay(device.name, Number(message.utime) * 1e-6, view);
    this.changed = true;
  }
  sonar(device: device_info_t, message: sonar_t): void {
    this.view(this.sonars, device, SonarView).show(message);
    this.changed = true;
  }
  // time_s: of the message.
  cloud(
    device: device_info_t,
    time_s: number,
    points: Float32Array,
    intensities: Float32Array | null,
  ): void {
    let cloud = this.clouds.get(device.name);
    if (!cloud) {
      cloud = new Cloud(device);
      cloud.style(this.display("clouds"));
      this.clouds.set(device.name, cloud);
      this.group.add(cloud.object);
    }
    cloud.show(points, intensities);
    this.stay(device.name, time_s, cloud);
    this.changed = true;
  }
  // A device's sample stays at its place in the world.
  private stay(
    device: string,
    time_s: number,
    { seen, mount }: Pick<ScanView, "seen" | "mount">,
  ): void {
    const { decay_s, size, opacity } = this.display(this.clouds.has(device) ? "clouds" : "points");
    let past = this.past.get(device);
    if (!past) {
      if (decay_s === 0) return;
      past = new PastPoints();
      this.past.set(device, past);
      this.group.add(past.object);
    }
    fade(past.object.material, opacity).size = kPast_px * size;
    past.add(time_s, decay_s, seen, kInto.multiplyMatrices(this.base, mount));
  }
  pose(message: pose_t): void {
    this.truth.add(message.pos[0]!, message.pos[1]!, message.pos[2]! + kTruthAbove_m);
    this.changed = true;
  }
  odometer({ x, y }: odometry_t): void {
    this.odometry.add(...this.reckoned(x, y));
    this.changed = true;
  }
  private reckoned(x: number, y: number): [number, number, number] {
    return this.point.set(x, y, kOdometryAbove_m).applyMatrix4(this.odom).toArray();
  }
  // The trails up to another moment: positions in the world, and in odom.
  retrace(truth: [number, number, number][], odometry: [number, number][]): void {
    this.truth.set(truth.map(([x, y, z]) => [x, y, z + kTruthAbove_m]));
    this.odometry.set(odometry.map(([x, y]) => this.reckoned(x, y)));
    this.changed = true;
  }
  // robots: how many there are; their rays and cones lie over each other, and are painted fainter.
  style(display: DisplayOf, robots: number): void {
    this.display = display;
    this.share = 1 / Math.max(1, robots);
    for (const view of [...this.scans.values(), ...this.sonars.values()])
      view.style(display, this.share);
    for (const cloud of this.clouds.values()) cloud.style(display("clouds"));
    fade(this.truth.strip.object.material as THREE.Material, display("trail").opacity);
    fade(this.odometry.strip.object.material as THREE.Material, display("odometry").opacity);
    const { size, opacity } = display("contacts");
    Object.assign(this.contacts.object.material, { opacity, size: kContact_px * size });
    this.frames.traverse((axes) => {
      if (axes instanceof THREE.AxesHelper) axes.scale.setScalar(display("frames").size);
    });
    this.changed = true;
  }
  contact(message: contact_t): void {
    this.contacts.write(message.n, (p) =>
      message.points.forEach(({ position }, i) => p.set(position, 3 * i)),
    );
    this.changed = true;
  }
  dispose(): void {
    this.group.traverse((object) => {
      if (!(
        object instanceof THREE.Mesh ||
        object instanceof THREE.Line ||
        object instanceof THREE.Points
      ))
        return;
      (object.geometry as THREE.BufferGeometry).dispose();
      (object.material as THREE.Material).dispose();
    });
  }
  // Clears the trails, and the contacts until new ones arrive.
  forget(): void {
    this.truth.clear();
    this.odometry.clear();
    this.contacts.write(0, () => undefined);
    for (const past of this.past.values()) past.clear();
    this.changed = true;
  }

  place(base: THREE.Matrix4, layers: ReadonlySet<Layer>): boolean {
    for (const view of [...this.scans.values(), ...this.sonars.values()]) view.place(base, layers);
    for (const cloud of this.clouds.values()) cloud.place(base, layers.has("clouds"));
    this.baseFrame.matrix.copy(base);
    this.base.copy(base);
    for (const [name, { object }] of this.past)
      object.visible = layers.has(this.clouds.has(name) ? "clouds" : "points");
    this.truth.strip.object.visible = layers.has("trail");
    this.odometry.strip.object.visible = layers.has("odometry");
    this.contacts.object.visible = layers.has("contacts");
    this.frames.visible = layers.has("frames");
    const changed = this.changed;
    this.changed = false;
    return changed;
  }

  private view<V extends ScanView | SonarView>(
    views: Map<string, V>,
    device: device_info_t,
    Make: new (device: device_info_t) => V,
  ): V {
    let view = views.get(device.name);
    if (!view) {
      view = new Make(device);
      view.style(this.display, this.share);
      views.set(device.name, view);
      this.group.add(view.group);
    }
    return view;
  }
}
