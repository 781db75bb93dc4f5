// A log of a live run as this page receives it: all channels, from a click to the next one.
import type { Page } from "../state/page";
import { downloadName } from "../state/world_key";
import { download } from "../widgets/download";
import { h, say, toast } from "../widgets/elements";
import { LcmLog } from "../wire/lcm_log";

const kMost_bytes = 512e6;
const kNotInLogs = ["request_t", "reply_t", "world_info_t", "tick_t"];

export class LogRecorder {
  readonly button = h(
    "button",
    {
      id: "record-log",
      title: "a log of all channels, as this page receives them; --record makes a whole one",
      click: () => void this.toggle(),
    },
    "Record log",
  );
  private log: LcmLog | null = null;
  private left = new Set<string>(); // channels that are not recorded

  // changed: called when other channels are needed.
  constructor(
    private readonly page: Page,
    private readonly changed: () => void,
  ) {
    page.watch(["hello"], ({ hello }) => (this.button.hidden = hello?.mode !== "live"));
    page.watch(["world"], ({ world }) => {
      const left = (world?.channels ?? []).filter(({ type }) => kNotInLogs.includes(type));
      this.left = new Set(left.map(({ name }) => name));
      if (this.log) this.changed();
    });
  }

  // Those that it needs.
  get channels(): string[] {
    const { world } = this.page.now;
    return this.log ? (world?.channels ?? []).map(({ name }) => name) : [];
  }

  // time_s: sim time.
  message(channel: string, bytes: Uint8Array, time_s: number): void {
    const { log } = this;
    if (!log || this.left.has(channel)) return;
    log.add(channel, Math.round(1e6 * time_s), bytes);
    say(this.button, `Stop log (${(log.size * 1e-6).toFixed(1)} MB)`);
    if (log.size < kMost_bytes) return;
    toast("The log is as large as it may be.");
    this.offer(log);
  }

  reset(): void {
    this.log?.reset();
  }

  private async toggle(): Promise<void> {
    if (this.log) return this.offer(this.log);
    const answer = await fetch("/header").catch(() => null);
    if (!answer?.ok) return toast("The server does not answer: no log is recorded.", "error");
    this.log = new LcmLog(new Uint8Array(await answer.arrayBuffer()));
    this.show("Stop log");
  }

  private offer(log: LcmLog): void {
    this.log = null;
    this.show("Record log");
    download(log.blob(), downloadName(this.page.now, "", "lcm"));
  }

  private show(words: string): void {
    this.button.classList.toggle("on", this.log !== null);
    say(this.button, words);
    this.changed();
  }
}
