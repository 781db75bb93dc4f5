// The 3-D view, and what is drawn in it and over it.
import { Ghosts } from "../scene/ghosts";
import { Labels } from "../scene/labels";
import { Markers } from "../scene/markers";
import { Measure } from "../scene/measure";
import { OverlaySet } from "../scene/overlay_set";
import { Stage } from "../scene/stage";
import { Way } from "../scene/way";
import { recall } from "../state/memory";
import type { ViewMode } from "../state/page";
import { byId } from "../widgets/elements";
import type { SceneFiles } from "../wire/description";
import type { Model } from "./model";

export class SceneView {
  readonly canvas = byId("canvas") as HTMLCanvasElement;
  readonly stage: Stage;
  readonly overlays: OverlaySet;
  readonly markers: Markers;
  readonly ghosts: Ghosts;
  readonly labels: Labels;
  readonly measure: Measure;
  readonly way: Way;

  constructor(private readonly model: Model) {
    const { page } = model;
    this.stage = new Stage(this.canvas, model.poses, recall("detail") === "full");
    this.overlays = new OverlaySet(page, this.stage);
    this.markers = new Markers(page, this.stage);
    this.ghosts = new Ghosts(page, this.stage);
    this.labels = new Labels(byId("view"), page, this.stage);
    this.measure = new Measure(page, this.stage);
    this.way = new Way(this.stage);
    if (!this.stage.renderer) byId("flat").hidden = false;
    this.stage.onDetail = (reduced) => page.set({ reduced });
    page.watch(["theme"], ({ theme }) => this.stage.setTheme(theme === "dark"));
    page.watch(["scene", "layers"], ({ scene, layers }) =>
      this.stage.cutAt(layers.has("roof") ? null : (scene?.ceiling ?? null)),
    );
    model.onForget(() => {
      this.overlays.forget();
      this.ghosts.poses.jump();
    });
  }

  // Another world, or none.
  show(files: SceneFiles | null): void {
    this.stage.show(files);
    this.ghosts.show(files);
  }

  setMode(mode: ViewMode): void {
    this.stage.view.setMode(mode);
    this.model.page.set({ mode });
  }

  frame(at_ms: number): void {
    this.stage.frame(at_ms, () => {
      const moved = this.ghosts.place(at_ms);
      this.markers.place();
      return this.overlays.place() || moved;
    });
    this.labels.follow();
  }
}
