// Points that a sensor saw before and that stay for a while, where they were in the world.
import * as THREE from "three";

const kMostPoints = 100_000; // the newest stay

interface Seen {
  time_s: number;
  points: Float32Array; // x, y, z in the world
  colours: Float32Array;
}

export class PastPoints {
  readonly object = new THREE.Points(
    new THREE.BufferGeometry(),
    new THREE.PointsMaterial({
      sizeAttenuation: false,
      vertexColors: true,
      toneMapped: false,
      fog: false,
    }),
  );
  private seen: Seen[] = [];

  constructor() {
    this.object.frustumCulled = false;
  }

  // Points of that time, by a matrix into the world; those that are older by more than decay_s, or
  // newer, go.
  add(
    time_s: number,
    decay_s: number,
    { points, colours }: Omit<Seen, "time_s">,
    into: THREE.Matrix4,
  ): void {
    this.seen = this.seen.filter((each) => each.time_s < time_s && each.time_s > time_s - decay_s);
    if (decay_s > 0) {
      const moved = new THREE.BufferAttribute(points.slice(), 3).applyMatrix4(into);
      this.seen.push({ time_s, points: moved.array as Float32Array, colours: colours.slice() });
    }
    let count = this.seen.reduce((sum, each) => sum + each.points.length / 3, 0);
    while (count > kMostPoints && this.seen.length > 1)
      count -= this.seen.shift()!.points.length / 3;
    this.write(count);
  }

  clear(): void {
    this.seen = [];
    this.write(0);
  }

  private write(count: number): void {
    const { geometry } = this.object;
    this.object.visible = count > 0;
    geometry.dispose();
    for (const [name, key] of [
      ["position", "points"],
      ["color", "colours"],
    ] as const) {
      const all = new Float32Array(3 * count);
      let at = 0;
      for (const each of this.seen) {
        all.set(each[key], at);
        at += each[key].length;
      }
      geometry.setAttribute(name, new THREE.BufferAttribute(all, 3));
    }
    geometry.setDrawRange(0, count);
  }
}
