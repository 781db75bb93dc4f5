// How what robots sense is drawn.
import { recall, remember } from "./memory";

export const kColourings = ["range", "height", "intensity"] as const;
export interface Display {
  size: number; // of points, times the usual one
  opacity: number; // of rays and cones, times the usual one
  colouring: (typeof kColourings)[number]; // of clouds
}
const kUsual: Display = { size: 1, opacity: 1, colouring: "range" };
export const kLeast = 0.25,
  kMost = 4; // of both

export function displayOf(text: string | null): Display {
  try {
    const { size, opacity, colouring } = JSON.parse(text ?? "null") as Display,
      within = (value: number) => value >= kLeast && value <= kMost;
    return within(size) && within(opacity) && kColourings.includes(colouring)
      ? { size, opacity, colouring }
      : kUsual;
  } catch {
    return kUsual;
  }
}
export const recallDisplay = () => displayOf(recall("display"));
export const rememberDisplay = (display: Display) => remember("display", JSON.stringify(display));
