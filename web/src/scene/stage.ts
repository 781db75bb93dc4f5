// The 3-D view: its contents, and when it is drawn, which is only when something has changed.
import * as THREE from "three";
import type { Poses } from "../state/poses";
import type { Description, ModelDescription, SceneFiles } from "../wire/description";
import { Bodies } from "./bodies";
import { disposeOf, SceneBuilder } from "./build";
import { metrePixels } from "./detail";
import { finishesOf, setFinish } from "./finish";
import { FrameTimer } from "./frame_timer";
import { FurtherView } from "./further_view";
import { Lights } from "./lights";
import { Picker } from "./picker";
import { drawnBySoftware, Quality } from "./quality";
import { shownOf, Viewpoint, viewOf } from "./viewpoint";

export class Stage {
  readonly scene = new THREE.Scene();
  readonly renderer: THREE.WebGLRenderer | null; // null without WebGL: nothing is drawn
  readonly quality: Quality;
  readonly view: Viewpoint;
  readonly bodies: Bodies;
  readonly picker: Picker;
  frames = 0; // drawn since the start
  frameCost_ms = 0; // of this thread, smoothed
  firstDrawn_ms = 0; // when the world was first drawn, since navigation
  private readonly lights = new Lights();
  private readonly further = new Set<FurtherView>();
  private readonly fog = new THREE.Fog(0); // begins behind what is looked at
  private timer: FrameTimer | null = null;
  private shadows = true; // the user's choice
  private wireframe = false;
  private dirty = true;
  private sensed = false; // sensor data has changed and is not drawn yet
  private regroup = false; // distances from the camera have changed
  // Called with each frame: whether it has fewer pixels than the display
  onDetail: (reduced: boolean) => void = () => undefined;
  // Called when the browser takes the graphics away, and when it gives them back
  onContext: (there: boolean) => void = () => undefined;
  // Called with each further view
  onView: (view: FurtherView) => void = () => undefined;

  // full: full detail even with a software rasteriser.
  constructor(
    private readonly canvas: HTMLCanvasElement,
    readonly poses: Poses,
    full: boolean,
  ) {
    const software = !full && drawnBySoftware();
    this.quality = new Quality(software);
    this.renderer = makeRenderer(canvas, !software);
    this.makeTimer();
    canvas.addEventListener("webglcontextlost", () => this.onContext(false));
    canvas.addEventListener("webglcontextrestored", () => {
      this.makeTimer();
      this.lights.moved();
      this.refine();
      this.onContext(true);
    });
    this.bodies = new Bodies(poses, () => {
      this.lights.moved();
      this.turned();
    });
    this.view = new Viewpoint(
      canvas,
      () => this.turned(),
      (robot, into) => this.bodies.base(robot, into),
    );
    this.picker = new Picker(canvas, this.view.camera, this.bodies);
    this.scene.add(this.lights.group);
    this.scene.fog = this.fog;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    this.resize();
  }

  private makeTimer(): void {
    const context = this.renderer?.getContext() as WebGL2RenderingContext | undefined;
    this.timer = context ? new FrameTimer(context) : null;
  }

  // Something has changed: draw with the next frame.
  touch(): void {
    this.dirty = true;
  }

  // Only what is drawn over the scene has changed; nothing moves.
  sense(): void {
    this.sensed = true;
  }

  // The camera or something in the scene has moved.
  private turned(): void {
    this.regroup = true;
    this.touch();
  }

  setTheme(dark: boolean): void {
    const colour = new THREE.Color(dark ? 0x171b21 : 0xdde4ec);
    this.scene.background = colour;
    this.fog.color.copy(colour);
    this.touch();
  }

  setShadows(on: boolean): void {
    this.shadows = on;
    this.refine();
  }

  // Whether detail is reduced where drawing is slow.
  setAutomatic(on: boolean): void {
    this.quality.automatic = on;
    this.refine();
  }

  // Applies the current quality.
  private refine(): void {
    const { shadows, plain } = this.quality.now;
    this.lights.cast(this.shadows && shadows);
    for (const mesh of this.bodies.meshes()) setFinish(mesh, plain);
    this.regroup = true;
    this.resize();
  }

  // Shows another world, or none.
  show(files: SceneFiles | null): void {
    const { built, description } = this.bodies,
      first = description === null;
    if (built) {
      this.scene.remove(built.still, built.moving);
      disposeOf(built);
    }
    const builder = files && new SceneBuilder(files),
      next = builder?.build() ?? null;
    for (const picture of builder?.loading ?? []) void picture.then(() => this.touch());
    if (next) this.scene.add(next.still, next.moving);
    this.bodies.show(files?.description ?? null, next);
    this.lights.show(files?.description ?? null);
    this.refine();
    if (files && first) this.begin(files.description);
    if (this.wireframe) this.setWireframe(true);
    this.cut();
    this.touch();
  }

  private begin({ viewpoint, floor }: Description): void {
    if (viewpoint) this.view.begin(viewOf(viewpoint, floor));
    else this.home();
  }

