// The page as a whole: makes its parts and connects them. What is known is in `page`; who shows it
// watches it there.
import { request_t } from "../generated/messages";
import { Control } from "./control";
import { listenToClicks } from "./edit/clicks";
import { Draw } from "./edit/draw";
import { Editor } from "./edit/editor";
import { Gizmo } from "./edit/gizmo";
import { listenToEditing } from "./edit/keys";
import { Outline } from "./edit/outline";
import { loadScene, type SceneFiles } from "./scene/description";
import { Ghosts } from "./scene/ghosts";
import { Labels } from "./scene/labels";
import { Measure } from "./scene/measure";
import { Way } from "./scene/way";
import { Markers } from "./scene/markers";
import { OverlaySet } from "./scene/overlay_set";
import { Stage, type ViewMode } from "./scene/stage";
import { Clock } from "./state/clock";
import { Loading } from "./state/loading";
import { makePage } from "./state/page";
import { GoTo, type PlanarPose } from "./state/go_to";
import { hashOf, placeOf, type Place } from "./state/place";
import { Poses } from "./state/poses";
import { wantedChannels } from "./state/wanted";
import { inputOf, type World } from "./state/world";
import { Bar } from "./ui/bar";
import { Capture } from "./ui/capture";
import { ChannelList } from "./ui/channels";
import { Compared } from "./ui/compared";
import { Drive } from "./ui/drive";
import { h, recall, remember, say, toast } from "./ui/dom";
import { EditPage } from "./ui/edit_page";
import { FieldPlots } from "./ui/field_plots";
import { FrameTree } from "./ui/frames";
import { fillHelp } from "./ui/help";
import { Inset } from "./ui/inset";
import { listenToKeys } from "./ui/keys";
import { Layout } from "./ui/layout";
import { makeLegend } from "./ui/legend";
import { Notice } from "./ui/notice";
import { Panel } from "./ui/panel";
import { kReasons, RobotPages } from "./ui/robot";
import { Timeline } from "./ui/timeline";
import { addTypes, encode } from "./wire/lcm";
import { Link, type Hello, type Playback, type RunLink } from "./wire/link";
import { LogFile, newestAt } from "./wire/log_file";
import { Rewind, type Past } from "./wire/rewind";
import { Router } from "./wire/router";
import { Session } from "./wire/session";

const kMostScenes = 32; // that are kept for the past
const kJump_s = 0.5; // further is another moment, not the next one
const kTurn_rad = Math.PI / 24,
  kPan = 0.06,
  kZoom = 1.15; // of one press of a key

const byId = (id: string) => document.getElementById(id)!;

