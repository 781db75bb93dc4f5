// Finds the things under a point of the canvas.
import * as THREE from "three";
import type { Bodies } from "./bodies";

export class Picker {
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly camera: THREE.PerspectiveCamera,
    private readonly bodies: Bodies,
  ) {}

  // The point at that height under a point of the canvas; null above the horizon.
  level(x: number, y: number, height_m: number): THREE.Vector3 | null {
    return this.caster(x, y).ray.intersectPlane(
      new THREE.Plane(new THREE.Vector3(0, 0, 1), -height_m),
      new THREE.Vector3(),
    );
  }

  // The visible point under a point of the canvas. Beyond all models it is on the floor; null
  // above the horizon.
  point(x: number, y: number): THREE.Vector3 | null {
    return this.seen(this.caster(x, y))?.point ?? this.floor(x, y);
  }

  private floor(x: number, y: number): THREE.Vector3 | null {
    return this.level(x, y, this.bodies.description?.floor ?? 0);
  }

  // The thing under a point of the canvas: a robot (-1 for none), the name of a model ("" for none,
  // and for the ground), and the point as of point().
  pick(x: number, y: number): { robot: number; model: string; point: THREE.Vector3 | null } {
    const caster = this.caster(x, y),
      seen = this.seen(caster);
    const { bases = [], models = [] } = this.bodies.description ?? {};
    const model = models[seen?.model ?? -1]?.name ?? "";
    let robot = bases.findIndex((base) => base.robot === model),
      nearest = 0.45;
    const place = new THREE.Matrix4(),
      at = new THREE.Vector3();
    for (let i = 0; robot < 0 && !model && i < bases.length; ++i) {
      // close to it is enough
      if (!this.bodies.base(i, place)) continue;
      at.setFromMatrixPosition(place);
      at.z += 0.2;
      const away = caster.ray.distanceToPoint(at);
      if (away < nearest) [robot, nearest] = [i, away];
    }
    return {
      robot,
      model: model || (bases[robot]?.robot ?? ""),
      point: seen?.point ?? this.floor(x, y),
    };
  }

  private caster(x: number, y: number): THREE.Raycaster {
    const caster = new THREE.Raycaster();
    caster.setFromCamera(this.ndc(x, y), this.camera);
    return caster;
  }

  // The nearest model; -1 for the ground.
  private seen(caster: THREE.Raycaster): { model: number; point: THREE.Vector3 } | null {
    let nearest = Infinity,
      found: { model: number; point: THREE.Vector3 } | null = null;
    const { standing = [], movers = [] } = this.bodies.built ?? {};
    for (const part of [...standing, ...movers]) {
      const { indices, meshes, far, shown } = part,
        top = standing.includes(part) ? this.bodies.ceiling : Infinity;
      for (const mesh of far ? [...meshes, far.mesh] : meshes) {
        // the old one holds instances as they once were
        if (mesh instanceof THREE.InstancedMesh) mesh.boundingSphere = null;
        for (const { distance, instanceId, point } of caster.intersectObject(mesh, false)) {
          if (distance >= nearest || point.z > top) continue;
          nearest = distance;
          const place = (mesh === far?.mesh ? far.shown : shown)[instanceId!]!;
          const model = mesh.userData.ground ? -1 : this.bodies.modelOf(indices[place]!);
          found = { model, point: point.clone() };
        }
      }
    }
    return found;
  }

  private ndc(x: number, y: number): THREE.Vector2 {
    const box = this.canvas.getBoundingClientRect();
    return new THREE.Vector2(
      (2 * (x - box.left)) / box.width - 1,
      1 - (2 * (y - box.top)) / box.height,
    );
  }
}
