// Whether a connected server still answers. A connection outlives a server that was stopped and a
// network that broke; without this the page would show old data as if it were current.
const kQuiet_ms = 3000; // without a message; then the page pings the server

export class Heartbeat {
  private heard_ms = 0;
  private asking = false;
  private silent = false;

  // ask: resolves when the server has answered, rejects if it has not within some seconds. told:
  // called with true when the server falls silent and with false when it answers again.
  constructor(
    private readonly ask: () => Promise<unknown>,
    private readonly told: (silent: boolean) => void,
  ) {}

  // Something came from the server.
  heard(at_ms: number): void {
    this.heard_ms = at_ms;
    this.turn(false);
  }

  // A new connection was made; nothing is known about it yet.
  restart(at_ms: number): void {
    this.heard_ms = at_ms;
    this.silent = false;
  }

  // To be called every second or so while connected.
  async look(at_ms: number): Promise<void> {
    if (this.asking || at_ms - this.heard_ms < kQuiet_ms) return;
    const before = this.heard_ms;
    this.asking = true;
    const answered = await this.ask().then(
      () => true,
      () => false,
    );
    this.asking = false;
    if (answered) this.heard(at_ms);
    else if (this.heard_ms === before) this.turn(true);
  }

  private turn(silent: boolean): void {
    if (silent === this.silent) return;
    this.silent = silent;
    this.told(silent);
  }
}
