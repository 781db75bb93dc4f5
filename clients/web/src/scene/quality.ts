// How finely is drawn: as finely as the display can, and less where a frame takes too long, as on
// machines without a GPU. Without it, a page that draws by software answers keys late, and the
// robot's watchdog stops it between two commands.
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
  { ratio: 0.4, shadows: false, plain: true },
];
const kSoftwareLevel = 3; // where the processor draws: the first one
// Of a frame: 20 a second where a graphics processor draws, and 40 where the processor does, which
// has time left for nothing else.
const kSlow_ms = { hardware: 50, software: 25 };
const kQuick_ms = { hardware: 25, software: 18 };
const kFrames = 5; // in a row, of which the mean counts, but for the slowest
const kFirstWait_ms = 10_000; // until a finer level is tried; each time twice as long
const kStill_ms = 250; // without motion, and one frame is drawn as finely as can be

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
  private moved_ms = -1; // when something was drawn last
  private still = false; // one frame is, or was, drawn as finely as can be: nothing moves

  constructor(software: boolean) {
    this.by = software ? "software" : "hardware";
    this.level = software ? kSoftwareLevel : 0;
  }

  get now(): Level {
    return kLevels[this.automatic && !this.still ? this.level : 0]!;
  }
  get reduced(): boolean {
    return this.now.ratio < 1;
  }

  // Nothing is to be drawn: the next frame's interval says nothing. True when it has been so for a
  // while, and what is seen is to be drawn once more, as finely as can be.
  idle(at_ms: number): boolean {
    this.last_ms = -1;
    if (
      this.still ||
      !this.automatic ||
      this.level === 0 ||
      this.moved_ms < 0 ||
      at_ms - this.moved_ms < kStill_ms
    )
      return false;
    this.still = true;
    return true;
  }

  // Something is to be drawn that moves. True when that is at another level than what was drawn
  // before.
  moves(at_ms: number): boolean {
    this.moved_ms = at_ms;
    const was = this.still;
    this.still = false;
    return was;
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
