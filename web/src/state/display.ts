// How each layer is drawn: of all robots, and of single ones that differ.
import type { Layer } from "./layers";
import { recall, remember } from "./memory";

export const kColourings = ["plain", "range", "height", "intensity"] as const;
export interface Display {
  size: number; // of points and axes, times the usual one
  strength: number; // of rays and cones, times the usual opacity
  opacity: number; // of points and lines
  decay_s: number; // how long points stay, sim time
  colouring: (typeof kColourings)[number]; // of points
}
// The least and the most of each.
export const kLimits = {
  size: [0.25, 4],
  strength: [0.25, 4],
  opacity: [0.1, 1],
  decay_s: [0, 60],
} as const;

const kOfPoints: readonly (keyof Display)[] = ["size", "opacity", "decay_s", "colouring"];
// The settings of each layer.
export const kSettings: Partial<Record<Layer, readonly (keyof Display)[]>> = {
  rays: ["strength"],
  points: kOfPoints,
  sonar: ["strength"],
  clouds: kOfPoints,
  trail: ["opacity"],
  odometry: ["opacity"],
  contacts: ["size", "opacity"],
  frames: ["size"],
};

// By layer and robot; of no robot: of all that have none of their own.
export type Displays = ReadonlyMap<string, Display>;
export const displayKey = (layer: Layer, robot: string) => `${layer} ${robot}`;
export const displayFor = (displays: Displays, layer: Layer, robot: string): Display =>
  displays.get(displayKey(layer, robot)) ?? displays.get(displayKey(layer, "")) ?? usual(layer);

const usual = (layer: Layer): Display => ({
  size: 1,
  strength: 1,
  opacity: 1,
  decay_s: 0,
  colouring: layer === "clouds" ? "range" : "plain",
});

// Invalid values become the defaults.
export function displaysOf(text: string | null): Displays {
  try {
    const found = JSON.parse(text ?? "[]") as [string, Display][];
    return new Map(found.filter(([, display]) => isDisplay(display)));
  } catch {
    return new Map();
  }
}
const isDisplay = (display: Display) =>
  kColourings.includes(display.colouring) &&
  Object.entries(kLimits).every(([key, [least, most]]) => {
    const value = display[key as keyof typeof kLimits];
    return value >= least && value <= most;
  });

export const recallDisplays = () => displaysOf(recall("displays"));
export const rememberDisplays = (displays: Displays) =>
  remember("displays", JSON.stringify([...displays]));