export class App {
  readonly page = makePage();
  readonly poses = new Poses();
  readonly stage = new Stage(
    byId("canvas") as HTMLCanvasElement,
    this.poses,
    recall("detail") === "full",
  );
  readonly overlays = new OverlaySet(this.page, this.stage);
  readonly markers = new Markers(this.page, this.stage);
  readonly ghosts = new Ghosts(this.page, this.stage);
  readonly clock = new Clock(this.page, (reset) => this.forgetPast(reset));
  readonly notice = new Notice(byId("notice"), this.page);
  readonly loading = new Loading<SceneFiles>({
    fetchScene: () => this.loadScene(),
    greeted: (hello) => this.onHello(hello),
    running: (world) => this.onWorld(world),
    complete: (world, scene) => this.onComplete(world, scene),
    failed: (words) => toast(`The scene cannot be loaded: ${words}`, "error"),
  });
  private readonly file = LogFile.inPage();
  readonly rewind = this.file ? null : new Rewind(new Link()); // of what may be live
  readonly link: RunLink = this.file ?? this.rewind!;
  private sceneNumber = 0; // of a log's
  private readonly scenes: { from: number; world: World; files: SceneFiles | null }[] = []; // of the past that is kept
  readonly session = new Session((channel, message) => this.link.command(channel, message));
  readonly control = new Control(this.page, this.link, this.session, this.clock);
  readonly editor = new Editor(this.page, this.poses, this.control, (model) =>
    this.stage.boxOf(model),
  );
  readonly gizmo = new Gizmo(
    this.page,
    this.stage,
    this.editor,
    byId("canvas") as HTMLCanvasElement,
  );
  readonly outline = new Outline(this.page, this.stage, this.editor);
  readonly draw = new Draw(this.page, this.stage, this.editor, byId("canvas") as HTMLCanvasElement);
  readonly editPage = new EditPage(this.page, this.stage, this.editor, this.draw);
  readonly pages = new RobotPages(
    (command) => this.control.move(command),
    () => this.control.stop(),
    {
      move: (name, position) => this.control.joint(name, position),
      canMove: () => this.control.jointChannel !== undefined,
    },
  );
  readonly channels = new ChannelList(() => this.want());
  readonly measure = new Measure(this.page, this.stage, byId("canvas"));
  private readonly way = new Way(this.stage);
  readonly trip = new GoTo({
    pose: () => this.planarPose(),
    move: (command) => this.control.move(command),
    failed: (reason) => toast(`It does not get there: ${kReasons[reason] ?? reason}.`, "error"),
    changed: () => {
      this.way.show(this.planarPose(), this.trip.points());
      this.want();
    },
  });
  readonly labels = new Labels(byId("view"), this.page, this.stage);
  readonly frames = new FrameTree(this.page, this.stage);
  readonly inset = new Inset(byId("view"), this.page, () => this.want());
  readonly plots = new FieldPlots(
    this.page,
    this.link,
    (time_s) => this.seek(time_s),
    () => this.want(),
  );
  readonly compared = new Compared(this.page, {
    seek: (time_s) => this.seek(time_s),
    plot: (channel, field) => this.plots.plot(channel, field, field === "distance"),
  });
  readonly panel = new Panel(
    byId("panel"),
    this.page,
    {
      Robot: this.pages.statePage,
      Plots: h("div", {}, this.compared.element, this.pages.plotPage, this.plots.element),
      Channels: this.channels.element,
      World: this.editPage.element,
    },
    (robot) => this.choose(robot),
  );
  private readonly router = new Router(this.page, this);
  readonly timeline = new Timeline(byId("timeline"), this.page, {
    play: (on, speed) => this.link.play(on, speed),
    seek: (time_s) => this.seek(time_s),
    live: () => this.rewind?.live(),
    step: (ahead) => this.link.step(ahead),
    branch: () => void this.control.branch(),
  });
  private readonly help = byId("help") as HTMLDialogElement;
  private asked = false; // for the state, on this connection
  private shown = ""; // run and name of the robot in the panel

  constructor() {
    this.fillPage();
    this.connectParts();
    listenToEditing(this.page, this.editor);
    listenToKeys(this.keys());
    this.watch();
    void this.connect();
    requestAnimationFrame((at) => this.frame(at));
  }

  // What stands in the page and that nobody asks for later.
  private fillPage(): void {
    fillHelp(this.help);
    new Bar(byId("bar"), this.page, {
      pauseOrResume: () => this.control.pauseOrResume(),
      step: () => this.control.step(),
      reset: () => void this.control.reset(),
      rate: (rate) => this.control.rate(rate),
      mode: (mode) => this.setMode(mode),
      theme: () => this.toggleTheme(),
      help: () => this.help.showModal(),
      panel: () => this.togglePanel(),
    });
    new Layout(this.page);
    makeLegend(byId("legend"), this.page);
    if (!this.stage.renderer) byId("flat").hidden = false;
    this.makePad();
    this.editPage.extras.append(
      new Capture(this.stage, byId("canvas") as HTMLCanvasElement).element,
      h(
        "div",
        { class: "row" },
        h("button", { id: "link", click: () => void this.copyLink() }, "Copy link"),
      ),
    );
    byId("view").append(this.measure.readout);
    this.pages.extras.append(this.inset.chooser, this.frames.element);
  }

  // Parts that tell another one something.
  private connectParts(): void {
    const { page } = this;
    if (this.rewind) {
      this.rewind.onPast = (past, kept) => this.onPast(past, kept);
      this.rewind.onKept = (channel, bytes) => this.plots.message(channel, bytes);
    }
    this.stage.onDetail = (reduced) => page.set({ reduced });
    this.channels.onPlot = (channel, path) => {
      this.plots.plot(channel, path, false);
      page.set({ tab: "Plots" });
    };
    listenToClicks(
      byId("canvas"),
      page,
      this.stage,
      this.editor,
      this.editPage.door,
      () => this.gizmo.seized,
      (point) => this.measure.click(point),
      (point, further) => this.trip.go(point, further),
    );
    this.pages.onMotion = (status) => this.trip.heard(status);
    this.pages.goButton.addEventListener("click", () => this.toggleGoing());
    page.watch(["tool"], ({ tool }) => this.pages.goButton.classList.toggle("on", tool === "go"));
  }

