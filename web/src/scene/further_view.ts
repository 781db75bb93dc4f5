// A further view of the stage's scene with a camera of its own. The stage's renderer draws it onto
// its own canvas before the main view, so that all graphics exist once.
import * as THREE from "three";
import type { Bodies } from "./bodies";
import { metrePixels } from "./detail";
import { Picker } from "./picker";
import { Viewpoint } from "./viewpoint";

export class FurtherView {
  readonly canvas = document.createElement("canvas");
  readonly view: Viewpoint;
  readonly picker: Picker;
  private readonly size = { width: 0, height: 0 }; // CSS pixels; 0 while it is not seen
  private readonly observer: ResizeObserver;

  // changed: called when it must be drawn.
  constructor(bodies: Bodies, changed: () => void) {
    this.canvas.tabIndex = 0;
    this.view = new Viewpoint(this.canvas, changed, (robot, into) => bodies.base(robot, into));
    this.picker = new Picker(this.canvas, this.view.camera, bodies);
    this.observer = new ResizeObserver(([entry]) => {
      const { width, height } = entry!.contentRect;
      Object.assign(this.size, { width, height });
      if (width > 0 && height > 0) this.view.setAspect(width / height);
      changed();
    });
    this.observer.observe(this.canvas);
  }

  // With as many pixels as the main view has room for.
  draw(renderer: THREE.WebGLRenderer, scene: THREE.Scene, bodies: Bodies, plain: boolean): void {
    const { size, canvas, view } = this,
      ratio = renderer.getPixelRatio(),
      { width, height } = renderer.domElement;
    if (size.width === 0 || size.height === 0) return;
    const scale = Math.min(ratio, width / size.width, height / size.height),
      wide = Math.max(1, Math.floor(scale * size.width)),
      high = Math.max(1, Math.floor(scale * size.height));
    if (canvas.width !== wide || canvas.height !== high)
      Object.assign(canvas, { width: wide, height: high });
    const { camera } = view;
    bodies.shareOut({ position: camera.position, metre_px: metrePixels(high, camera.fov) }, plain);
    const part = new THREE.Vector4(0, 0, wide / ratio, high / ratio);
    renderer.setViewport(part);
    renderer.setScissor(part);
    renderer.setScissorTest(true);
    renderer.render(scene, camera);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, width / ratio, height / ratio);
    canvas
      .getContext("2d")!
      .drawImage(renderer.domElement, 0, height - high, wide, high, 0, 0, wide, high);
  }

  dispose(): void {
    this.observer.disconnect();
    this.view.controls.dispose();
  }
}
