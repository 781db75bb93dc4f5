// Screenshots and videos of the view, made by the browser.
import type { Stage } from "../scene/stage";
import type { Page } from "../state/page";
import { downloadName } from "../state/world_key";
import { download } from "../widgets/download";
import { h, say, toast } from "../widgets/elements";
import { Recording } from "./recording";
import { withDuration } from "./webm";

const kFrames_hz = 30;
const kTypes = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];

export class Capture {
  readonly element: HTMLElement;
  private readonly record = h(
    "button",
    { id: "record", click: () => this.toggle() },
    "Record video",
  );
  private recording: Recording | null = null;

  constructor(
    private readonly page: Page,
    private readonly stage: Stage,
    private readonly canvas: HTMLCanvasElement,
  ) {
    const picture = h("button", { id: "screenshot", click: () => this.picture() }, "Screenshot");
    picture.disabled = this.record.disabled = !stage.renderer;
    this.element = h("div", { class: "row" }, picture, this.record);
  }

  private picture(): void {
    this.stage.redraw(); // the last frame may no longer be in the buffer
    this.canvas.toBlob((blob) => {
      if (blob) download(blob, downloadName(this.page.now, "", "png"));
    }, "image/png");
  }

  private toggle(): void {
    if (this.recording) return void this.recording.stop(() => this.stage.redraw());
    const mimeType = kTypes.find((type) => globalThis.MediaRecorder?.isTypeSupported(type));
    if (!mimeType) return toast("This browser records no videos.", "error");
    const recorder = new MediaRecorder(this.canvas.captureStream(kFrames_hz), { mimeType });
    const begun_ms = performance.now();
    this.recording = new Recording(recorder, (video) => {
      this.recording = null;
      this.show();
      void this.offer(video, (performance.now() - begun_ms) / 1000);
    });
    this.show();
  }

  private async offer(video: Blob, duration_s: number): Promise<void> {
    if (video.size === 0) return toast("The browser has recorded no picture.", "error");
    const isWebm = !video.type.startsWith("video/mp4"),
      name = downloadName(this.page.now, "", isWebm ? "webm" : "mp4");
    download(isWebm ? await withDuration(video, duration_s) : video, name);
  }

  private show(): void {
    say(this.record, this.recording ? "Stop recording" : "Record video");
    this.record.classList.toggle("on", this.recording !== null);
  }
}
