// What was done and can be taken back: steps one after the other, each of which may wait for the
// server.
import type { HistoryState } from "../state/page";

export interface Step {
  name: string; // "move box_1"
  apply(): Promise<boolean>; // false: it did not come to pass
  revert(): Promise<boolean>;
}

const kMostSteps = 500;

export class History {
  private done: Step[] = [];
  private undone: Step[] = [];
  private changes = 0;
  private queue: Promise<unknown> = Promise.resolve();

  constructor(private readonly changed: (state: HistoryState) => void) {}

  // Does a step. One that fails leaves no trace.
  do(step: Step): Promise<boolean> {
    return this.after(async () => {
      if (!(await step.apply())) return false;
      this.done.push(step);
      if (this.done.length > kMostSteps) this.done.shift();
      this.undone = [];
      return true;
    });
  }

  undo(): Promise<boolean> {
    return this.after(() => this.shift("revert"));
  }
  redo(): Promise<boolean> {
    return this.after(() => this.shift("apply"));
  }

  // The world is another one.
  clear(): void {
    this.done = [];
    this.undone = [];
    this.changes = 0;
    this.tell();
  }

  private async shift(how: "apply" | "revert"): Promise<boolean> {
    const [from, to] = how === "revert" ? [this.done, this.undone] : [this.undone, this.done];
    const step = from.pop();
    if (!step) return false;
    if (!(await step[how]())) return false; // what cannot be taken back is forgotten: the world has gone on without it
    to.push(step);
    return true;
  }

  // One at a time, in the order in which they were asked for.
  private after(work: () => Promise<boolean>): Promise<boolean> {
    const result = this.queue.then(async () => {
      const good = await work();
      if (good) ++this.changes;
      this.tell();
      return good;
    });
    this.queue = result.catch(() => undefined);
    return result;
  }

  private tell(): void {
    this.changed({
      undo: this.done.at(-1)?.name ?? null,
      redo: this.undone.at(-1)?.name ?? null,
      changes: this.changes,
    });
  }
}