  private keys(): Record<string, () => void> {
    const { page, control, stage, timeline } = this;
    return {
      " ": () => control.pauseOrResume(),
      ".": () => this.step(true),
      ",": () => this.step(false),
      ">": () => timeline.lane.jump(true),
      "<": () => timeline.lane.jump(false),
      o: () => page.set({ loop: !page.now.loop }),
      "[": () => timeline.lane.mark("begin"),
      "]": () => timeline.lane.mark("end"),
      End: () => this.rewind?.live(),
      r: () => void control.reset(),
      x: () => control.stop(),
      g: () => this.toggleGoing(),
      "1": () => this.setMode("orbit"),
      "2": () => this.setMode("follow"),
      "3": () => this.setMode("top"),
      Home: () => stage.home(),
      n: () => this.choose((page.now.robot + 1) % Math.max(1, page.now.world?.robots.length ?? 1)),
      p: () => this.togglePanel(),
      t: () => this.toggleTheme(),
      j: () => stage.turn(-kTurn_rad, 0),
      l: () => stage.turn(kTurn_rad, 0),
      i: () => stage.turn(0, kTurn_rad),
      k: () => stage.turn(0, -kTurn_rad),
      J: () => stage.pan(-kPan, 0),
      L: () => stage.pan(kPan, 0),
      I: () => stage.pan(0, kPan),
      K: () => stage.pan(0, -kPan),
      "+": () => stage.zoom(1 / kZoom),
      "-": () => stage.zoom(kZoom),
      b: () => this.editPage.startPlacing(),
      Escape: () => this.stopEditing(),
      m: () => page.set({ handle: "translate" }),
      e: () => page.set({ handle: "rotate" }),
      z: () => page.set({ handle: "scale" }),
      "?": () => this.help.showModal(),
    };
  }

  // What follows when something else is known or chosen.
  private watch(): void {
    const { page } = this;
    page.watch(["theme"], ({ theme }) => {
      document.documentElement.dataset.theme = theme;
      this.stage.setTheme(theme === "dark");
      this.pages.restyle();
      this.plots.restyle();
    });
    page.watch(["scene", "layers"], ({ scene, layers }) =>
      this.stage.cutAt(layers.has("roof") ? null : (scene?.ceiling ?? null)),
    );
    let shapes = page.now.layers.has("shapes");
    page.watch(["layers"], ({ layers }) => {
      if (shapes === layers.has("shapes")) return;
      shapes = !shapes;
      if (page.now.hello) void this.loading.onScene();
    });
    page.watch(["world", "scene", "robot"], () => this.showRobot());
    page.watch(["hello", "world", "robot"], ({ world }) => {
      this.pages.showNone(world?.robots.length === 0);
      this.pages.showMotions(this.control.canMove);
      byId("pad").hidden = !this.control.canDrive;
    });
    page.watch(["hello", "world", "scene", "robot", "layers", "tab", "panel"], () => this.want());
  }

  // Types of plugins, and of --types.
  private async fetchTypes(): Promise<void> {
    const bytes = this.file?.file("/types.json");
    const answer = this.file ? bytes && new Response(bytes) : await fetch("/types.json");
    if (answer?.ok) addTypes((await answer.json()) as Parameters<typeof addTypes>[0]);
  }

  private async connect(): Promise<void> {
    const { page } = this;
    await this.fetchTypes().catch(() => undefined); // the link says what is wrong
    this.link.connect({
      state: (link, words) => this.notice.onLink(link, words),
      hello: (hello) => this.loading.onHello(hello),
      scene: (number) => {
        this.sceneNumber = number;
        void this.loading.onScene();
      },
      playback: (playback) => this.onPlayback(playback),
      events: (first, events) =>
        page.set({ events: [...page.now.events.slice(0, first), ...events] }),
      comparison: (comparison) => page.set({ comparison }),
      message: (channel, bytes) => this.router.onMessage(channel, bytes),
      traffic: (channels, messages, sizes) => this.channels.traffic(channels, messages, sizes),
      refused: (channel) => this.onRefused(channel),
    });
  }

  // A run with --control off takes no requests; the page asks one, for what runs, before it knows.
  private onRefused(channel: string): void {
    const { hello, world } = this.page.now,
      isRequest = channel === "ruedo/request";
    if (isRequest && hello?.mode === "live" && !world) return;
    toast(
      hello?.mode === "log"
        ? "A recorded run cannot be steered."
        : isRequest
          ? "This run takes no requests (--control off)."
          : `Nobody listens on ${channel}.`,
      "error",
    );
  }

  // ---- what comes in, in the order of Loading

