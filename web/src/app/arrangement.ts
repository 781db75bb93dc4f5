// Where the view, the pages and further views are, and the link that leads there.
import { CameraPanels } from "../ui/camera_panels";
import { Dock } from "../ui/dock";
import { Layout } from "../ui/layout";
import { makeLayoutMenu } from "../ui/layout_menu";
import { makeScenePanel } from "../ui/scene_panel";
import { byId } from "../widgets/elements";
import { copyLink } from "./address";
import type { Model } from "./model";
import type { PanelView } from "./panel_view";
import type { SceneView } from "./scene_view";

export class Arrangement {
  readonly dock: Dock;
  readonly cameras: CameraPanels;

  constructor(model: Model, scene: SceneView, panel: PanelView) {
    const { page, wanted } = model;
    this.cameras = new CameraPanels(() => wanted.update());
    wanted.add(() => this.cameras.channels);
    this.dock = new Dock(byId("dock"), page, byId("view"), panel.all, (kind, settings) =>
      kind === "camera"
        ? this.cameras.make(String(settings.channel))
        : makeScenePanel(page, scene.stage, settings),
    );
    new Layout(page, this.dock);
    makeLayoutMenu(byId("more"), page, this.dock);
    panel.linkButton.addEventListener(
      "click",
      () => void copyLink(model, scene.stage, panel.plots.kept, this.dock.kept),
    );
  }
}
