// Screenshots and videos of the view, made by the browser.
import type { Stage } from "../scene/stage";
import { download } from "../widgets/download";
import { h, say, toast } from "../widgets/elements";
import { Recording } from "./recording";

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
      if (blob) download(blob, "ruedo.png");
    }, "image/png");
  }

  private toggle(): void {
    if (this.recording) return void this.recording.stop(() => this.stage.redraw());
    const mimeType = kTypes.find((type) => globalThis.MediaRecorder?.isTypeSupported(type));
    if (!mimeType) return toast("This browser records no videos.", "error");
    const recorder = new MediaRecorder(this.canvas.captureStream(kFrames_hz), { mimeType });
    this.recording = new Recording(recorder, (video) => {
      this.recording = null;
      this.show();
      if (video.size === 0) return toast("The browser has recorded no picture.", "error");
      download(video, `ruedo.${mimeType.startsWith("video/mp4") ? "mp4" : "webm"}`);
    });
    this.show();
  }

  private show(): void {
    say(this.record, this.recording ? "Stop recording" : "Record video");
    this.record.classList.toggle("on", this.recording !== null);
  }
}