  private onHello(hello: Hello): void {
    const before = this.page.now.hello;
    this.asked = false;
    this.sceneNumber = 0;
    this.markers.clear();
    document.title = `${hello.title} – Ruedo`;
    document.body.dataset.mode = hello.mode;
    if (this.rewind) this.scenes.length = 0;
    const other = before !== null && (before.title !== hello.title || before.mode !== hello.mode);
    if (hello.save && !before) this.page.set({ tab: "World" });
    this.page.set({ hello, ...(other ? { world: null, scene: null, robot: -1 } : {}) });
    if (hello.fault) this.notice.show(hello.fault);
    if (hello.mode === "live") this.session.askForInfo("ruedo/request");
  }

  private onWorld(world: World): void {
    const request = inputOf(world, "", "request_t") ?? "",
      live = this.page.now.hello?.mode === "live";
    this.session.begin(world.runId, request);
    this.page.set({
      controlled: request !== "" || !live,
      ...(live ? { paused: world.paused } : {}),
    });
    // The info that was kept for newcomers may be older than the last pause: the state itself is
    // asked for.
    if (live && request !== "" && !this.asked) {
      this.asked = true;
      void this.control.request(request_t.GET_STATE, encode("name_request_t", { name: "" }));
    }
    if (live) this.clock.tell(Number(world.utime) * 1e-6, world.epoch);
  }

  // As it looks, or as physics has it.
  private async loadScene(): Promise<SceneFiles | null> {
    // Of a log that is served each page has a moment of its own.
    const at = this.page.now.hello?.mode === "log" && !this.file ? `/${this.sceneNumber}` : "";
    if (!this.page.now.layers.has("shapes")) return loadScene(this.file, `/scene${at}`);
    const shapes = await loadScene(this.file, `/collision${at}`);
    if (!shapes && this.page.now.scene) toast("The collision shapes are not in this page.");
    return shapes ?? loadScene(this.file, `/scene${at}`);
  }

  // Kept for who looks back; shown, unless the past is.
  private onComplete(world: World, files: SceneFiles | null): void {
    const last = this.scenes.at(-1),
      isSame =
        last?.world.runId === world.runId &&
        last.files?.description.version === files?.description.version;
    const isShown = !this.page.now.past || this.page.now.scene === last?.files?.description;
    if (last && isSame)
      last.files = files; // the same world in another form
    else this.scenes.push({ from: this.rewind?.range.end ?? 0, world, files });
    if (this.scenes.length > kMostScenes) this.scenes.shift();
    if (!this.page.now.past || (isSame && isShown)) this.present(world, files);
  }

  // The chosen robot stays, by its name.
  private present(world: World, files: SceneFiles | null): void {
    const { world: before, robot } = this.page.now,
      name = before?.robots[robot]?.name;
    this.stage.show(files);
    this.ghosts.show(files);
    this.channels.show(world);
    const at = Math.max(
      world.robots.findIndex((r) => r.name === name),
      world.robots.length > 0 ? 0 : -1,
    );
    const first = this.page.now.world === null;
    this.page.set({ world, scene: files?.description ?? null, robot: at });
    if (!first) return;
    this.goTo(placeOf(location.hash));
  }

  // Where the address leads.
  private goTo({ time_s, camera, robot, selected }: Place): void {
    const { world } = this.page.now,
      at = world?.robots.findIndex(({ name }) => name === robot) ?? -1;
    if (camera) this.stage.viewpoint = camera;
    if (at >= 0) this.page.set({ robot: at });
    if (selected) this.page.set({ selected });
    if (time_s !== null && this.page.now.hello?.mode === "log") {
      this.link.play(false, 1);
      this.link.seek(time_s);
    }
  }

  private async copyLink(): Promise<void> {
    const { hello, playback, past, world, robot, selected } = this.page.now,
      time_s = hello?.mode === "log" ? (playback?.now ?? null) : (past?.now ?? null);
    const name = world?.robots[robot]?.name ?? "";
    location.hash = hashOf({ time_s, camera: this.stage.viewpoint, robot: name, selected });
    try {
      await navigator.clipboard.writeText(location.href);
      toast("The link is copied.");
    } catch {
      toast("The link is in the address bar.");
    }
  }

  // A moment of a log, or of the past of a live run.
  seek(time_s: number): void {
    if (this.page.now.hello?.mode === "log") this.link.seek(time_s);
    else this.rewind?.show(time_s);
  }

  // What is shown is another moment of a live run, or the present again.
  private onPast(past: Past | null, kept: { begin: number; end: number }): void {
    if (this.page.now.hello?.mode !== "live") return;
    const before = this.page.now.past;
    if (past === null && before === null && kept.end === this.page.now.kept.end) return;
    this.page.set({ past, kept });
    if (past?.now === before?.now) return;
    if (!past || !before || past.now < before.now) this.markers.clear(); // what is drawn then comes
    if (!past || !before || Math.abs(past.now - before.now) > kJump_s) this.poses.jump();
    const shown =
      this.scenes[
        Math.max(
          0,
          newestAt(
            this.scenes.map(({ from }) => ({ time: from })),
            past?.now ?? Infinity,
          ),
        )
      ];
    if (shown && shown.files?.description !== this.page.now.scene)
      this.present(shown.world, shown.files);
  }

