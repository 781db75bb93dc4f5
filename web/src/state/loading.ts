// The order in which a page comes together, in whatever order its parts arrive: the greeting says
// what is shown, ruedo/info what runs, and the scene what it looks like. Info and scene are
// published together, since one means little without the other; only from then on are the run's
// messages requested and processed.
import type { world_info_t } from "../../generated/messages";
import type { Hello } from "../wire/protocol";
import { InfoAssembler, type World } from "./world";

export interface LoadingEvents<Scene> {
  fetchScene(): Promise<Scene | null>; // null if there is no scene to show
  greeted(hello: Hello): void;
  // The world is known, perhaps before its scene: it can be controlled.
  running(world: World): void;
  // Both are known; called again when either changes.
  complete(world: World, scene: Scene | null): void;
  failed(words: string): void;
}

export class Loading<Scene> {
  hello: Hello | null = null;
  world: World | null = null;
  hasScene = false;
  private scene: Scene | null = null;
  private readonly assembler = new InfoAssembler();
  private fetches = 0;

  constructor(private readonly events: LoadingEvents<Scene>) {}

  get complete(): boolean {
    return this.world !== null && this.hasScene;
  }

  // A new connection: what was known may be of another run.
  onHello(hello: Hello): void {
    this.hello = hello;
    this.world = null;
    this.hasScene = false;
    this.events.greeted(hello);
    void this.onScene();
  }

  onInfo(part: world_info_t): void {
    const world = this.assembler.add(part);
    if (!world || !this.hello) return;
    const same = this.world !== null && sameWorld(this.world, world);
    this.world = world;
    this.events.running(world);
    if (!same) this.tell();
  }

  // Another scene was announced. Of several requests under way, the last one counts.
  async onScene(): Promise<void> {
    const fetch = ++this.fetches;
    for (let tries = 0; ; ++tries) {
      try {
        const scene = await this.events.fetchScene();
        if (fetch !== this.fetches) return;
        this.scene = scene;
        break;
      } catch (error) {
        if (fetch !== this.fetches) return;
        if (tries === 0) continue; // the scene may have changed while it was being read
        this.events.failed((error as Error).message);
        this.scene = null;
        break;
      }
    }
    this.hasScene = true;
    this.tell();
  }

  private tell(): void {
    if (this.world && this.hasScene) this.events.complete(this.world, this.scene);
  }
}

const sameWorld = (a: World, b: World) =>
  a.runId === b.runId &&
  a.channels.length === b.channels.length &&
  a.bodies.length === b.bodies.length &&
  a.channels.every(({ name }, i) => name === b.channels[i]!.name);
