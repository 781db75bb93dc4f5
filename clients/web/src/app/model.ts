// What the page is about, without anything that shows it: what is known of a run, where that comes
// from, and what can be asked of it.
import { Control } from "../control";
import { Clock } from "../state/clock";
import { makePage } from "../state/page";
import { Poses } from "../state/poses";
import { Wanted } from "../state/wanted";
import { Link } from "../wire/link";
import { LogFile } from "../wire/log_file";
import type { RunLink } from "../wire/protocol";
import { Rewind } from "../wire/rewind";
import { Session } from "../wire/session";

export class Model {
  readonly page = makePage();
  readonly poses = new Poses();
  readonly file = LogFile.inPage(); // the log of a page that has it in itself; null: it is served
  readonly rewind = this.file ? null : new Rewind(new Link()); // of what may be live
  readonly link: RunLink = this.file ?? this.rewind!;
  readonly session = new Session((channel, message) => this.link.command(channel, message));
  readonly clock = new Clock(this.page, (reset) => this.forget(reset));
  readonly control = new Control(this.page, this.link, this.session, this.clock);
  readonly wanted = new Wanted(this.page, this.link);
  private readonly forgetters: ((reset: boolean) => void)[] = [];

  // Calls when what was drawn along the way is not of this moment any more. reset: the world was
  // reset.
  onForget(call: (reset: boolean) => void): void {
    this.forgetters.push(call);
  }
  private forget(reset: boolean): void {
    this.poses.jump();
    for (const call of this.forgetters) call(reset);
  }

  // A moment of a log, or of the past of a live run.
  seek(time_s: number): void {
    if (this.page.now.hello?.mode === "log") this.link.seek(time_s);
    else this.rewind?.show(time_s);
  }

  // A step of a live run, or a state of what is past, to and fro.
  step(ahead: boolean): void {
    const { past, paused, hello } = this.page.now;
    if (ahead && hello?.mode !== "log" && !past && paused) this.control.step();
    else this.link.step(ahead);
  }

  // What runs now.
  live(): void {
    this.rewind?.live();
  }
}
