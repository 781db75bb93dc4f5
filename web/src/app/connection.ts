// Passes on what the link receives.
import type { Loading } from "../state/loading";
import type { ChannelList } from "../ui/channels";
import type { Notice } from "../ui/notice";
import { toast } from "../widgets/elements";
import { addTypes } from "../wire/lcm";
import type { Hello, LinkHandler, Playback } from "../wire/protocol";
import { kRequestChannel } from "../wire/session";
import type { Model } from "./model";
import type { Router } from "./router";
import type { ShownWorld } from "./shown_world";

export interface Takers {
  loading: Loading<unknown>;
  world: ShownWorld;
  router: Router;
  channels: ChannelList;
  notice: Notice;
}

export class Connection implements LinkHandler {
  constructor(
    private readonly model: Model,
    private readonly to: Takers,
  ) {}

  async open(): Promise<void> {
    await this.fetchTypes().catch(() => undefined); // the link will report what is wrong
    this.model.link.connect(this);
  }

  // Types of plugins and of --types.
  private async fetchTypes(): Promise<void> {
    const { file } = this.model,
      bytes = file?.file("/types.json");
    const answer = file ? bytes && new Response(bytes) : await fetch("/types.json");
    if (answer?.ok) addTypes((await answer.json()) as Parameters<typeof addTypes>[0]);
  }

  state(...[state, words]: Parameters<LinkHandler["state"]>): void {
    this.to.notice.onLink(state, words);
  }
  hello(hello: Hello): void {
    this.to.loading.onHello(hello);
  }
  scene(number: number): void {
    this.to.world.sceneNumber = number;
    void this.to.loading.onScene();
  }
  playback(playback: Playback): void {
    const { page, clock } = this.model,
      before = page.now.playback;
    if (before && before.jumps !== playback.jumps) clock.jump();
    page.set({ playback, paused: !playback.playing });
  }
  events(...[first, events]: Parameters<LinkHandler["events"]>): void {
    const { page } = this.model;
    page.set({ events: [...page.now.events.slice(0, first), ...events] });
  }
  warnings(...[first, warnings]: Parameters<LinkHandler["warnings"]>): void {
    const { page } = this.model;
    page.set({ warnings: [...page.now.warnings.slice(0, first), ...warnings] });
  }
  comparison(...[comparison]: Parameters<LinkHandler["comparison"]>): void {
    this.model.page.set({ comparison });
  }
  message(channel: string, bytes: Uint8Array): void {
    this.to.router.onMessage(channel, bytes);
  }
  traffic(...[channels, messages, sizes]: Parameters<LinkHandler["traffic"]>): void {
    this.to.channels.traffic(channels, messages, sizes);
  }

  // A run with --control off refuses all requests; the page makes one (for ruedo/info) before it
  // knows.
  refused(channel: string): void {
    const { hello, world } = this.model.page.now,
      isRequest = channel === kRequestChannel;
    if (isRequest && hello?.mode === "live" && !world) return;
    toast(
      hello?.mode === "log"
        ? "A recorded run cannot be steered."
        : isRequest
          ? "This run accepts no requests (--control off)."
          : `Nobody listens on ${channel}.`,
      "error",
    );
  }
}
