// The time that is shown, taken from the messages.
import type { Page } from "./page";

const kBack_s = 0.5; // a longer step back is a jump, not a message that came late

export class Clock {
  epoch = -1;
  private last: { wall_s: number; sim_s: number } | null = null;
  private moved = false; // to another moment, whose state has not come yet

  // forget: called when the drawn state is of another moment. reset: because the world was
  // reset.
  constructor(
    private readonly page: Page,
    private readonly forget: (reset: boolean) => void,
  ) {}

  // isState: only states announce a jump back; other messages may be older than the last state.
  tell(time_s: number, epoch: number, isState = false): void {
    const { time_s: before_s, past } = this.page.now;
    if (past && !isState) return; // what runs now has another time than what is shown
    if (isState && (epoch !== this.epoch || time_s < before_s - kBack_s)) {
      const reset = epoch !== this.epoch;
      this.epoch = epoch;
      this.jump(reset);
    } else if (epoch !== this.epoch || (time_s < before_s && !(isState && this.moved))) return;
    if (isState) this.moved = false;
    this.page.set({ time_s });
    const wall_s = performance.now() / 1000;
    if (this.last && wall_s - this.last.wall_s < 1) return;
    if (this.last)
      this.page.set({ factor: (time_s - this.last.sim_s) / (wall_s - this.last.wall_s) });
    this.last = { wall_s, sim_s: time_s };
  }

  // Another moment was requested: the next state counts, however little it goes back.
  move(): void {
    this.moved = true;
  }

  // Likewise, and nothing of what was drawn is near it.
  jump(reset = false): void {
    this.move();
    this.last = null;
    this.forget(reset);
  }
}

// With as many decimals as the time step has, at least two.
export function clockText(time_s: number, step_us: number): string {
  let decimals = 2;
  while (decimals < 6 && step_us > 0 && step_us % 10 ** (6 - decimals) !== 0) ++decimals;
  return `${time_s.toFixed(decimals)} s`;
}
