// The one order in which a page comes together, in whatever order its parts arrive: the greeting
// says what is shown, ruedo/info what runs, the scene what it looks like. Both of the last are told
// together, for the one says little without the other, and only from then on messages of the run
// are asked for and taken.
import type { world_info_t } from "../../generated/messages";
import type { Hello } from "../wire/protocol";
import { InfoAssembler, type World } from "./world";

export interface LoadingEvents<Scene> {
  fetchScene(): Promise<Scene | null>; // null: there is no scene to show
  greeted(hello: Hello): void;
  // The world has come, maybe before its scene: it can be steered.
  running(world: World): void;
  // Both are there; and again when either is another.
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

  // A connection is there: what was known may be of another run.
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

  // There is another scene. Of several that are on their way the one asked for last counts.
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
        if (tries === 0) continue; // it may have changed while it was read
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
