// The panel and its pages.
import { chooseRobot } from "../state/choices";
import { Capture } from "../ui/capture";
import { ChannelList } from "../ui/channels";
import { Compared } from "../ui/compared";
import { EditPage } from "../ui/edit_page";
import { FaultForm } from "../ui/fault_form";
import { FieldPlots } from "../ui/field_plots";
import { FrameTree } from "../ui/frames";
import { Inset } from "../ui/inset";
import { LogRecorder } from "../ui/log_recorder";
import { Notes } from "../ui/notes";
import { Publisher } from "../ui/publish";
import { RobotPages } from "../ui/robot";
import { RobotChoice } from "../ui/robot_choice";
import type { Tab } from "../state/page";
import { byId, h } from "../widgets/elements";
import type { Editing } from "./editing";
import type { Model } from "./model";
import type { SceneView } from "./scene_view";

export class PanelView {
  readonly pages: RobotPages; // about the chosen robot
  readonly plots: FieldPlots;
  readonly channels: ChannelList;
  readonly editPage: EditPage;
  readonly inset: Inset;
  readonly all: Record<Tab, HTMLElement>; // the pages
  readonly log: LogRecorder;
  readonly linkButton = h("button", { id: "link" }, "Copy link");
  private readonly frames: FrameTree;

  constructor(
    private readonly model: Model,
    scene: SceneView,
    editing: Editing,
  ) {
    const { page, control, wanted } = model;
    this.pages = new RobotPages(
      (command) => control.move(command),
      () => control.stop(),
      {
        move: (name, position) => control.joint(name, position),
        canMove: () => control.jointChannel !== undefined,
        find: (name) => {
          const { scene, world, robot } = page.now,
            of = world?.robots[robot]?.name;
          return scene?.joints?.find((joint) => joint.robot === of && joint.name === name);
        },
      },
    );
    const publish = (channel: string, message: Uint8Array) => model.link.command(channel, message);
    const want = () => wanted.update(),
      seek = (time_s: number) => model.seek(time_s);
    this.editPage = new EditPage(page, scene.stage, editing.editor, editing.draw);
    this.channels = new ChannelList(want);
    this.frames = new FrameTree(page, scene.stage);
    this.inset = new Inset(byId("view"), page, want);
    this.plots = new FieldPlots(page, model.link, seek, want);
    const compared = new Compared(page, {
      seek,
      plot: (channel, field) => this.plots.plot(channel, field, field === "distance"),
    });
    this.log = new LogRecorder(page, want);
    this.pages.extras.append(this.inset.chooser, this.frames.element, this.faults(model));
    this.editPage.extras.append(
      new Capture(page, scene.stage, scene.canvas).element,
      h("div", { class: "row" }, this.log.button, this.linkButton),
    );
    const choice = () => new RobotChoice(page, (robot) => chooseRobot(page, robot)).element;
    this.all = {
      Robot: h("div", {}, choice(), this.pages.statePage),
      Plots: h("div", {}, choice(), compared.element, this.pages.plotPage, this.plots.element),
      Channels: h("div", {}, new Publisher(page, publish).element, this.channels.element),
      World: this.editPage.element,
      Notes: new Notes(page).element,
    };
    this.connect();
  }

  // Of the chosen robot, where it takes any.
  private faults({ page, control }: Model): HTMLElement {
    const form = new FaultForm((fault) => control.fault(fault));
    page.watch(["world", "robot", "hello"], ({ world, robot }) => {
      const name = world?.robots[robot]?.name;
      form.element.hidden = !control.canFail;
      form.show(
        (world?.devices ?? [])
          .filter((device) => device.robot === name)
          .map((device) => device.name),
      );
    });
    return form.element;
  }

  private connect(): void {
    const { model, pages, plots, channels, inset } = this,
      { page, control } = model;
    model.wanted.add(() => [
      ...channels.opened,
      ...plots.channels,
      ...this.log.channels,
      ...(inset.channel ? [inset.channel] : []),
    ]);
    plots.takeDrops(byId("dock"));
    channels.onPlot = (channel, path) => {
      plots.plot(channel, path, false);
      page.set({ tab: "Plots" });
    };
    if (model.rewind)
      model.rewind.onKept = (channel, bytes, time_s) => {
        plots.message(channel, bytes);
        this.log.message(channel, bytes, time_s);
      };
    model.onForget((reset) => {
      if (reset) {
        plots.clear();
        this.log.reset();
      }
      pages.forget();
    });
    page.watch(["theme"], () => {
      pages.restyle();
      plots.restyle();
    });
    page.watch(["world"], ({ world }) => {
      if (world) channels.show(world);
    });
    page.watch(["hello", "world", "robot"], ({ world }) => {
      pages.showNone(world?.robots.length === 0);
      pages.showMotions(control.canMove);
    });
    page.watch(["tool"], ({ tool }) => pages.goButton.classList.toggle("on", tool === "go"));
  }

  // Once a frame.
  frame(at_ms: number): void {
    this.plots.draw(at_ms);
    this.editPage.transform.show();
    this.frames.follow(at_ms);
    this.pages.draw();
  }
}
