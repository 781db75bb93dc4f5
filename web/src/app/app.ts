// The page as a whole: creates its parts and draws them. Each part knows only those created before
// it.
import { Clicks } from "../edit/clicks";
import { togglePanel, toggleTheme } from "../state/choices";
import { Aim } from "../ui/aim";
import { Bar } from "../ui/bar";
import { Drive } from "../ui/drive";
import { fillHelp } from "../ui/help";
import type { FurtherView } from "../scene/further_view";
import type { Stage } from "../scene/stage";
import { listenToKeys } from "../ui/keys";
import { makeLegend } from "../ui/legend";
import { Notice } from "../ui/notice";
import { Timeline } from "../ui/timeline";
import { byId, h, say } from "../widgets/elements";
import { Arrangement } from "./arrangement";
import { Arrivals } from "./arrivals";
import { ChosenRobot } from "./chosen_robot";
import { Connection } from "./connection";
import { Editing } from "./editing";
import { Fallen } from "./fallen";
import { Model } from "./model";
import { PanelView } from "./panel_view";
import { Retrace } from "./retrace";
import { Router } from "./router";
import { SceneView } from "./scene_view";
import { shortcutsOf } from "./shortcuts";
import { ShownWorld } from "./shown_world";

export class App {
  readonly model = new Model();
  readonly scene: SceneView;
  readonly editing: Editing;
  readonly panel: PanelView;
  readonly robot: ChosenRobot;
  readonly arrivals: Arrivals;
  readonly arranged: Arrangement;
  private readonly fallen = new Fallen(this.model.page, this.model.poses);
  private readonly help = byId("help") as HTMLDialogElement;

  constructor() {
    const { model } = this,
      { page } = model;
    // First, since views take their colours from it
    page.watch(["theme"], ({ theme }) => (document.documentElement.dataset.theme = theme));
    this.scene = new SceneView(model);
    this.editing = new Editing(model, this.scene);
    this.panel = new PanelView(model, this.scene, this.editing);
    this.robot = new ChosenRobot(model, this.scene, this.panel.pages);
    new Retrace(model, this.scene, this.panel.pages);
    const world = new ShownWorld(model, this.scene),
      notice = new Notice(byId("notice"), page);
    this.arrivals = new Arrivals(model, world, notice);
    this.scene.stage.onContext = (there) =>
      notice.show(
        there
          ? ""
          : "The browser has taken the 3-D graphics away. All else works; waiting for them …",
      );
    this.makeControls();
    this.arranged = new Arrangement(model, this.scene, this.panel);
    this.makePad();
    this.listen();
    model.wanted.watch();
    const { loading } = this.arrivals,
      { channels, inset } = this.panel,
      { cameras } = this.arranged,
      views = { ...model, ...this.scene, ...this.panel, cameras: [inset, cameras], loading },
      router = new Router(page, views);
    void new Connection(model, { loading, world, router, channels, notice }).open();
    requestAnimationFrame((at_ms) => this.frame(at_ms));
  }

  private makeControls(): void {
    const { model, scene, help } = this,
      { page, control } = model;
    fillHelp(help);
    new Bar(byId("bar"), page, {
      pauseOrResume: () => control.pauseOrResume(),
      step: () => control.step(),
      reset: () => void control.reset(),
      rate: (rate) => control.rate(rate),
      mode: (mode) => scene.setMode(mode),
      theme: () => toggleTheme(page),
      help: () => help.showModal(),
      panel: () => togglePanel(page),
    });
    makeLegend(byId("legend"), page);
    byId("view").append(scene.measure.readout);
    const timeline = new Timeline(byId("timeline"), page, {
      play: (on, speed) => model.link.play(on, speed),
      seek: (time_s) => model.seek(time_s),
      live: () => model.live(),
      step: (ahead) => model.link.step(ahead),
      branch: () => void control.branch(),
    });
    listenToKeys(shortcutsOf(model, scene, this.panel.editPage, timeline, help));
  }

  // The stick, and the speeds that it sends.
  private makePad(): void {
    const { page, control } = this.model,
      readout = h("div", { class: "readout", id: "readout" });
    const drive = new Drive((ahead, left) => {
      const speeds = control.drive(ahead, left);
      if (speeds)
        say(
          readout,
          `${speeds.robot}\n${speeds.vx.toFixed(2)} m/s  ${speeds.omega.toFixed(2)} rad/s`,
        );
    });
    byId("pad").append(drive.stick, readout);
    page.watch(["hello", "world", "robot"], () => (byId("pad").hidden = !control.canDrive));
  }

  private listen(): void {
    const { model, scene, editing, panel, robot } = this;
    const clicks = new Clicks(model.page, editing.editor, panel.editPage.door, {
      isBusy: () => editing.gizmo.seized,
      measured: (point) => scene.measure.click(point),
      sent: (point, further) => robot.trip.go(point, further),
    });
    const point = (canvas: HTMLCanvasElement, { picker, view }: Stage | FurtherView) => {
      scene.measure.listen(canvas, picker);
      editing.draw.listen(canvas, picker, view.controls);
      clicks.listen(canvas, picker);
    };
    point(scene.canvas, scene.stage);
    scene.stage.onView = (view) => point(view.canvas, view);
    const { picker } = scene.stage;
    new Aim(byId("view"), scene.canvas, model.page, {
      click: (x, y, further) =>
        editing.draw.drawing ? editing.draw.click(x, y) : clicks.click(x, y, further, picker),
      look: (x, y) =>
        editing.draw.drawing ? editing.draw.look(x, y) : scene.measure.look(x, y, picker),
    });
    model.onForget((reset) => {
      if (reset) this.fallen.forget();
    });
  }

  private frame(at_ms: number): void {
    this.editing.frame();
    this.scene.frame(at_ms);
    this.panel.frame(at_ms);
    this.fallen.look(at_ms);
    requestAnimationFrame((next_ms) => this.frame(next_ms));
  }
}
