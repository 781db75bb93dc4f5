// The colours of points that sensors see.
import * as THREE from "three";
import type { Display } from "../state/display";

const kHighest_m = 3, // above the floor: the coldest colour
  kFar_m = 6,
  kColdest = 0.66; // hue

// Of points x, y, z in the device's frame, which is so high above that of the robot. Warm is near,
// low, or bright; cold is far, high, or dim. intensities: null if not measured.
export function coloursOf(
  points: Float32Array,
  intensities: Float32Array | null,
  colouring: Display["colouring"],
  mount_z: number,
  plain: THREE.Color,
): Float32Array {
  const colours = new Float32Array(points.length),
    colour = plain.clone();
  const by = colouring === "intensity" && !intensities ? "range" : colouring;
  const cold = (i: number) => {
    const [x, y, z] = [points[i]!, points[i + 1]!, points[i + 2]!];
    if (by === "height") return Math.max(0, Math.min(1, (z + mount_z) / kHighest_m));
    if (by === "intensity") return 1 - intensities![i / 3]!;
    return 1 - Math.exp(-Math.hypot(x, y, z) / kFar_m);
  };
  for (let i = 0; i < points.length; i += 3) {
    if (by !== "plain") colour.setHSL(kColdest * cold(i), 1, 0.55);
    colour.toArray(colours, i);
  }
  return colours;
}