  // Shows all of the world.
  home(): void {
    this.view.home(shownOf(this.bodies.description));
  }

  // A further view of the scene.
  addView(): FurtherView {
    const view = new FurtherView(this.bodies, () => this.touch());
    this.further.add(view);
    this.onView(view);
    return view;
  }
  removeView(view: FurtherView): void {
    this.further.delete(view);
    view.dispose();
  }

  // Shows a model moved by that transform; null: where it is.
  preview(model: ModelDescription | null, by: THREE.Matrix4): void {
    this.bodies.preview(model, by);
    this.touch();
  }

  // Draws at once.
  redraw(): void {
    this.renderer?.render(this.scene, this.view.camera);
  }

  // Shows standing things up to a height (m) only, so that no roof hides the rest; null: all of
  // them.
  cutAt(height: number | null): void {
    const ceiling = height ?? Infinity;
    if (this.bodies.ceiling === ceiling) return;
    this.bodies.ceiling = ceiling;
    this.cut();
    this.lights.moved();
    this.touch();
  }

  private cut(): void {
    const { ceiling } = this.bodies,
      planes = ceiling < Infinity ? [new THREE.Plane(new THREE.Vector3(0, 0, -1), ceiling)] : null;
    for (const { meshes } of this.bodies.built?.standing ?? [])
      for (const material of meshes.flatMap(finishesOf))
        Object.assign(material, { clippingPlanes: planes, clipShadows: true, needsUpdate: true });
  }

  // Edges only, or surfaces.
  setWireframe(on: boolean): void {
    this.wireframe = on;
    for (const material of this.bodies.meshes().flatMap(finishesOf))
      (material as THREE.MeshStandardMaterial).wireframe = on;
    this.touch();
  }

  private resize(): void {
    const box = this.canvas.parentElement!.getBoundingClientRect();
    if (box.width === 0 || box.height === 0) return;
    this.renderer?.setPixelRatio(Math.min(this.quality.now.ratio, devicePixelRatio));
    this.renderer?.setSize(box.width, box.height, false);
    this.view.setAspect(box.width / box.height);
    this.turned();
  }

  // Draws the frame of that time, if needed. overlays: called once the bodies are placed.
  frame(at_ms: number, overlays: () => boolean): void {
    this.bodies.advance(at_ms);
    if (overlays()) this.sense();
    this.view.frame();
    for (const { view } of this.further) view.frame();
    if (!this.renderer || !this.drawsNow(at_ms)) return;
    this.dirty = this.sensed = false;
    const begun = performance.now();
    this.render(this.renderer);
    if (this.quality.isSensing) this.timer!.begin();
    this.onDetail(this.quality.reduced);
    ++this.frames;
    if (this.bodies.built && this.firstDrawn_ms === 0) this.firstDrawn_ms = performance.now();
    this.frameCost_ms += 0.1 * (performance.now() - begun - this.frameCost_ms);
  }

  private render(renderer: THREE.WebGLRenderer): void {
    const { camera, controls } = this.view,
      { plain } = this.quality.now;
    if (this.lights.aim(controls.target)) renderer.shadowMap.needsUpdate = true;
    for (const view of this.further) {
      this.clear(view.view.reach);
      view.draw(renderer, this.scene, this.bodies, plain);
      this.regroup = true;
    }
    if (this.regroup) {
      const metre_px = metrePixels(renderer.domElement.height, camera.fov);
      this.bodies.shareOut({ position: camera.position, metre_px }, plain);
      this.regroup = false;
    }
    this.clear(this.view.reach);
    renderer.render(this.scene, camera);
  }

  // Fog begins behind what is looked at in that distance.
  private clear(reach_m: number): void {
    this.fog.near = Math.max(35, 2 * reach_m);
    this.fog.far = 4 * this.fog.near;
  }

  // Whether this frame is to be drawn; applies its quality if so.
  private drawsNow(at_ms: number): boolean {
    const cost_ms = this.timer?.done();
    if (cost_ms) this.quality.took(cost_ms);
    const change = this.dirty ? "motion" : this.sensed ? "sensing" : "none";
    if (change === "sensing" && this.timer?.running) return false;
    const { draw, other } = this.quality.next(at_ms, change);
    if (
      other ||
      (draw && change !== "none" && !this.quality.isSensing && this.quality.drawn(at_ms))
    )
      this.refine();
    return draw;
  }
}

function makeRenderer(canvas: HTMLCanvasElement, antialias: boolean): THREE.WebGLRenderer | null {
  try {
    const renderer = new THREE.WebGLRenderer({
      canvas,
      antialias,
      powerPreference: "high-performance",
    });
    renderer.localClippingEnabled = true;
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = THREE.PCFShadowMap;
    renderer.shadowMap.autoUpdate = false;
    renderer.toneMapping = THREE.NeutralToneMapping;
    return renderer;
  } catch {
    return null;
  }
}
