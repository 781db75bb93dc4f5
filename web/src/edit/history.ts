// Undo and redo: steps one after the other, each of which may wait for the server.
import type { HistoryState } from "../state/page";

export interface Step {
  name: string; // "move box_1"
  apply(): Promise<boolean>; // false if it failed
  revert(): Promise<boolean>;
}

const kMostSteps = 500;

export class History {
  private done: Step[] = [];
  private undone: Step[] = [];
  private changes = 0;
  private queue: Promise<unknown> = Promise.resolve();

  constructor(private readonly changed: (state: HistoryState) => void) {}

  // Performs a step. A failed one is not recorded.
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

  // Another world has no history yet.
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
    if (!(await step[how]())) return false; // what cannot be undone is dropped: the world has changed since
    to.push(step);
    return true;
  }

  // One at a time, in the requested order.
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
