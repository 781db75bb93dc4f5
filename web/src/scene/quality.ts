// The level of detail: as high as the display allows, and lower where frames take too long, as on
// machines without a GPU. Otherwise a page that draws in software would answer keys late, and a
// robot's watchdog would stop it between two commands.
export type Change = "motion" | "sensing" | "none";
export interface Level {
  ratio: number; // canvas pixels per CSS pixel, at most
  shadows: boolean;
  plain: boolean; // surfaces without gloss
}

const kLevels: Level[] = [
  { ratio: 2, shadows: true, plain: false },
  { ratio: 1, shadows: false, plain: false },
  { ratio: 1, shadows: false, plain: true },
  { ratio: 0.6, shadows: false, plain: true },
  { ratio: 0.5, shadows: false, plain: true },
  { ratio: 0.4, shadows: false, plain: true },
];
const kSoftwareLevel = 3; // the first level of a software rasteriser
const kSensing = 2; // the coarsest level while only sensor data changes: all pixels
const kSensingShare = 3; // at most one part in so many of the time is spent on that
// Longest time of a frame: 20 frames a second on a GPU; 48 with a software rasteriser, which takes
// all the processor: 40, and a fifth more as a reserve.
const kSlow_ms = { hardware: 50, software: 21 };
const kQuick_ms = { hardware: 25, software: 18 };
const kFrames = 5; // consecutive frames that are averaged, without the slowest
const kFirstWait_ms = 10_000; // until a finer level is tried; doubled each time
const kStill_ms = 250; // without motion, until one frame is drawn at the highest level
const kSensed_ms = 1000; // the same after sensor data, of which more may come soon

// Whether WebGL is emulated in software here.
export function drawnBySoftware(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl
    ? String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER))
    : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

export class Quality {
  automatic = true; // false: always the highest level
  private readonly by: "software" | "hardware";
  private level: number;
  private last_ms = -1;
  private intervals: number[] = [];
  private finer_ms = 0; // when a finer level is tried
  private wait_ms = kFirstWait_ms;
  private moved_ms = -Infinity; // the last motion
  private drawn_ms = -1; // the last frame
  private phase: "moving" | "sensing" | "still" = "moving";
  private cost_ms = 0; // of a frame while only sensor data changes

  constructor(software: boolean) {
    this.by = software ? "software" : "hardware";
    this.level = software ? kSoftwareLevel : 0;
  }

  get now(): Level {
    if (!this.automatic || this.phase === "still") return kLevels[0]!;
    return kLevels[this.phase === "sensing" ? Math.min(this.level, kSensing) : this.level]!;
  }
  get reduced(): boolean {
    return this.now.ratio < 1;
  }

  // Whether to draw a frame now, and whether at another level than the last one. `motion`:
  // something has moved. `sensing`: only sensor data has changed; it is drawn with all pixels, and
  // rarely enough to leave most of the time to others. `none`: nothing has changed; after a while
  // the scene is drawn once more at the highest level.
  next(at_ms: number, change: Change): { draw: boolean; other: boolean } {
    const not = { draw: false, other: false },
      was = this.phase;
    if (change === "motion") {
      this.phase = "moving";
      this.moved_ms = at_ms;
    } else if (change === "sensing") {
      const standing = this.coarse && at_ms - this.moved_ms >= kStill_ms;
      if (standing && at_ms - this.drawn_ms < kSensingShare * this.cost_ms) return not;
      this.phase = standing ? "sensing" : "moving";
    } else {
      this.last_ms = -1;
      const wait_ms = was === "sensing" ? kSensed_ms : kStill_ms,
        fresh = this.drawn_ms < 0 || at_ms - this.drawn_ms < wait_ms;
      if (was === "still" || !this.automatic || this.level === 0 || fresh) return not;
      this.phase = "still";
    }
    if (this.phase !== "moving") this.last_ms = -1; // the next interval is not a frame's duration
    this.drawn_ms = at_ms;
    return { draw: true, other: this.phase !== was };
  }

  private get coarse(): boolean {
    return this.automatic && this.level > kSensing;
  }

  // Whether the duration of frames is to be measured.
  get isSensing(): boolean {
    return this.phase === "sensing";
  }
  took(cost_ms: number): void {
    this.cost_ms = cost_ms;
  }

  // To be called after each frame. True if the level has changed.
  drawn(at_ms: number): boolean {
    if (this.last_ms >= 0 && this.automatic) this.intervals.push(at_ms - this.last_ms);
    this.last_ms = at_ms;
    if (this.intervals.length < kFrames) return false;
    const sum = this.intervals.reduce((a, b) => a + b),
      mean = (sum - Math.max(...this.intervals)) / (kFrames - 1);
    this.intervals = [];
    if (mean > kSlow_ms[this.by] && this.level + 1 < kLevels.length) {
      ++this.level;
      this.finer_ms = at_ms + this.wait_ms;
      this.wait_ms *= 2;
      return true;
    }
    if (mean < kQuick_ms[this.by] && this.level > 0 && at_ms > this.finer_ms) {
      --this.level;
      this.finer_ms = at_ms + this.wait_ms;
      return true;
    }
    return false;
  }
}
