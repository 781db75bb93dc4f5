// The user's control of the run: requests, driving, motion primitives, placing models.
import {
  joint_command_t,
  move_command_t,
  request_t,
  type fault_t,
  type reply_t,
} from "../generated/messages";
import type { Clock } from "./state/clock";
import type { Page } from "./state/page";
import { inputOf, sees } from "./state/world";
import { showCommand } from "./widgets/command";
import { confirmed } from "./widgets/confirm";
import { toast } from "./widgets/elements";
import { encode } from "./wire/lcm";
import type { RunLink } from "./wire/protocol";
import type { Session } from "./wire/session";
import type { Move } from "./state/go_to";

const kFastest_m_s = 1.0,
  kQuickestTurn_rad_s = 1.5; // the fastest that the page drives at
const kStop = {
  kind: move_command_t.STOP,
  value: 0,
  radius: 0,
  speed: 0,
  acceleration: 0,
  deceleration: 0,
};

export interface Speeds {
  robot: string;
  vx: number;
  omega: number;
}

export class Control {
  private motionId = BigInt(Date.now());

  constructor(
    private readonly page: Page,
    private readonly link: RunLink,
    readonly session: Session,
    private readonly clock: Clock,
  ) {}

  private get isLog(): boolean {
    return this.page.now.hello?.mode === "log";
  }

  // The reply if the request succeeded; otherwise says why not, unless quiet.
  async ask(kind: number, body?: Uint8Array, quiet = false): Promise<reply_t | null> {
    try {
      const reply = await this.session.ask(kind, body);
      if (reply.body.length > 0) {
        const state = this.session.state(reply);
        this.page.set({ paused: state.paused });
        this.clock.tell(Number(state.utime) * 1e-6, reply.epoch);
      }
      return reply;
    } catch (error) {
      if (!quiet) toast((error as Error).message, "error");
      return null;
    }
  }

  // Saves the shown moment of the past, and shows the command for a second run that continues from
  // there.
  async branch(): Promise<void> {
    const { past, world } = this.page.now;
    if (!past || !world) return;
    if (!sees(world, request_t.SNAPSHOT))
      return toast("Start the server with --snapshots FOLDER: branches are saved there.", "error");
    const step = Math.floor((past.now * 1e6) / world.step_us + 1e-3),
      name = `branch-${past.now.toFixed(2)}-${Date.now().toString(36)}`,
      body = encode("snapshot_request_t", { name, epoch: this.clock.epoch, step: BigInt(step) });
    const reply = await this.ask(request_t.SNAPSHOT, body);
    if (reply) showCommand(`Saved at ${past.now.toFixed(2)} s`, reply.text);
  }

  async request(kind: number, body?: Uint8Array, quiet = false): Promise<boolean> {
    return (await this.ask(kind, body, quiet)) !== null;
  }

  pauseOrResume(): void {
    const { playback, paused } = this.page.now;
    if (!this.isLog) void this.request(paused ? request_t.RESUME : request_t.PAUSE);
    else if (playback) this.link.play(!playback.playing, playback.speed);
  }

  step(): void {
    void this.request(request_t.STEP, encode("step_request_t", { steps: 1n }));
  }

  rate(rate: number): void {
    void this.request(request_t.RATE, encode("rate_request_t", { rate }));
  }

  async reset(): Promise<void> {
    if (this.isLog) return;
    if (
      !(await confirmed(
        "Reset the world?",
        "The run is reset to 0 s: everything goes back to where it started, and what was " +
          "placed goes away.",
        "Reset",
      ))
    )
      return;
    await this.request(request_t.RESET, encode("reset_request_t", { what: 0, seed: -1n }));
  }

  // Drives with a share of the chosen robot's speed ahead and of its turn rate to the left; null if
  // it takes no velocities.
  drive(ahead: number, left: number): Speeds | null {
    const { world, robot: chosen } = this.page.now,
      robot = world?.robots[chosen];
    const channel = robot && inputOf(world!, robot.name, "velocity_command_t");
    if (!robot || !channel) return null;
    if (ahead !== 0 || left !== 0) this.notePaused();
    const vx = ahead * Math.min(robot.max_speed, kFastest_m_s);
    const omega = left * Math.min(robot.max_turn_rate, kQuickestTurn_rad_s) * (ahead < 0 ? -1 : 1);
    this.link.command(channel, encode("velocity_command_t", { utime: 0n, vx, vy: 0, omega }));
    return { robot: robot.name, vx, omega };
  }

  private notePaused(): void {
    if (this.page.now.paused && !this.isLog) toast("The run is paused: press space to resume it.");
  }

  // Returns the primitive's id; null, with a note, if the robot takes none.
  move(command: Move): bigint | null {
    const { world, robot: chosen } = this.page.now,
      robot = world?.robots[chosen];
    const channel = robot && inputOf(world!, robot.name, "move_command_t");
    if (!channel) {
      toast(robot ? "This robot takes no motion primitives." : "There is no robot.", "error");
      return null;
    }
    this.notePaused();
    const id = ++this.motionId;
    this.link.command(channel, encode("move_command_t", { ...command, utime: 0n, id }));
    return id;
  }

  // The channel on which the chosen robot takes commands of that type; none in a log.
  private input(type: string): string | undefined {
    const { world, robot: chosen } = this.page.now,
      robot = world?.robots[chosen];
    return robot && !this.isLog ? inputOf(world!, robot.name, type) : undefined;
  }
  get jointChannel(): string | undefined {
    return this.input("joint_command_t");
  }
  get canMove(): boolean {
    return this.input("move_command_t") !== undefined;
  }
  get canFail(): boolean {
    return this.input("fault_t") !== undefined;
  }
  get canDrive(): boolean {
    return this.input("velocity_command_t") !== undefined;
  }

  joint(name: string, position: number): void {
    if (!this.jointChannel) return;
    this.link.command(
      this.jointChannel,
      encode("joint_command_t", {
        utime: 0n,
        n: 1,
        name: [name],
        mode: new Uint8Array([joint_command_t.POSITION]),
        value: new Float64Array([position]),
      }),
    );
  }

  // False without a connection, or if no robot accepts the command.
  fault(fault: fault_t): boolean {
    const channel = this.input("fault_t");
    return channel !== undefined && this.link.command(channel, encode("fault_t", fault));
  }

  stop(): void {
    this.move(kStop);
  }
}
