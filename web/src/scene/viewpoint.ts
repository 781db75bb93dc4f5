// The camera: moved by the pointer or by keys, following a robot, or showing the whole world.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { ViewMode } from "../state/page";

// Home: how much of the world it shows at least, the height above the floor that it looks at, and
// the share of the view that the world fills
const kLeastHome_m = 3,
  kLookedAt_m = 1,
  kHomeShare = 0.95;
const kSeen_m2 = 1e-8; // shorter ways cannot be seen
const kFarthestSeen_m = 200, // of what a file's view looks at
  kBefore_m = 5;

// The part of the world that home shows, as a box.
export interface Shown {
  low: number[];
  high: number[];
}

// The view that home gives of a world with these bounds. ceiling: nothing above it is drawn.
export function shownOf(
  world: { low: number[]; high: number[]; floor: number; ceiling: number | null } | null,
): Shown {
  const { low, high, floor, ceiling } = world ?? {
    low: [-3, -3, 0],
    high: [3, 3, 1],
    floor: 0,
    ceiling: null,
  };
  const centre = [0, 1].map((i) => (low[i]! + high[i]!) / 2),
    half = [0, 1].map((i) => Math.max(kLeastHome_m, (high[i]! - low[i]!) / 2));
  return {
    low: [centre[0]! - half[0]!, centre[1]! - half[1]!, floor],
    high: [
      centre[0]! + half[0]!,
      centre[1]! + half[1]!,
      Math.max(floor, Math.min(high[2]!, ceiling ?? Infinity)),
    ],
  };
}

// The eye of a file's own view, and what it looks at: the floor, or what is before it.
export function viewOf(
  [x, y, z, qw, qx, qy, qz]: number[],
  floor: number,
): { eye: THREE.Vector3; target: THREE.Vector3 } {
  const eye = new THREE.Vector3(x, y, z),
    ahead = new THREE.Vector3(1, 0, 0).applyQuaternion(new THREE.Quaternion(qx, qy, qz, qw)),
    drop = (eye.z - floor) / -ahead.z,
    reach = drop > 0 && drop < kFarthestSeen_m ? drop : kBefore_m;
  return { eye, target: eye.clone().addScaledVector(ahead, reach) };
}

// How far the camera sees, from what it looks at in that distance: near enough for what stands
// before it, and not so near that what lies on a floor flickers.
export function depthOf(reach_m: number): { near: number; far: number } {
  return {
    near: Math.min(2, Math.max(0.02, reach_m / 60)),
    far: Math.max(400, 20 * reach_m),
  };
}

// The position closest to the target from which all corners are in view.
export function homeOf(
  { low, high }: Shown,
  fov_deg: number,
  aspect: number,
): { eye: THREE.Vector3; target: THREE.Vector3 } {
  const target = new THREE.Vector3(
    (low[0]! + high[0]!) / 2,
    (low[1]! + high[1]!) / 2,
    Math.min((low[2]! + high[2]!) / 2, low[2]! + kLookedAt_m),
  );
  const back = new THREE.Vector3(-0.5, -0.62, 0.62).normalize(),
    right = new THREE.Vector3(0, 0, 1).cross(back).normalize(),
    up = back.clone().cross(right);
  const upwards = kHomeShare * Math.tan((fov_deg * Math.PI) / 360),
    sideways = upwards * aspect;
  let away = 0;
  for (const x of [low[0]!, high[0]!])
    for (const y of [low[1]!, high[1]!])
      for (const z of [low[2]!, high[2]!]) {
        const corner = new THREE.Vector3(x, y, z).sub(target),
          wide = Math.abs(corner.dot(right)) / sideways,
          tall = Math.abs(corner.dot(up)) / upwards;
        away = Math.max(away, Math.max(wide, tall) + corner.dot(back));
      }
  return { eye: target.clone().addScaledVector(back, away), target };
}

export class Viewpoint {
  readonly camera = new THREE.PerspectiveCamera(50, 1, 0.05, 400);
  readonly controls: OrbitControls;
  mode: ViewMode = "orbit";
  private following = -1; // index into the description's bases; -1 for none
  private readonly followed = new THREE.Vector3();
  private lastBase: THREE.Vector3 | null = null;

