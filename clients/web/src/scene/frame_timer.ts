// How long a frame takes to be drawn: by a fence behind its commands, which nobody waits for.
export class FrameTimer {
  private fence: WebGLSync | null = null;
  private begun_ms = 0;

  constructor(private readonly gl: WebGL2RenderingContext) {}

  get running(): boolean {
    return this.fence !== null;
  }

  // The commands of a frame have just been given.
  begin(): void {
    if (this.fence) this.gl.deleteSync(this.fence);
    this.fence = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
    this.begun_ms = performance.now();
  }

  // How long it took, once; 0: it is not done, or none was begun.
  done(): number {
    const { gl, fence } = this;
    if (!fence || gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) return 0;
    gl.deleteSync(fence);
    this.fence = null;
    return performance.now() - this.begun_ms;
  }
}
