// Which world is shown: the present one, or, when looking back, the one of that time.
import type { World } from "../state/world";
import { toast } from "../widgets/elements";
import { loadScene, type SceneFiles } from "../wire/description";
import { newestAt } from "../wire/log_file";
import type { Past } from "../wire/rewind";
import { goToAddress } from "./address";
import type { Model } from "./model";
import type { SceneView } from "./scene_view";

const kMostScenes = 32; // kept for the past
const kJump_s = 0.5; // a longer step is a jump

export class ShownWorld {
  sceneNumber = 0; // of a log's scenes
  private readonly scenes: { from: number; world: World; files: SceneFiles | null }[] = []; // of the past

  constructor(
    private readonly model: Model,
    private readonly scene: SceneView,
  ) {
    if (model.rewind) model.rewind.onPast = (past, kept) => this.onPast(past, kept);
  }

  // A new connection, perhaps to another run.
  forget(): void {
    this.sceneNumber = 0;
    this.scene.markers.clear();
    if (this.model.rewind) this.scenes.length = 0;
  }

  // Its visual shapes, or its collision shapes.
  async fetch(): Promise<SceneFiles | null> {
    const { file } = this.model,
      { hello, layers, scene } = this.model.page.now;
    // In a served log, each page has a moment, and thus a scene, of its own.
    const at = hello?.mode === "log" && !file ? `/${this.sceneNumber}` : "";
    if (!layers.has("shapes")) return loadScene(file, `/scene${at}`);
    const shapes = await loadScene(file, `/collision${at}`);
    if (!shapes && scene) toast("The collision shapes are not in this page.");
    return shapes ?? loadScene(file, `/scene${at}`);
  }

  // Kept for looking back; shown unless the past is.
  take(world: World, files: SceneFiles | null): void {
    const { past, scene } = this.model.page.now,
      last = this.scenes.at(-1),
      isSame =
        last?.world.runId === world.runId &&
        last.files?.description.version === files?.description.version;
    const isShown = !past || scene === last?.files?.description;
    if (last && isSame)
      last.files = files; // the same world with other shapes
    else this.scenes.push({ from: this.model.rewind?.range.end ?? 0, world, files });
    if (this.scenes.length > kMostScenes) this.scenes.shift();
    if (!past || (isSame && isShown)) this.show(world, files);
  }

  // The chosen robot stays chosen, by its name.
  private show(world: World, files: SceneFiles | null): void {
    const { page } = this.model,
      { world: before, robot } = page.now,
      name = before?.robots[robot]?.name;
    this.scene.show(files);
    const at = Math.max(
      world.robots.findIndex((r) => r.name === name),
      world.robots.length > 0 ? 0 : -1,
    );
    page.set({ world, scene: files?.description ?? null, robot: at });
    if (before === null) goToAddress(this.model, this.scene.stage);
  }

  // Another moment of a live run is shown, or the present again.
  private onPast(past: Past | null, kept: { begin: number; end: number }): void {
    const { page, clock } = this.model;
    if (page.now.hello?.mode !== "live") return;
    const before = page.now.past;
    if (past === null && before === null && kept.end === page.now.kept.end) return;
    page.set({ past, kept });
    if (past?.now === before?.now) return;
    const isBack = !past || !before || past.now < before.now;
    if (isBack) this.scene.markers.clear(); // those of that time will follow
    if (isBack || past.now - before.now > kJump_s) clock.jump();
    else clock.move();
    const times = this.scenes.map(({ from }) => ({ time: from })),
      shown = this.scenes[Math.max(0, newestAt(times, past?.now ?? Infinity))];
    if (shown && shown.files?.description !== page.now.scene) this.show(shown.world, shown.files);
  }
}