  // changed: called when the camera has moved. base: the pose of a robot's base_link; false if it
  // is unknown.
  constructor(
    canvas: HTMLCanvasElement,
    private readonly changed: () => void,
    private readonly base: (robot: number, into: THREE.Matrix4) => boolean,
  ) {
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(-4, -5, 4);
    this.controls = new OrbitControls(this.camera, canvas);
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    this.controls.enableDamping = !calm.matches;
    calm.addEventListener("change", () => {
      this.controls.enableDamping = !calm.matches;
    });
    this.controls.dampingFactor = 0.15;
    this.controls.maxPolarAngle = Math.PI / 2 - 0.02;
    this.controls.addEventListener("change", changed);
  }

  setAspect(aspect: number): void {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  // Shows all of that.
  home(shown: Shown): void {
    this.begin(homeOf(shown, this.camera.fov, this.camera.aspect));
  }

  // The view that a file defines.
  begin({ eye, target }: { eye: THREE.Vector3; target: THREE.Vector3 }): void {
    this.controls.target.copy(target);
    this.look(eye.clone().sub(target));
  }

  setMode(mode: ViewMode): void {
    this.mode = mode;
    this.lastBase = null;
    this.controls.enableRotate = mode !== "top";
    if (mode === "top") {
      const height = Math.max(4, this.camera.position.distanceTo(this.controls.target));
      this.camera.position.set(
        this.controls.target.x,
        this.controls.target.y - 0.001 * height,
        this.controls.target.z + height,
      );
    }
    this.controls.minPolarAngle = 0;
    this.controls.update();
    this.changed();
  }

  // Position and target.
  get at(): number[] {
    return [...this.camera.position.toArray(), ...this.controls.target.toArray()];
  }
  set at(at: number[]) {
    this.camera.position.fromArray(at);
    this.controls.target.fromArray(at, 3);
    this.controls.update();
    this.changed();
  }

  // Turns the camera by that many radians to the right and upwards.
  turn(right: number, up: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target),
      at = new THREE.Spherical().setFromVector3(new THREE.Vector3(offset.x, offset.z, -offset.y));
    at.theta -= right;
    at.phi = Math.max(0.02, Math.min(this.controls.maxPolarAngle, at.phi - up));
    const turned = new THREE.Vector3().setFromSpherical(at);
    this.look(new THREE.Vector3(turned.x, -turned.z, turned.y));
  }

  // Multiplies the distance from the target.
  zoom(times: number): void {
    this.look(this.camera.position.clone().sub(this.controls.target).multiplyScalar(times));
  }

  // Moves to the right and ahead over the ground, by shares of the distance.
  pan(right: number, ahead: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target),
      reach = offset.length();
    const forward = this.camera.getWorldDirection(new THREE.Vector3()).setZ(0);
    if (forward.lengthSq() < 1e-6) forward.set(0, 1, 0);
    forward.normalize();
    this.controls.target
      .addScaledVector(forward, ahead * reach)
      .addScaledVector(new THREE.Vector3(forward.y, -forward.x, 0), right * reach);
    this.look(offset);
  }

  private look(offset: THREE.Vector3): void {
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.changed();
  }

  follow(robot: number): void {
    if (robot === this.following) return;
    this.following = robot;
    this.lastBase = null;
    this.changed();
  }

  // To be called before each frame.
  frame(): void {
    this.track();
    this.controls.update();
    const { near, far } = depthOf(this.reach);
    if (near === this.camera.near && far === this.camera.far) return;
    Object.assign(this.camera, { near, far });
    this.camera.updateProjectionMatrix();
  }

  // m, from what is looked at
  get reach(): number {
    return this.camera.position.distanceTo(this.controls.target);
  }

  private track(): void {
    if (this.mode !== "follow" || !this.base(this.following, kBase)) return;
    this.followed.setFromMatrixPosition(kBase);
    if (!this.lastBase) {
      const offset = this.camera.position.clone().sub(this.controls.target);
      if (offset.length() > 7) offset.setLength(5);
      this.controls.target.copy(this.followed);
      this.camera.position.copy(this.followed).add(offset);
      this.lastBase = this.followed.clone();
      return;
    }
    const shift = this.followed.clone().sub(this.lastBase);
    if (shift.lengthSq() < kSeen_m2) return;
    this.controls.target.add(shift);
    this.camera.position.add(shift);
    this.lastBase.copy(this.followed);
    this.changed();
  }
}

const kBase = new THREE.Matrix4();
