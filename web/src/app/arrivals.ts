// Greeting, info and scene as they arrive, in the order that Loading gives them.
import { request_t } from "../../generated/messages";
import { Loading } from "../state/loading";
import { inputOf, type World } from "../state/world";
import type { Notice } from "../ui/notice";
import { toast } from "../widgets/elements";
import type { SceneFiles } from "../wire/description";
import { encode } from "../wire/lcm";
import type { Hello } from "../wire/protocol";
import type { Model } from "./model";
import type { ShownWorld } from "./shown_world";

export class Arrivals {
  readonly loading: Loading<SceneFiles>;
  private asked = false; // for the state, on this connection

  constructor(
    private readonly model: Model,
    private readonly world: ShownWorld,
    private readonly notice: Notice,
  ) {
    this.loading = new Loading<SceneFiles>({
      fetchScene: () => world.fetch(),
      greeted: (hello) => this.greeted(hello),
      running: (running) => this.running(running),
      complete: (complete, files) => {
        world.take(complete, files);
        model.page.set({ complete: true });
      },
      failed: (words) => toast(`The scene cannot be loaded: ${words}`, "error"),
    });
    let shapes = model.page.now.layers.has("shapes");
    model.page.watch(["layers"], ({ layers, hello }) => {
      if (shapes === layers.has("shapes")) return;
      shapes = !shapes;
      if (hello) void this.loading.onScene();
    });
  }

  private greeted(hello: Hello): void {
    const { page, session } = this.model,
      before = page.now.hello;
    this.asked = false;
    this.world.forget();
    document.title = `${hello.title} – Ruedo`;
    document.body.dataset.mode = hello.mode;
    const other = before !== null && (before.title !== hello.title || before.mode !== hello.mode);
    if (hello.save && !before) page.set({ tab: "World" });
    page.set({
      hello,
      complete: false,
      ...(other ? { world: null, scene: null, robot: -1 } : {}),
    });
    if (hello.fault) this.notice.show(hello.fault);
    if (hello.mode === "live") session.askForInfo();
  }

  private running(world: World): void {
    const { page, session, control, clock } = this.model,
      request = inputOf(world, "", "request_t") ?? "",
      live = page.now.hello?.mode === "live";
    session.begin(world.runId, request);
    page.set({ controlled: request !== "" || !live, ...(live ? { paused: world.paused } : {}) });
    // The info kept for newcomers may be older than the last pause, so the state itself is
    // requested.
    if (live && request !== "" && !this.asked) {
      this.asked = true;
      void control.request(request_t.GET_STATE, encode("name_request_t", { name: "" }));
    }
    if (live) clock.tell(Number(world.utime) * 1e-6, world.epoch);
  }
}
