// The page as a whole: what comes over the link goes to the scene and the panels, what the user does goes back.
import * as THREE from "three";
import { move_command_t, request_t, type device_info_t, type Messages } from "../generated/messages";
import { Link, type Hello, type LinkState, type Playback } from "./wire/link";
import { Session } from "./wire/session";
import { decode, encode, fingerprint, typeOf, type TypeName } from "./wire/lcm";
import { channelOfType, InfoAssembler, inputOf, type World } from "./state/world";
import { Poses } from "./state/poses";
import { Stage, type ViewMode } from "./scene/stage";
import { kLayers, RobotOverlay, type Layer } from "./scene/overlays";
import { loadScene } from "./scene/description";
import { Bar } from "./ui/bar";
import { ChannelList } from "./ui/channels";
import { Drive, isTyping } from "./ui/drive";
import { fillHelp } from "./ui/help";
import { Panel } from "./ui/panel";
import { RobotPages } from "./ui/robot";
import { Timeline } from "./ui/timeline";
import { h, recall, remember, say, toast } from "./ui/dom";

const kOverlaidRobots = 4;        // with as many or fewer, all of them show what they sense
const byId = (id: string) => document.getElementById(id)!;

interface Route { type: TypeName; robot: string; device: string }

export class App {
  readonly poses = new Poses();
  readonly stage = new Stage(byId("canvas") as HTMLCanvasElement, this.poses, recall("detail") === "full");
  readonly link: Link;
  readonly session: Session;
  world: World | null = null;
  robot = -1;                                   // chosen, index into world.robots
  layers = new Set<Layer>((recall("layers")?.split(",") as Layer[] | undefined) ?? ["rays", "points", "sonar", "trail", "odometry", "contacts"]);
  paused = false;
  time_s = 0;
  private hello: Hello | null = null;
  private readonly assembler = new InfoAssembler();
  private readonly routes = new Map<string, Route>();
  private readonly overlays = new Map<string, RobotOverlay>();
  private readonly bar: Bar;
  private readonly panel: Panel;
  private readonly pages: RobotPages;
  private readonly channels: ChannelList;
  private readonly timeline: Timeline;
  private readonly readout = h("div", { class: "readout", id: "readout" });
  private readonly marker: THREE.Mesh;
  private lastClock = { wall: 0, sim: 0 };
  private motionId = BigInt(Date.now());
  private epoch = -1;
  private jumps = -1;                           // of the log's player; -1: not known yet

