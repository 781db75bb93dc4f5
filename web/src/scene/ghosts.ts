// The bodies of the other run at the same moment, translucent.
import * as THREE from "three";
import type { Page } from "../state/page";
import { Poses } from "../state/poses";
import { disposeOf, SceneBuilder, type Built } from "./build";
import type { SceneFiles } from "../wire/description";
import { kLayerColours } from "../state/layers";
import { matrixOf } from "./matrix";
import type { Stage } from "./stage";

export class Ghosts {
  readonly poses = new Poses();
  private built: Built | null = null;

  constructor(
    private readonly page: Page,
    private readonly stage: Stage,
  ) {}

  // Shows those of that scene, from the next state on.
  show(files: SceneFiles | null): void {
    if (this.built) {
      this.stage.scene.remove(this.built.moving);
      disposeOf(this.built);
    }
    this.built = null;
    if (!files || !this.page.now.hello?.compared) return;
    this.built = new SceneBuilder(files).build();
    for (const movers of this.built.movers) {
      for (const mesh of movers.meshes) makeGhost(mesh);
      if (movers.far) this.built.moving.remove(movers.far.mesh);
    }
    this.built.moving.visible = false;
    this.stage.scene.add(this.built.moving);
    this.poses.forgetSeen();
  }

  // Moves them to where they are at that time; true if there is something to draw.
  place(at_ms: number): boolean {
    if (!this.built) return false;
    const { moving, movers } = this.built,
      visible = this.page.now.layers.has("ghosts") && this.poses.size > 0;
    const turned = moving.visible !== visible;
    moving.visible = visible;
    if (!visible || !this.poses.advance(at_ms)) return turned;
    for (const { links, meshes } of movers) {
      const array = meshes[0]!.instanceMatrix.array as Float32Array;
      links.forEach(({ body, pose }, i) => {
        matrixOf(pose, 0, kPlace);
        if (this.poses.known[body]) kPlace.premultiply(matrixOf(this.poses.now, 7 * body, kBody));
        else kPlace.makeScale(0, 0, 0);
        kPlace.toArray(array, 16 * i);
      });
      for (const mesh of meshes) {
        if (mesh !== meshes[0]) (mesh.instanceMatrix.array as Float32Array).set(array);
        mesh.instanceMatrix.needsUpdate = true;
      }
    }
    return true;
  }
}

// Drawn behind coinciding surfaces, so that only differences are visible.
function makeGhost(mesh: THREE.InstancedMesh): void {
  const old = mesh.material as THREE.MeshStandardMaterial;
  old.map?.dispose();
  old.dispose();
  mesh.material = new THREE.MeshLambertMaterial({
    color: kLayerColours.ghosts,
    transparent: true,
    opacity: 0.45,
    depthWrite: false,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 4,
  });
  mesh.castShadow = mesh.receiveShadow = false;
}

const kPlace = new THREE.Matrix4(),
  kBody = new THREE.Matrix4();
