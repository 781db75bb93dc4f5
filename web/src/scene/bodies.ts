// The bodies of the shown world at their poses, with turning wheels.
import * as THREE from "three";
import type { PlanarPose } from "../state/go_to";
import type { Poses } from "../state/poses";
import type { Description, ModelDescription } from "../wire/description";
import type { Built, Movers } from "./build";
import { shareOut, spread, type Eye } from "./detail";
import { matrixOf } from "./matrix";

const kSeen_rad = 1e-3; // smaller turns cannot be seen

export class Bodies {
  description: Description | null = null;
  built: Built | null = null;
  ceiling = Infinity; // m, up to which standing things are shown
  // links of a model that is shown elsewhere
  private moving: { first: number; end: number; by: THREE.Matrix4 } | null = null;
  private readonly linkWheel = new Map<
    number,
    { robot: number; place: number; axis: THREE.Vector3; centre: THREE.Vector3 }
  >();
  private readonly wheelAngles = new Map<number, Float64Array>(); // of robots whose odometry is known
  private spun = false; // wheels have turned and are not drawn yet

  // changed: called when something was moved.
  constructor(
    private readonly poses: Poses,
    private readonly changed: () => void,
  ) {}

  // Takes another world, or none.
  show(description: Description | null, built: Built | null): void {
    this.description = description;
    this.built = built;
    this.moving = null;
    this.linkWheel.clear();
    for (const [link, robot, place, ...numbers] of description?.wheels ?? [])
      this.linkWheel.set(link!, {
        robot: robot!,
        place: place!,
        centre: new THREE.Vector3().fromArray(numbers),
        axis: new THREE.Vector3().fromArray(numbers, 3),
      });
    this.place(true);
  }

  meshes(): THREE.Mesh[] {
    const { standing = [], movers = [] } = this.built ?? {};
    return [...standing, ...movers].flatMap(({ meshes, far }) =>
      far ? [...meshes, far.mesh] : meshes,
    );
  }

  // Moves everything to where it is at that time.
  advance(at_ms: number): void {
    if (!this.poses.advance(at_ms) && !this.spun) return;
    this.spun = false;
    this.place(false);
  }

  // Chooses the level of detail of each link, as seen from there.
  shareOut(eye: Eye, plain: boolean): void {
    for (const movers of this.built?.movers ?? [])
      shareOut(movers, eye, plain, (link) => this.linkWheel.has(link));
  }

  // The pose of a robot's base_link; false if it is unknown.
  base(robot: number, into: THREE.Matrix4, poses: ArrayLike<number> = this.poses.now): boolean {
    const base = this.description?.bases[robot];
    if (!base) return false;
    matrixOf(base.pose, 0, into);
    if (base.body < 0) return true;
    if (base.body >= this.poses.size) {
      matrixOf(base.start, 0, into);
      return true;
    }
    into.premultiply(matrixOf(poses, 7 * base.body, kScratch));
    return true;
  }

  // A robot's pose on the floor in the newest message, slightly ahead of what is drawn; null if it
  // is unknown.
  planar(robot: number): PlanarPose | null {
    const at = new THREE.Matrix4();
    if (robot < 0 || !this.base(robot, at, this.poses.to)) return null;
    const [cosine, sine] = at.elements;
    const [x, y, z] = at.elements.slice(12) as [number, number, number];
    return { x, y, z, heading: Math.atan2(sine, cosine) };
  }

  // The pose of a model.
  modelAt(model: ModelDescription, into: THREE.Matrix4): void {
    matrixOf(model.pose, 0, into);
    if (model.body >= 0 && model.body < this.poses.size)
      into.premultiply(matrixOf(this.poses.now, 7 * model.body, kScratch));
  }

  // The index of the model that a link belongs to.
  modelOf(link: number): number {
    return this.description!.models.findIndex(
      ({ first_link, links }) => link >= first_link && link < first_link + links,
    );
  }

  // Shows a model moved by that transform; null: where it is.
  preview(model: ModelDescription | null, by: THREE.Matrix4): void {
    this.moving = model
      ? { first: model.first_link, end: model.first_link + model.links, by: by.clone() }
      : null;
    this.place(true);
  }

  // The box around a model's visible shapes; empty if it has none.
  boxOf(model: ModelDescription): THREE.Box3 {
    const box = new THREE.Box3(),
      part = new THREE.Box3(),
      matrix = new THREE.Matrix4();
    for (const { indices, meshes, far } of [
      ...(this.built?.standing ?? []),
      ...(this.built?.movers ?? []),
    ]) {
      indices.forEach((link, place) => {
        if (link < model.first_link || link >= model.first_link + model.links) return;
        for (const mesh of meshes) {
          if (mesh.userData.ground) continue;
          if (!mesh.geometry.boundingBox) mesh.geometry.computeBoundingBox();
          if (far) matrix.fromArray(far.matrices, 16 * place);
          else mesh.getMatrixAt(place, matrix);
          box.union(part.copy(mesh.geometry.boundingBox!).applyMatrix4(matrix));
        }
      });
    }
    return box;
  }

  // Sets a robot's wheel angles; wheels may turn while the robot stands.
  turnWheels(robot: number, angles: Float64Array): void {
    const before = this.wheelAngles.get(robot);
    if (before && angles.every((angle, i) => Math.abs(angle - before[i]!) < kSeen_rad)) return;
    this.wheelAngles.set(robot, angles);
    this.spun = true;
  }

  private place(all: boolean): void {
    if (!this.built || (this.poses.size === 0 && !all)) return;
    for (const movers of this.built.movers) this.placeMovers(movers);
    if (all) for (const standing of this.built.standing) this.placeStanding(standing);
    this.changed();
  }

  private placeMovers({ links, indices, meshes, far }: Movers): void {
    const array = far?.matrices ?? (meshes[0]!.instanceMatrix.array as Float32Array);
    for (let i = 0; i < links.length; ++i) {
      const link = links[i]!;
      matrixOf(link.pose, 0, kLocal);
      const wheel = this.linkWheel.get(indices[i]!);
      const angle = wheel && this.wheelAngles.get(wheel.robot)?.[wheel.place];
      if (wheel && angle) {
        kTurn
          .makeTranslation(wheel.centre)
          .multiply(kSpin.makeRotationAxis(wheel.axis, angle))
          .multiply(kBack.makeTranslation(-wheel.centre.x, -wheel.centre.y, -wheel.centre.z));
        kLocal.multiply(kTurn);
      }
      if (link.body < this.poses.size)
        kLocal.premultiply(matrixOf(this.poses.now, 7 * link.body, kScratch));
      else kLocal.multiplyScalar(0);
      this.shift(indices[i]!, kLocal).toArray(array, 16 * i);
    }
    if (!far) spread(meshes);
  }

  private placeStanding({ links, indices, meshes }: Movers): void {
    links.forEach(({ pose }, i) => {
      this.shift(indices[i]!, matrixOf(pose, 0, kLocal)).toArray(
        meshes[0]!.instanceMatrix.array as Float32Array,
        16 * i,
      );
    });
    spread(meshes);
    for (const mesh of meshes) mesh.computeBoundingSphere();
  }

  // Applies the preview to a link.
  private shift(link: number, matrix: THREE.Matrix4): THREE.Matrix4 {
    const { moving } = this;
    return moving && link >= moving.first && link < moving.end
      ? matrix.premultiply(moving.by)
      : matrix;
  }
}

const kScratch = new THREE.Matrix4(),
  kLocal = new THREE.Matrix4(),
  kTurn = new THREE.Matrix4(),
  kSpin = new THREE.Matrix4(),
  kBack = new THREE.Matrix4();