  constructor() {
    this.link = new Link({
      state: (state, words) => this.onState(state, words),
      hello: (hello) => this.onHello(hello),
      scene: () => void this.loadScene(),
      playback: (playback) => this.onPlayback(playback),
      message: (channel, bytes) => this.onMessage(channel, bytes),
      frame: () => undefined,
      traffic: (channels, messages, sizes) => this.channels.traffic(channels, messages, sizes),
      refused: (channel) => toast(this.hello?.mode === "log" ? "A recorded run cannot be steered." : `Nobody listens on ${channel}.`, "error"),
    });
    this.session = new Session((channel, message) => this.link.command(channel, message));
    this.bar = new Bar(byId("bar"), {
      pauseOrResume: () => this.pauseOrResume(), step: () => this.step(), reset: () => this.reset(), mode: (mode) => this.setMode(mode),
      rate: (rate) => void this.request(request_t.RATE, encode("rate_request_t", { rate })),
      theme: () => this.toggleTheme(), help: () => (byId("help") as HTMLDialogElement).showModal(), panel: () => this.togglePanel(),
    });
    this.pages = new RobotPages((command) => this.move(command), () => this.move({ kind: move_command_t.STOP, value: 0, radius: 0, speed: 0, acceleration: 0, deceleration: 0 }));
    this.channels = new ChannelList(() => this.want());
    this.panel = new Panel(byId("panel"), this, this.pages, this.channels);
    this.timeline = new Timeline(byId("timeline"), (on, speed) => this.link.play(on, speed), (time) => this.link.seek(time));
    fillHelp(byId("help") as HTMLDialogElement);
    const drive = new Drive((ahead, left) => this.drive(ahead, left));
    byId("pad").append(drive.stick, this.readout);
    this.marker = new THREE.Mesh(new THREE.RingGeometry(0.38, 0.44, 48), new THREE.MeshBasicMaterial({ color: 0x35c2ad, transparent: true, opacity: 0.9, depthWrite: false, toneMapped: false }));
    this.marker.visible = false;
    this.stage.scene.add(this.marker);
    this.legend();
    this.setTheme(recall("theme") ?? (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark"));
    if (innerWidth < 860 || recall("panel") === "closed") byId("app").classList.add("closed");
    byId("notice").addEventListener("click", () => this.notice(""));
    this.keys();
    this.clicks();
    void this.loadScene();
    this.link.connect();
    requestAnimationFrame((at) => this.frame(at));
  }

  // ---- what comes in

  private onState(state: LinkState, words: string): void {
    this.notice(words);
    if (state === "open") {
      if (this.lastClock.wall > 0) toast("Connected again.");
      this.bar.showState("connected", true);
    } else this.bar.showState(state === "ended" ? "ended" : state === "lost" ? "no connection" : "connecting", false);
  }

  // Words that stay until they do not hold any more, or are clicked away; "" for none.
  private notice(words: string): void {
    const notice = byId("notice");
    notice.hidden = words === "";
    say(notice, words);
  }

  private onHello(hello: Hello): void {
    const other = this.hello && (hello.title !== this.hello.title || hello.mode !== this.hello.mode);
    if (this.hello) void this.loadScene();
    this.hello = hello;
    document.title = `${hello.title} – Ruedo`;
    this.bar.title(hello.title);
    document.body.dataset.mode = hello.mode;
    if (hello.mode === "log") this.bar.onlyClock();
    if (hello.fault) this.notice(hello.fault);
    if (other) this.robot = -1;
    this.want();
    if (hello.mode === "live") this.session.askForInfo("ruedo/request");
  }

  private onPlayback(playback: Playback): void {
    if (playback.jumps !== this.jumps) {
      if (this.jumps >= 0) this.forgetPast();
      this.jumps = playback.jumps;
    }
    this.paused = !playback.playing;
    this.timeline.show(playback);
    this.bar.showPaused(this.paused);
    this.bar.showState(playback.playing ? "log" : "log, paused", null);
  }

  async loadScene(): Promise<void> {
    try {
      this.stage.show(await loadScene());
      this.makeOverlays();
    } catch (error) {
      toast(`The scene cannot be loaded: ${(error as Error).message}`, "error");
    }
  }

  private onMessage(channel: string, bytes: Uint8Array): void {
    this.channels.message(channel, bytes);
    const route = this.routes.get(channel);
    const type = route?.type ?? typeOf(bytes);
    if (!type) return;
    try {
      this.dispatch(type, route, channel, bytes);
    } catch (error) {
      console.warn(`${channel}: ${(error as Error).message}`);
    }
  }

  private dispatch(type: TypeName, route: Route | undefined, channel: string, bytes: Uint8Array): void {
    const read = <T extends TypeName>(name: T): Messages[T] => decode(name, bytes);
    if (type === "world_info_t") return this.onInfo(this.assembler.add(read(type)));
    if (type === "world_state_t") {
      const state = read(type);
      this.poses.add(state, performance.now());
      this.onTime(Number(state.utime) * 1e-6, state.epoch, true);
      return;
    }
    if (type === "tick_t") {
      const tick = read(type);
      return this.onTime(Number(tick.utime) * 1e-6, tick.epoch, !this.world || !channelOfType(this.world, "world_state_t"));
    }
    if (type === "reply_t") return this.session.onReply(bytes);
    if (!route?.robot || !this.world) return;
    const overlay = this.overlays.get(route.robot);
    const chosen = this.world.robots[this.robot]?.name === route.robot;
    const device = this.world.devices.find((d) => d.robot === route.robot && d.name === route.device);
    const pages = chosen ? this.pages : null;
    switch (type) {
      case "planar_lidar_t": { const m = read(type); if (device) { overlay?.scan(device, m); pages?.scan(device, m); } return; }
      case "sonar_t": { const m = read(type); if (device) { overlay?.sonar(device, m); pages?.sonar(device, m); } return; }
      case "pose_t": { const m = read(type); overlay?.pose(m); pages?.pose(m); return; }
      case "odometry_t": {
        const m = read(type);
        overlay?.odometer(m);
        pages?.odometry(m);
        this.stage.wheelAngles.set(this.world.robots.findIndex((r) => r.name === route.robot), m.angle);
        return;
      }
      case "contact_t": { const m = read(type); overlay?.contact(m); if (device) pages?.contact(device, m); return; }
      case "motion_status_t": pages?.motion(read(type)); return;
      case "imu_t": if (device) pages?.imu(device, read(type)); return;
      case "image_t": pages?.camera(channel.slice(channel.indexOf("/") + 1), read(type)); return;
      default: return;
    }
  }

  private onInfo(world: World | undefined): void {
    if (!world) return;
    const before = this.world;
    this.world = world;
    if (this.hello?.mode === "live") {
      this.setPaused(world.paused);
      this.onTime(Number(world.utime) * 1e-6, world.epoch);
    }
    const same = before && before.runId === world.runId && before.channels.length === world.channels.length && before.bodies.length === world.bodies.length &&
      before.channels.every((c, i) => c.name === world.channels[i]!.name);
    if (same) return;
    this.routes.clear();
    for (const { name, type, robot, device, fingerprint: hash } of world.channels) {
      if (fingerprint(type) === hash) this.routes.set(name, { type: type as TypeName, robot, device });
    }
    const request = inputOf(world, "", "request_t") ?? "";
    this.session.begin(world.runId, request);
    this.bar.allow(request !== "");
    this.channels.show(world);
    const name = this.robot >= 0 ? before?.robots[this.robot]?.name : undefined;
    this.robot = -1;
    this.panel.showRobots(world.robots.map((r) => r.name));
    this.makeOverlays();
    this.choose(Math.max(0, world.robots.findIndex((r) => r.name === name)));
  }

  // A time that a message tells. Only states say that the past is over: of what else comes, some is older than they are.
  private onTime(time_s: number, epoch: number, isState = false): void {
    if (isState && (epoch !== this.epoch || time_s < this.time_s - 0.5)) {
      this.epoch = epoch;
      this.forgetPast();
    } else if (epoch !== this.epoch || time_s < this.time_s) return;
    this.time_s = time_s;
    this.bar.showClock(time_s);
    const wall = performance.now() / 1000;
    if (wall - this.lastClock.wall < 1) return;
    if (this.lastClock.wall > 0) this.bar.showFactor((time_s - this.lastClock.sim) / (wall - this.lastClock.wall));
    this.lastClock = { wall, sim: time_s };
  }

  // What was drawn along the way is not of this moment.
  private forgetPast(): void {
    for (const overlay of this.overlays.values()) overlay.forget();
    this.pages.forget();
    this.poses.jump();
    this.lastClock = { wall: 0, sim: 0 };
  }

  // ---- what is shown

  private overlaid(): string[] {
    if (!this.world) return [];
    const robots = this.world.robots.map((r) => r.name);
    return robots.length <= kOverlaidRobots ? robots : robots.slice(this.robot, this.robot + 1);
  }

  // An overlay, with its trails, stays as long as its robot is the same one.
  private makeOverlays(): void {
    const before = new Map(this.overlays);
    this.overlays.clear();
    for (const name of this.overlaid()) {
      const devices = this.world!.devices.filter((d) => d.robot === name);
      const start = this.stage.description?.bases.find((b) => b.robot === name)?.start ?? [0, 0, 0, 1, 0, 0, 0];
      const key = [...start, ...devices.flatMap((d) => [d.name, d.kind, ...d.position, ...d.orientation])].join();
      const old = before.get(name);
      const overlay = old?.key === key ? old : new RobotOverlay(devices, start, key);
      if (overlay !== old) this.stage.scene.add(overlay.group);
      else before.delete(name);
      this.overlays.set(name, overlay);
    }
    for (const overlay of before.values()) this.stage.scene.remove(overlay.group);
    this.stage.touch();
  }

  choose(index: number): void {
    const robot = this.world?.robots[index];
    if (!robot || index === this.robot) return;
    this.robot = index;
    this.panel.chooseRobot(index);
    const base = this.stage.description?.bases.findIndex((b) => b.robot === robot.name) ?? -1;
    this.stage.follow(base);
    this.pages.show(robot, this.devicesOf(robot.name), this.stage.description?.bases[base]?.start ?? [0, 0, 0, 1, 0, 0, 0]);
    if (this.world!.robots.length > kOverlaidRobots) this.makeOverlays();
    this.want();
  }

  private devicesOf(robot: string): device_info_t[] { return this.world?.devices.filter((d) => d.robot === robot) ?? []; }

  // Tells the program which channels this page needs now.
  want(): void {
    const wanted = new Set<string>(this.channels.opened);
    if (this.hello) wanted.add(this.hello.info);
    if (this.world) {
      for (const type of ["world_state_t", "tick_t", "reply_t"]) {
        const name = channelOfType(this.world, type);
        if (name) wanted.add(name);
      }
      const overlaid = new Set(this.overlaid()), chosen = this.world.robots[this.robot]?.name;
      for (const channel of this.world.channels) {
        if (channel.input || !channel.robot) continue;
        if (overlaid.has(channel.robot) && this.layerWants(channel.type)) wanted.add(channel.name);
        if (channel.robot === chosen && this.panel.wants(channel.type)) wanted.add(channel.name);
      }
    } else wanted.add("ruedo/reply");
    this.link.want(wanted);
    this.link.watchTraffic(this.panel.open === "Channels" && this.panelOpen());
  }

  private layerWants(type: string): boolean {
    switch (type) {
      case "planar_lidar_t": return this.layers.has("rays") || this.layers.has("points");
      case "sonar_t": return this.layers.has("sonar");
      case "pose_t": return this.layers.has("trail");
      case "odometry_t": return true;    // the wheels turn by it
      case "contact_t": return this.layers.has("contacts");
      default: return false;
    }
  }

  toggleLayer(layer: Layer): void {
    if (!this.layers.delete(layer)) this.layers.add(layer);
    remember("layers", [...this.layers].join());
    this.legend();
    this.stage.touch();
    this.want();
  }

  private legend(): void {
    const colours: Record<Layer, string> = { rays: "#ff6b5e", points: "#ffd24a", sonar: "#3fb6ff", trail: "#27c46b", odometry: "#ff9d2e", contacts: "#ff2d8a", frames: "linear-gradient(90deg,#e33,#3c3,#36f)" };
    byId("legend").replaceChildren(...kLayers.map((layer) => h("button", {
      class: `chip ${this.layers.has(layer) ? "on" : ""}`, "data-layer": layer, "aria-pressed": this.layers.has(layer) ? "true" : "false", style: `--colour: ${colours[layer]}`, click: () => this.toggleLayer(layer),
    }, h("i"), layer)));
  }

  private frame(at: number): void {
    const place = new THREE.Matrix4();
    this.stage.frame(at, () => {
      let changed = false;
      for (const [name, overlay] of this.overlays) {
        const base = this.stage.description?.bases.findIndex((b) => b.robot === name) ?? -1;
        if (!this.stage.base(base, place)) continue;
        changed = overlay.place(place, this.layers) || changed;
        if (name === this.world?.robots[this.robot]?.name) this.placeMarker(place);
      }
      return changed;
    });
    this.pages.draw();
    requestAnimationFrame((next) => this.frame(next));
  }

  private placeMarker(base: THREE.Matrix4): void {
    this.marker.visible = (this.world?.robots.length ?? 0) > 1;
    this.marker.position.setFromMatrixPosition(base).add(new THREE.Vector3(0, 0, 0.015));
  }

  // ---- what the user does

  async request(kind: number, body?: Uint8Array): Promise<boolean> {
    try {
      const reply = await this.session.ask(kind, body);
      if (reply.body.length > 0) {
        const state = this.session.state(reply);
        this.setPaused(state.paused);
        this.onTime(Number(state.utime) * 1e-6, reply.epoch);
      }
      return true;
    } catch (error) {
      toast((error as Error).message, "error");
      return false;
    }
  }

  private setPaused(paused: boolean): void {
    this.paused = paused;
    this.bar.showPaused(paused);
    this.bar.showState(paused ? "paused" : "running", !paused);
  }

  private pauseOrResume(): void {
    if (this.hello?.mode === "log") this.timeline.toggle();
    else void this.request(this.paused ? request_t.RESUME : request_t.PAUSE);
  }
  private step(): void {
    if (this.hello?.mode === "log") this.timeline.shift(0.1);
    else void this.request(request_t.STEP, encode("step_request_t", { steps: 1n }));
  }
  private reset(): void { if (this.hello?.mode === "live") void this.request(request_t.RESET, encode("reset_request_t", { what: 0, seed: -1n })); }

  private drive(ahead: number, left: number): void {
    const robot = this.world?.robots[this.robot];
    const channel = robot && inputOf(this.world!, robot.name, "velocity_command_t");
    if (!robot || !channel) return;
    const fast = Math.min(robot.max_speed, 1.0), turn = Math.min(robot.max_turn_rate, 1.5);
    const vx = ahead * fast, omega = left * turn * (ahead < 0 ? -1 : 1);
    say(this.readout, `${robot.name}\n${vx.toFixed(2)} m/s  ${omega.toFixed(2)} rad/s`);
    this.link.command(channel, encode("velocity_command_t", { utime: 0n, vx, vy: 0, omega }));
  }

  private move(command: Omit<move_command_t, "utime" | "id">): void {
    const robot = this.world?.robots[this.robot];
    const channel = robot && inputOf(this.world!, robot.name, "move_command_t");
    if (!channel) return toast("This robot takes no motion primitives.", "error");
    this.link.command(channel, encode("move_command_t", { ...command, utime: 0n, id: ++this.motionId }));
  }

  // Puts what the panel has chosen onto the ground there.
  private async placeAt(ground: THREE.Vector3): Promise<void> {
    const { model, text } = this.panel.placing()!;
    this.panel.stopPlacing();
    const done = await this.request(request_t.SPAWN, encode("spawn_request_t", { name: "", model, text, on_ground: true, position: new Float64Array([ground.x, ground.y, 0]), orientation: new Float64Array([1, 0, 0, 0]) }));
    if (done) toast("Placed.");
  }

  setMode(mode: ViewMode): void {
    this.stage.setMode(mode);
    this.bar.showMode(mode);
  }

  private setTheme(theme: string): void {
    document.documentElement.dataset.theme = theme;
    remember("theme", theme);
    this.stage.setTheme(theme === "dark");
    this.pages.restyle();
  }
  private toggleTheme(): void { this.setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"); }
  panelOpen(): boolean { return !byId("app").classList.contains("closed"); }
  private togglePanel(): void {
    const closed = byId("app").classList.toggle("closed");
    remember("panel", closed ? "closed" : "open");
    this.want();
  }

  private clicks(): void {
    const canvas = byId("canvas");
    let down = { x: 0, y: 0 };
    canvas.addEventListener("pointerdown", (event) => { down = { x: event.clientX, y: event.clientY }; });
    canvas.addEventListener("pointerup", (event) => {
      if (event.button !== 0 || Math.hypot(event.clientX - down.x, event.clientY - down.y) > 5) return;
      const { robot, ground } = this.stage.pick(event.clientX, event.clientY);
      if (this.panel.placing()) {
        if (ground) void this.placeAt(ground);
        return;
      }
      const name = this.stage.description?.bases[robot]?.robot;
      const index = this.world?.robots.findIndex((r) => r.name === name) ?? -1;
      if (index >= 0) this.choose(index);
    });
  }

  private keys(): void {
    const actions: Record<string, () => void> = {
      " ": () => this.pauseOrResume(), ".": () => this.step(), r: () => this.reset(), "1": () => this.setMode("orbit"), "2": () => this.setMode("follow"), "3": () => this.setMode("top"),
      Home: () => this.stage.home(), n: () => this.choose((this.robot + 1) % Math.max(1, this.world?.robots.length ?? 1)), p: () => this.togglePanel(), t: () => this.toggleTheme(), b: () => this.panel.startPlacing(), Escape: () => this.panel.stopPlacing(),
      x: () => this.move({ kind: move_command_t.STOP, value: 0, radius: 0, speed: 0, acceleration: 0, deceleration: 0 }), "?": () => (byId("help") as HTMLDialogElement).showModal(),
    };
    addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || isTyping(event.target) || event.repeat) return;
      const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (!action || (event.key === " " && event.target instanceof HTMLButtonElement)) return;
      event.preventDefault();
      action();
    });
  }
}
