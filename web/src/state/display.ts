// How what robots sense is drawn: of all robots, and of single ones that differ.
import { recall, remember } from "./memory";

export const kColourings = ["range", "height", "intensity"] as const;
export interface Display {
  size: number; // of points, times the usual one
  opacity: number; // of rays and cones, times the usual one
  cover: number; // opacity of points
  decay_s: number; // how long points stay, sim time
  colouring: (typeof kColourings)[number]; // of clouds
}
const kUsual: Display = { size: 1, opacity: 1, cover: 1, decay_s: 0, colouring: "range" };
// The least and the most of each.
export const kLimits = {
  size: [0.25, 4],
  opacity: [0.25, 4],
  cover: [0.1, 1],
  decay_s: [0, 60],
} as const;

// By the name of the robot; "": of those that are not named.
export type Displays = ReadonlyMap<string, Display>;
export const displayFor = (displays: Displays, robot: string) =>
  displays.get(robot) ?? displays.get("") ?? kUsual;

// What is wrong is as usual.
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
