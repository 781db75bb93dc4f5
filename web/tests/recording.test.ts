import { describe, expect, it, vi } from "vitest";
import { Recording } from "../src/ui/recording";

// A recorder whose first picture comes with the third drawing.
class SlowRecorder {
  readonly mimeType = "video/webm";
  ondataavailable: (event: { data: Blob }) => void = () => {};
  onstop = (): void => {};
  stops = 0;
  drawn = 0;

  start(): void {}
  requestData(): void {
    this.ondataavailable({ data: new Blob(this.drawn >= 3 ? ["picture"] : []) });
  }
  stop(): void {
    ++this.stops;
    this.onstop();
  }
}

async function recorded(draws: boolean): Promise<[Blob | null, SlowRecorder]> {
  vi.useFakeTimers();
  const recorder = new SlowRecorder();
  let video: Blob | null = null;
  const recording = new Recording(recorder as unknown as MediaRecorder, (made) => (video = made));
  const redraw = () => void (recorder.drawn += draws ? 1 : 0);
  void recording.stop(redraw);
  void recording.stop(redraw); // a second click
  await vi.runAllTimersAsync();
  vi.useRealTimers();
  return [video, recorder];
}

describe("a video that is stopped at once", () => {
  it("has a picture", async () => {
    const [video, recorder] = await recorded(true);
    expect(await video!.text()).toBe("picture");
    expect(video!.type).toBe("video/webm");
    expect(recorder.stops).toBe(1);
  });

  it("ends without a picture if none is drawn", async () => {
    const [video, recorder] = await recorded(false);
    expect(video!.size).toBe(0);
    expect(recorder.stops).toBe(1);
  });
});
