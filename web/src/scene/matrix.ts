// Poses of messages as matrices.
import * as THREE from "three";

const kPosition = new THREE.Vector3(),
  kRotation = new THREE.Quaternion(),
  kOne = new THREE.Vector3(1, 1, 1);

// The matrix of a pose x, y, z, qw, qx, qy, qz at that index of an array.
export function matrixOf(pose: ArrayLike<number>, at: number, into: THREE.Matrix4): THREE.Matrix4 {
  kPosition.set(pose[at]!, pose[at + 1]!, pose[at + 2]!);
  kRotation.set(pose[at + 4]!, pose[at + 5]!, pose[at + 6]!, pose[at + 3]!);
  return into.compose(kPosition, kRotation, kOne);
}
