// Poses as seven numbers x, y, z, qw, qx, qy, qz, and as the six that people write: x, y, z in
// metres, roll, pitch and yaw in degrees.
import * as THREE from "three";
import type { ModelDescription } from "../wire/description";
import { matrixOf } from "../scene/matrix";
import type { Poses } from "../state/poses";

export type Pose7 = number[];

const kDegree = Math.PI / 180;

export function poseOf(matrix: THREE.Matrix4): Pose7 {
  const p = new THREE.Vector3(),
    q = new THREE.Quaternion(),
    s = new THREE.Vector3();
  matrix.decompose(p, q, s);
  return [p.x, p.y, p.z, q.w, q.x, q.y, q.z];
}

// Fixed axes, roll first, as in SDF.
export function numbersOf(pose: Pose7): number[] {
  const [x, y, z, w, a, b, c] = pose as [number, number, number, number, number, number, number];
  const euler = new THREE.Euler().setFromQuaternion(new THREE.Quaternion(a, b, c, w), "ZYX");
  return [x, y, z, euler.x / kDegree, euler.y / kDegree, euler.z / kDegree];
}

export function poseFrom(numbers: number[]): Pose7 {
  const [x, y, z, roll, pitch, yaw] = numbers as [number, number, number, number, number, number];
  const q = new THREE.Quaternion().setFromEuler(
    new THREE.Euler(roll * kDegree, pitch * kDegree, yaw * kDegree, "ZYX"),
  );
  return [x, y, z, q.w, q.x, q.y, q.z];
}

// The current pose of a model; null until a state has arrived.
export function poseNow(model: ModelDescription, poses: Poses): Pose7 | null {
  const matrix = matrixOf(model.pose, 0, new THREE.Matrix4());
  if (model.body >= 0 && !poses.known[model.body]) return null;
  if (model.body >= 0) matrix.premultiply(matrixOf(poses.to, 7 * model.body, new THREE.Matrix4()));
  return poseOf(matrix);
}

export const samePose = (a: Pose7, b: Pose7, metres = 1e-6) => {
  const dot = Math.abs(a[3]! * b[3]! + a[4]! * b[4]! + a[5]! * b[5]! + a[6]! * b[6]!);
  return (
    Math.hypot(a[0]! - b[0]!, a[1]! - b[1]!, a[2]! - b[2]!) <= metres &&
    2 * Math.acos(Math.min(1, dot)) <= Math.max(metres, 1e-6)
  );
};
