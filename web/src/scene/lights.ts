// The lights of a world. The first directional one casts the shadows, around what is looked at.
import * as THREE from "three";
import type { Description, LightDescription } from "../wire/description";

const kShadowReach_m = 14;
const kMostLamps = 6;
const kSunStays_m = 0.5; // the target may move this far before the sun follows

export class Lights {
  readonly group = new THREE.Group();
  private sun: THREE.DirectionalLight | null = null;
  private stale = false; // the shadow map is out of date

  // The lights of a world; null: of an empty floor with a grid.
  show(description: Description | null): void {
    for (const light of this.group.children)
      if (light instanceof THREE.Light || light instanceof THREE.GridHelper) light.dispose(); // also frees its shadow map
    this.group.clear();
    this.sun = null;
    if (description) return this.make(description);
    this.group.add(new THREE.HemisphereLight(0xffffff, 0x8899aa, 2.5));
    const grid = new THREE.GridHelper(40, 40, 0x888888, 0x555555);
    grid.rotation.x = Math.PI / 2;
    this.group.add(grid);
  }

  // Something has moved, so shadows must be redrawn.
  moved(): void {
    this.stale = true;
  }

  cast(on: boolean): void {
    if (this.sun) this.sun.castShadow = on;
    this.stale = true;
  }

  // To be called before each frame. True if the shadow map must be redrawn.
  aim(target: THREE.Vector3): boolean {
    const { sun } = this;
    if (!sun?.castShadow) return false;
    if (!this.stale && sun.target.position.distanceTo(target) < kSunStays_m) return false;
    sun.target.position.copy(target);
    sun.position.copy(target).addScaledVector(sun.userData.direction as THREE.Vector3, -30);
    this.stale = false;
    return true;
  }

  private make(description: Description): void {
    const ambient = Math.max(
      0.25,
      (description.ambient[0]! + description.ambient[1]! + description.ambient[2]!) / 3,
    );
    this.group.add(new THREE.HemisphereLight(0xf4f7ff, 0xa8a098, 2.6 * ambient + 0.7));
    let lamps = 0;
    for (const light of description.lights) {
      const made = lightOf(light);
      if (!(made instanceof THREE.DirectionalLight) && ++lamps > kMostLamps) continue;
      this.group.add(made);
      if ("target" in made) this.group.add((made as THREE.DirectionalLight).target);
      if (made instanceof THREE.DirectionalLight && !this.sun) this.sun = shadowing(made);
    }
  }
}

function lightOf(light: LightDescription): THREE.Light {
  const colour = new THREE.Color().setRGB(
    light.colour[0]!,
    light.colour[1]!,
    light.colour[2]!,
    THREE.SRGBColorSpace,
  );
  const position = new THREE.Vector3().fromArray(light.position),
    direction = new THREE.Vector3().fromArray(light.direction);
  if (light.type === "directional") {
    const sun = new THREE.DirectionalLight(colour, 2.2 * light.intensity);
    sun.userData.direction = direction.normalize();
    sun.position.copy(direction).multiplyScalar(-20);
    return sun;
  }
  const strength = (4 * light.intensity) / Math.max(0.3, light.constant);
  if (light.type === "point") {
    const lamp = new THREE.PointLight(colour, strength, 2 * light.range, 1);
    lamp.position.copy(position);
    return lamp;
  }
  const spot = new THREE.SpotLight(
    colour,
    strength,
    2 * light.range,
    Math.min(1.5, light.outer_angle / 2 || 0.6),
    0.4,
    1,
  );
  spot.position.copy(position);
  spot.target.position.copy(position).add(direction);
  return spot;
}

function shadowing(sun: THREE.DirectionalLight): THREE.DirectionalLight {
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.bias = -0.0004;
  sun.shadow.normalBias = 0.02;
  sun.shadow.intensity = 0.85;
  Object.assign(sun.shadow.camera, {
    left: -kShadowReach_m,
    right: kShadowReach_m,
    top: kShadowReach_m,
    bottom: -kShadowReach_m,
    near: 1,
    far: 80,
  });
  return sun;
}
