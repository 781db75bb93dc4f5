// The page's data, without any views: what is known of a run, where that comes from, and what can
// be requested.
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
  readonly file = LogFile.inPage(); // the log embedded in the page; null if the page is served
  readonly rewind = this.file ? null : new Rewind(new Link()); // of a served run
  readonly link: RunLink = this.file ?? this.rewind!;
  readonly session = new Session((channel, message) => this.link.command(channel, message));
  readonly clock = new Clock(this.page, (reset) => this.forget(reset));
  readonly control = new Control(this.page, this.link, this.session, this.clock);
  readonly wanted = new Wanted(this.page, this.link);
  private readonly forgetters: ((reset: boolean) => void)[] = [];

  // Registers a call for when the drawn state is of another moment. reset: because the world was
  // reset.
  onForget(call: (reset: boolean) => void): void {
    this.forgetters.push(call);
  }
  private forget(reset: boolean): void {
    this.poses.jump();
    for (const call of this.forgetters) call(reset);
  }

  // Shows a moment of a log, or of the past of a live run.
  seek(time_s: number): void {
    if (this.page.now.hello?.mode === "log") this.link.seek(time_s);
    else this.rewind?.show(time_s);
  }

  // One step of a paused live run; in a log or the past, to the next state or the previous one.
  step(ahead: boolean): void {
    const { past, paused, hello } = this.page.now;
    if (ahead && hello?.mode !== "log" && !past && paused) this.control.step();
    else this.link.step(ahead);
  }

  // Resumes or pauses the shown past, else the log or the run itself.
  playOrPause(): void {
    const { past } = this.page.now;
    if (past) this.link.play(!past.playing, past.speed);
    else this.control.pauseOrResume();
  }

  // Back to the present.
  live(): void {
    this.rewind?.live();
  }
}
