// A video of the view that is being recorded.
const kLook_ms = 100;
const kPatience_ms = 10_000;

export class Recording {
  private readonly parts: Blob[] = [];
  private ending = false;

  // done: takes the video, which is empty where the browser has recorded nothing.
  constructor(
    private readonly recorder: MediaRecorder,
    done: (video: Blob) => void,
  ) {
    recorder.ondataavailable = ({ data }) => this.parts.push(data);
    recorder.onstop = () => done(new Blob(this.parts, { type: recorder.mimeType }));
    recorder.start(1000);
  }

  // Ends it once there is a picture: on a slow machine none may have been drawn yet. redraw: draws
  // the view, whether it has changed or not.
  async stop(redraw: () => void): Promise<void> {
    if (this.ending) return;
    this.ending = true;
    for (let waited = 0; waited < kPatience_ms && this.isEmpty(); waited += kLook_ms) {
      if (this.recorder.state === "inactive") return; // the browser has ended it
      redraw();
      this.recorder.requestData();
      await new Promise((resolve) => setTimeout(resolve, kLook_ms));
    }
    this.recorder.stop();
  }

  private isEmpty(): boolean {
    return this.parts.every((part) => part.size === 0);
  }
}
