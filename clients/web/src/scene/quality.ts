// How finely is drawn: as finely as the display can, and less where a frame takes too long, as on
// machines without a GPU. Without it, a page that draws by software answers keys late, and the
// robot's watchdog stops it between two commands.
export type Change = "motion" | "sensing" | "none";
export interface Level {
  ratio: number; // pixels of the canvas per pixel of the page, at most
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
const kSoftwareLevel = 3; // where the processor draws: the first one
const kSensing = 2; // the coarsest where nothing moves, though what is sensed changes: all pixels
const kSensingShare = 3; // of the time, one part at most goes into drawing that
// Of a frame: 20 a second where a graphics processor draws, and 48 where the processor does, which
// has time left for nothing else: 40, and a fifth more against what else the machine does.
const kSlow_ms = { hardware: 50, software: 21 };
const kQuick_ms = { hardware: 25, software: 18 };
const kFrames = 5; // in a row, of which the mean counts, but for the slowest
const kFirstWait_ms = 10_000; // until a finer level is tried; each time twice as long
const kStill_ms = 250; // without motion, and one frame is drawn as finely as can be
const kSensed_ms = 1000; // the same after what is sensed, of which there may be more soon

// Whether WebGL is done by the processor here.
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
  automatic = true; // false: always the finest
  private readonly by: "software" | "hardware";
  private level: number;
  private last_ms = -1;
  private intervals: number[] = [];
  private finer_ms = 0; // when a finer level is tried
  private wait_ms = kFirstWait_ms;
  private moved_ms = -Infinity; // when something moved last
  private drawn_ms = -1; // when something was drawn last
  private phase: "moving" | "sensing" | "still" = "moving";
  private cost_ms = 0; // of a frame while sensing

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

  // Whether a frame is drawn now, and at another level than the one before. `motion`: something is
  // elsewhere. `sensing`: nothing is, but what robots sense is another scan; that is drawn with all
  // pixels, and seldom enough to leave most of the time to others. `none`: what is seen holds; when
  // it has done so for a while, it is drawn once more, as finely as can be.
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
    if (this.phase !== "moving") this.last_ms = -1; // the next interval says nothing
    this.drawn_ms = at_ms;
    return { draw: true, other: this.phase !== was };
  }

  private get coarse(): boolean {
    return this.automatic && this.level > kSensing;
  }

  // Whether how long a frame takes is to be told.
  get isSensing(): boolean {
    return this.phase === "sensing";
  }
  took(cost_ms: number): void {
    this.cost_ms = cost_ms;
  }

  // A frame was drawn. True when what comes next is drawn at another level.
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
