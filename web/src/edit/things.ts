// The things that can be placed in a world.
import { boxModel, cylinderModel, sphereModel } from "./sdf";
import type { Thing } from "../state/page";

export const kThings: Thing[] = [
  { label: "a box", name: "box", model: "", text: boxModel("box", [0.4, 0.4, 0.4]) },
  { label: "a cylinder", name: "cylinder", model: "", text: cylinderModel("cylinder", 0.2, 0.5) },
  { label: "a ball", name: "ball", model: "", text: sphereModel("ball", 0.2) },
  { label: "Pioneer 3-AT", name: "p3at", model: "p3at", text: "" },
  { label: "Pioneer 3-DX", name: "p3dx", model: "p3dx", text: "" },
];
