// Measures the drawing time of a frame by a fence, without waiting for it.
export class FrameTimer {
  private fence: WebGLSync | null = null;
  private begun_ms = 0;

  constructor(private readonly gl: WebGL2RenderingContext) {}

  get running(): boolean {
    return this.fence !== null;
  }

  // To be called after a frame's commands.
  begin(): void {
    if (this.fence) this.gl.deleteSync(this.fence);
    this.fence = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
    this.begun_ms = performance.now();
  }

  // The time, once; 0 if it is not finished, or none was begun.
  done(): number {
    const { gl, fence } = this;
    if (!fence || gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) return 0;
    gl.deleteSync(fence);
    this.fence = null;
    return performance.now() - this.begun_ms;
  }
}