  private onPlayback(playback: Playback): void {
    const { playback: before } = this.page.now;
    if (before && before.jumps !== playback.jumps) this.clock.jump();
    this.page.set({ playback, paused: !playback.playing });
  }

  // What was drawn along the way is not of this moment.
  private forgetPast(reset: boolean): void {
    if (reset) this.editor.history.clear();
    if (reset) this.plots.clear();
    if (reset) this.trip.forget();
    this.overlays.forget();
    this.pages.forget();
    this.poses.jump();
    this.ghosts.poses.jump();
  }

  // ---- what is shown

  choose(robot: number): void {
    if (this.page.now.world?.robots[robot]) this.page.set({ robot });
  }

  // The chosen robot in panel and view.
  private showRobot(): void {
    const { world, scene, robot: at } = this.page.now,
      robot = world?.robots[at];
    if (!robot) return;
    const base = scene?.bases.findIndex((b) => b.robot === robot.name) ?? -1;
    this.stage.follow(base);
    this.pages.beginAt(scene ? scene.bases[base]?.start : [0, 0, 0, 1, 0, 0, 0]);
    const key = `${world!.runId} ${robot.name}`;
    if (key !== this.shown) {
      this.trip.forget();
      this.pages.show(
        robot,
        world!.devices.filter((device) => device.robot === robot.name),
      );
    }
    this.shown = key;
  }

  // The chosen robot's.
  private planarPose(): PlanarPose | null {
    const { world, scene, robot } = this.page.now,
      name = world?.robots[robot]?.name;
    return this.stage.planar(scene?.bases.findIndex((base) => base.robot === name) ?? -1);
  }
  private motionChannels(): string[] {
    const { world, robot } = this.page.now,
      name = world?.robots[robot]?.name;
    return (world?.channels ?? [])
      .filter((channel) => channel.robot === name && channel.type === "motion_status_t")
      .map((channel) => channel.name);
  }

  private want(): void {
    const { tab, panel } = this.page.now;
    this.link.want(
      wantedChannels(this.page.now, this.loading.complete, [
        ...this.channels.opened,
        ...this.plots.channels,
        ...(this.inset.channel ? [this.inset.channel] : []),
        ...(this.trip.points().length > 0 ? this.motionChannels() : []),
      ]),
    );
    this.link.watchTraffic(panel && tab === "Channels");
  }

  private frame(at: number): void {
    this.plots.draw();
    this.gizmo.follow();
    this.outline.follow();
    this.editPage.transform.show();
    this.stage.frame(at, () => {
      const moved = this.ghosts.place(at);
      this.markers.place();
      return this.overlays.place() || moved;
    });
    this.labels.follow();
    this.frames.follow(at);
    this.pages.draw();
    requestAnimationFrame((next) => this.frame(next));
  }

  // ---- what the user does with the page

  // A step of a live run, or a state of what is past, to and fro.
  private step(ahead: boolean): void {
    const { past, paused, hello } = this.page.now;
    if (ahead && hello?.mode !== "log" && !past && paused) this.control.step();
    else this.link.step(ahead);
  }

  setMode(mode: ViewMode): void {
    this.stage.setMode(mode);
    this.page.set({ mode });
  }

  private toggleGoing(): void {
    this.page.set({ tool: this.page.now.tool === "go" ? "select" : "go" });
  }

  private toggleTheme(): void {
    const theme = this.page.now.theme === "dark" ? "light" : "dark";
    remember("theme", theme);
    this.page.set({ theme });
  }

  private togglePanel(): void {
    const panel = !this.page.now.panel;
    this.page.set({ panel });
  }

  private makePad(): void {
    const readout = h("div", { class: "readout", id: "readout" });
    const drive = new Drive((ahead, left) => {
      const speeds = this.control.drive(ahead, left);
      if (speeds)
        say(
          readout,
          `${speeds.robot}\n${speeds.vx.toFixed(2)} m/s  ${speeds.omega.toFixed(2)} rad/s`,
        );
    });
    byId("pad").append(drive.stick, readout);
  }

  // What was begun is left; then, what was selected.
  private stopEditing(): void {
    if (this.page.now.tool !== "select") this.editPage.stop();
    else this.page.set({ selected: "" });
  }
}
