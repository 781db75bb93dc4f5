// The 3-D view: renderer, camera, lights and the bodies at their poses. Draws only when something
// has changed.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { disposeOf, SceneBuilder, type Built, type Movers } from "./build";
import type {
  Description,
  LightDescription,
  ModelDescription,
  SceneFiles,
} from "../wire/description";
import { finishesOf, setFinish } from "./finish";
import { FrameTimer } from "./frame_timer";
import { matrixOf } from "./matrix";
import { drawnBySoftware, Quality } from "./quality";
import type { PlanarPose } from "../state/go_to";
import type { Poses } from "../state/poses";
import type { ViewMode } from "../state/page";

const kShadowReach_m = 14;
const kMostLamps = 6;
// From the camera: a robot of half a metre is then some 24 pixels of a laptop's screen, and of a
// picture of fewer pixels nearer.
const kFar_m = 18;
const kNoWheels_m = 50;
// Home: what of the world is in view, how high it looks, and the share of the view that this fills
const kLeastHome_m = 3,
  kMostHome_m = 60,
  kLookedAt_m = 1,
  kHomeShare = 0.95;
// What turns or goes less looks as it did
const kSeen_rad = 1e-3,
  kSeen_m2 = 1e-8;

export class Stage {
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(50, 1, 0.05, 400);
  readonly renderer: THREE.WebGLRenderer | null; // null: no WebGL here, and nothing is drawn
  readonly controls: OrbitControls;
  readonly quality: Quality;
  description: Description | null = null;
  mode: ViewMode = "orbit";
  frames = 0; // drawn so far
  frameCost_ms = 0; // of this thread, smoothed
  firstDrawn_ms = 0; // when the world was drawn first, since the page was asked for
  shadows = true;
  private built: Built | null = null;
  private lights = new THREE.Group();
  private sun: THREE.DirectionalLight | null = null;
  private dirty = true;
  private sensed = false; // what robots sense has changed, and is not drawn yet
  private timer: FrameTimer | null = null;
  private moved = false;
  private wireframe = false;
  private ceiling = Infinity; // m, of what is shown of things that stand
  private moving: { first: number; end: number; by: THREE.Matrix4 } | null = null; // links that are shown elsewhere
  private regroup = false; // what is near and what is far has changed
  private linkWheel = new Map<
    number,
    { robot: number; place: number; axis: THREE.Vector3; centre: THREE.Vector3 }
  >();
  private readonly followed = new THREE.Vector3();
  private following = -1; // index into the description's bases
  private lastBase: THREE.Vector3 | null = null;
  private readonly wheelAngles = new Map<number, Float64Array>(); // of robots whose odometry is known
  private spun = false; // wheels that are not drawn so yet
  // With each frame: whether it has fewer pixels than the page
  onDetail: (reduced: boolean) => void = () => undefined;

  // full: in full detail even where the processor draws.
  constructor(
    private readonly canvas: HTMLCanvasElement,
    readonly poses: Poses,
    full: boolean,
  ) {
    const software = !full && drawnBySoftware();
    this.quality = new Quality(software);
    this.renderer = makeRenderer(canvas, !software);
    if (this.renderer)
      this.timer = new FrameTimer(this.renderer.getContext() as WebGL2RenderingContext);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(-4, -5, 4);
    this.controls = new OrbitControls(this.camera, canvas);
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    this.controls.enableDamping = !calm.matches;
    calm.addEventListener("change", () => {
      this.controls.enableDamping = !calm.matches;
    });
    this.controls.dampingFactor = 0.15;
    this.controls.maxPolarAngle = Math.PI / 2 - 0.02;
    this.controls.addEventListener("change", () => {
      this.regroup = true;
      this.touch();
    });
    this.scene.add(this.lights);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    this.resize();
  }

  touch(): void {
    this.dirty = true;
  }

  // What is drawn over the scene has changed, where nothing moves.
  sense(): void {
    this.sensed = true;
  }

  setTheme(dark: boolean): void {
    const colour = new THREE.Color(dark ? 0x171b21 : 0xdde4ec);
    this.scene.background = colour;
    this.scene.fog = new THREE.Fog(colour, 35, 130);
    this.touch();
  }

  setShadows(on: boolean): void {
    this.shadows = on;
    this.refine();
  }

  // Whether less is drawn where drawing is slow.
  setAutomatic(on: boolean): void {
    this.quality.automatic = on;
    this.refine();
  }

  private get casts(): boolean {
    return this.shadows && this.quality.now.shadows;
  }

  private refine(): void {
    if (this.sun) this.sun.castShadow = this.casts;
    this.finish();
    this.moved = this.regroup = true;
    this.resize();
  }

  private finish(): void {
    for (const mesh of this.meshes()) setFinish(mesh, this.quality.now.plain);
  }

  private meshes(): THREE.InstancedMesh[] {
    const { standing = [], movers = [] } = this.built ?? {};
    return [...standing, ...movers].flatMap(({ meshes, far }) =>
      far ? [...meshes, far.mesh] : meshes,
    );
  }

  show(files: SceneFiles | null): void {
    if (this.built) {
      this.scene.remove(this.built.still, this.built.moving);
      disposeOf(this.built);
    }
    const first = this.description === null;
    this.built = this.moving = null;
    this.description = files?.description ?? null;
    for (const light of this.lights.children)
      if (light instanceof THREE.Light || light instanceof THREE.GridHelper) light.dispose(); // a light has its shadows' picture
    this.lights.clear();
    this.linkWheel.clear();
    if (files) {
      const builder = new SceneBuilder(files);
      this.built = builder.build();
      for (const picture of builder.loading) void picture.then(() => this.touch());
      this.finish();
      this.scene.add(this.built.still, this.built.moving);
      for (const [link, robot, place, x, y, z, ax, ay, az] of files.description.wheels as [
        number,
        number,
        number,
        number,
        number,
        number,
        number,
        number,
        number,
      ][]) {
        this.linkWheel.set(link, {
          robot,
          place,
          centre: new THREE.Vector3(x, y, z),
          axis: new THREE.Vector3(ax, ay, az),
        });
      }
      this.makeLights(files.description);
      if (first) this.home();
    } else {
      this.scene.add(this.lights);
      this.lights.add(new THREE.HemisphereLight(0xffffff, 0x8899aa, 2.5));
      const grid = new THREE.GridHelper(40, 40, 0x888888, 0x555555);
      grid.rotation.x = Math.PI / 2;
      this.lights.add(grid);
    }
    if (this.wireframe) this.setWireframe(true);
    this.cut();
    this.place(true);
    this.touch();
  }

  private makeLights(description: Description): void {
    const ambient = Math.max(
      0.25,
      (description.ambient[0]! + description.ambient[1]! + description.ambient[2]!) / 3,
    );
    this.lights.add(new THREE.HemisphereLight(0xf4f7ff, 0xa8a098, 2.6 * ambient + 0.7));
    this.sun = null;
    let lamps = 0;
    for (const light of description.lights) {
      const made = this.makeLight(light);
      if (!(made instanceof THREE.DirectionalLight) && ++lamps > kMostLamps) continue;
      this.lights.add(made);
      if ("target" in made) this.lights.add((made as THREE.DirectionalLight).target);
      if (made instanceof THREE.DirectionalLight && !this.sun) this.beSun(made);
    }
  }

  private makeLight(light: LightDescription): THREE.Light {
    const colour = new THREE.Color().setRGB(
      light.colour[0]!,
      light.colour[1]!,
      light.colour[2]!,
      THREE.SRGBColorSpace,
    );
    const position = new THREE.Vector3().fromArray(light.position),
      direction = new THREE.Vector3().fromArray(light.direction);
    if (light.type === "directional") {
      const sun = new THREE.DirectionalLight(colour, 2.2 * light.intensity);
      sun.userData.direction = direction.normalize();
      sun.position.copy(direction).multiplyScalar(-20);
      return sun;
    }
    const strength = (4 * light.intensity) / Math.max(0.3, light.constant);
    if (light.type === "point") {
      const lamp = new THREE.PointLight(colour, strength, 2 * light.range, 1);
      lamp.position.copy(position);
      return lamp;
    }
    const spot = new THREE.SpotLight(
      colour,
      strength,
      2 * light.range,
      Math.min(1.5, light.outer_angle / 2 || 0.6),
      0.4,
      1,
    );
    spot.position.copy(position);
    spot.target.position.copy(position).add(direction);
    return spot;
  }

  // The first directional light casts the shadows, around what is looked at.
  private beSun(sun: THREE.DirectionalLight): void {
    this.sun = sun;
    sun.castShadow = this.casts;
    sun.shadow.mapSize.set(2048, 2048);
    sun.shadow.bias = -0.0004;
    sun.shadow.normalBias = 0.02;
    sun.shadow.intensity = 0.85;
    Object.assign(sun.shadow.camera, {
      left: -kShadowReach_m,
      right: kShadowReach_m,
      top: kShadowReach_m,
      bottom: -kShadowReach_m,
      near: 1,
      far: 80,
    });
    this.moved = true;
  }

  // All of the world in view.
  home(): void {
    const low = this.description?.low ?? [-3, -3, 0],
      high = this.description?.high ?? [3, 3, 1];
    const half = [0, 1].map((i) =>
        Math.max(kLeastHome_m, Math.min(kMostHome_m, (high[i]! - low[i]!) / 2)),
      ),
      top = Math.max(0, Math.min(kMostHome_m, high[2]!, this.description?.ceiling ?? Infinity));
    const centre = new THREE.Vector3(
      (low[0]! + high[0]!) / 2,
      (low[1]! + high[1]!) / 2,
      Math.min(top / 2, kLookedAt_m),
    );
    // As near as all corners are still in view
    const eye = new THREE.Vector3(-0.5, -0.62, 0.62).normalize(),
      right = new THREE.Vector3(0, 0, 1).cross(eye).normalize(),
      up = eye.clone().cross(right);
    const upwards = kHomeShare * Math.tan((this.camera.fov * Math.PI) / 360),
      sideways = upwards * this.camera.aspect;
    let away = 0;
    for (const x of [-half[0]!, half[0]!])
      for (const y of [-half[1]!, half[1]!])
        for (const z of [-centre.z, top - centre.z]) {
          const corner = new THREE.Vector3(x, y, z),
            wide = Math.abs(corner.dot(right)) / sideways,
            high = Math.abs(corner.dot(up)) / upwards;
          away = Math.max(away, Math.max(wide, high) + corner.dot(eye));
        }
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(eye, away);
    this.controls.update();
    this.touch();
  }

  setMode(mode: ViewMode): void {
    this.mode = mode;
    this.lastBase = null;
    this.controls.enableRotate = mode !== "top";
    if (mode === "top") {
      const height = Math.max(4, this.camera.position.distanceTo(this.controls.target));
      this.camera.position.set(
        this.controls.target.x,
        this.controls.target.y - 0.001 * height,
        this.controls.target.z + height,
      );
    }
    this.controls.minPolarAngle = 0;
    this.controls.update();
    this.touch();
  }

  // Where the camera stands and where it looks.
  get viewpoint(): number[] {
    return [...this.camera.position.toArray(), ...this.controls.target.toArray()];
  }
  set viewpoint(at: number[]) {
    this.camera.position.fromArray(at);
    this.controls.target.fromArray(at, 3);
    this.controls.update();
    this.regroup = true;
    this.touch();
  }

  // Turns the view by radians to the right and upwards.
  turn(right: number, up: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target),
      at = new THREE.Spherical().setFromVector3(new THREE.Vector3(offset.x, offset.z, -offset.y));
    at.theta -= right;
    at.phi = Math.max(0.02, Math.min(this.controls.maxPolarAngle, at.phi - up));
    const turned = new THREE.Vector3().setFromSpherical(at);
    this.look(new THREE.Vector3(turned.x, -turned.z, turned.y));
  }

  // As many times as far from what is looked at.
  zoom(times: number): void {
    this.look(this.camera.position.clone().sub(this.controls.target).multiplyScalar(times));
  }

  // Shares of the distance, to the right and ahead over the ground.
  pan(right: number, ahead: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target),
      reach = offset.length();
    const forward = this.camera.getWorldDirection(new THREE.Vector3()).setZ(0);
    if (forward.lengthSq() < 1e-6) forward.set(0, 1, 0);
    forward.normalize();
    this.controls.target
      .addScaledVector(forward, ahead * reach)
      .addScaledVector(new THREE.Vector3(forward.y, -forward.x, 0), right * reach);
    this.look(offset);
  }

  private look(offset: THREE.Vector3): void {
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.regroup = true;
    this.touch();
  }

  follow(robot: number): void {
    if (robot === this.following) return;
    this.following = robot;
    this.lastBase = null;
    this.touch();
  }

  // Where a robot's base_link is; false when that is not known.
  base(robot: number, into: THREE.Matrix4, poses: ArrayLike<number> = this.poses.now): boolean {
    const base = this.description?.bases[robot];
    if (!base) return false;
    matrixOf(base.pose, 0, into);
    if (base.body < 0) return true;
    if (base.body >= this.poses.size) {
      matrixOf(base.start, 0, into);
      return true;
    }
    into.premultiply(matrixOf(poses, 7 * base.body, kScratch));
    return true;
  }

  // Where the newest message has it on the floor, and its heading, of which what is drawn is a
  // little behind; null when that is not known.
  planar(robot: number): PlanarPose | null {
    const at = new THREE.Matrix4();
    if (robot < 0 || !this.base(robot, at, this.poses.to)) return null;
    const [cosine, sine] = at.elements;
    return { x: at.elements[12], y: at.elements[13], heading: Math.atan2(sine, cosine) };
  }

  // Where a model is.
  modelAt(model: ModelDescription, into: THREE.Matrix4): void {
    matrixOf(model.pose, 0, into);
    if (model.body >= 0 && model.body < this.poses.size)
      into.premultiply(matrixOf(this.poses.now, 7 * model.body, kScratch));
  }

  // Where the floor is under a point of the canvas; null above the horizon.
  ground(x: number, y: number): THREE.Vector3 | null {
    return this.caster(x, y).ray.intersectPlane(
      new THREE.Plane(new THREE.Vector3(0, 0, 1), 0),
      new THREE.Vector3(),
    );
  }

  // What is seen under a point of the canvas, the floor included.
  point(x: number, y: number): THREE.Vector3 | null {
    return this.seen(this.caster(x, y))?.point ?? this.ground(x, y);
  }

  // Draws at once, and all pixels of it.
  redraw(): void {
    this.renderer?.render(this.scene, this.camera);
  }

  // Shows what stands up to a height (m) only, so that no roof hides the rest; null: all of it.
  cutAt(height: number | null): void {
    if (this.ceiling === (height ?? Infinity)) return;
    this.ceiling = height ?? Infinity;
    this.cut();
    this.moved = true; // shadows
    this.touch();
  }

  private cut(): void {
    const planes =
      this.ceiling < Infinity ? [new THREE.Plane(new THREE.Vector3(0, 0, -1), this.ceiling)] : null;
    for (const { meshes } of this.built?.standing ?? [])
      for (const material of meshes.flatMap(finishesOf))
        Object.assign(material, { clippingPlanes: planes, clipShadows: true, needsUpdate: true });
  }

  // Edges alone, or surfaces.
  setWireframe(on: boolean): void {
    this.wireframe = on;
    for (const material of this.meshes().flatMap(finishesOf))
      (material as THREE.MeshStandardMaterial).wireframe = on;
    this.touch();
  }

  // What is under a point of the canvas: a robot (-1 for none), the name of a model ("" for none)
  // and the point of it that is seen, and where the floor is there.
  pick(
    x: number,
    y: number,
  ): { robot: number; model: string; point: THREE.Vector3 | null; ground: THREE.Vector3 | null } {
    const caster = this.caster(x, y),
      ground = this.ground(x, y),
      seen = this.seen(caster);
    const { bases = [], models = [] } = this.description ?? {};
    const model = models[seen?.model ?? -1]?.name ?? "";
    let robot = bases.findIndex((base) => base.robot === model),
      nearest = 0.45;
    const place = new THREE.Matrix4(),
      at = new THREE.Vector3();
    for (let i = 0; robot < 0 && !model && i < bases.length; ++i) {
      // near it is enough
      if (!this.base(i, place)) continue;
      at.setFromMatrixPosition(place);
      at.z += 0.2;
      const away = caster.ray.distanceToPoint(at);
      if (away < nearest) [robot, nearest] = [i, away];
    }
    return {
      robot,
      model: model || (bases[robot]?.robot ?? ""),
      point: seen?.point ?? null,
      ground,
    };
  }

  private caster(x: number, y: number): THREE.Raycaster {
    const caster = new THREE.Raycaster();
    caster.setFromCamera(this.ndc(x, y), this.camera);
    return caster;
  }

  // The nearest model, but for the floor.
  private seen(caster: THREE.Raycaster): { model: number; point: THREE.Vector3 } | null {
    let nearest = Infinity,
      found: { model: number; point: THREE.Vector3 } | null = null;
    const { standing = [], movers = [] } = this.built ?? {};
    for (const part of [...standing, ...movers]) {
      const { indices, meshes, far, shown } = part,
        top = standing.includes(part) ? this.ceiling : Infinity;
      for (const mesh of far ? [...meshes, far.mesh] : meshes) {
        if (mesh.userData.ground) continue;
        mesh.boundingSphere = null; // of all instances, where they were once
        for (const { distance, instanceId, point } of caster.intersectObject(mesh, false)) {
          if (distance >= nearest || point.z > top) continue;
          nearest = distance;
          const place = (mesh === far?.mesh ? far.shown : shown)[instanceId!]!;
          found = { model: this.modelOf(indices[place]!), point: point.clone() };
        }
      }
    }
    return found;
  }

  // The model that a link belongs to.
  private modelOf(link: number): number {
    return this.description!.models.findIndex(
      ({ first_link, links }) => link >= first_link && link < first_link + links,
    );
  }

  // Shows a model elsewhere, by what it is moved from where it is; null: as it is.
  preview(model: ModelDescription | null, by: THREE.Matrix4): void {
    this.moving = model
      ? { first: model.first_link, end: model.first_link + model.links, by: by.clone() }
      : null;
    this.place(true);
    this.touch();
  }

  // The box around a model as it is seen; empty where it shows nothing.
  boxOf(model: ModelDescription): THREE.Box3 {
    const box = new THREE.Box3(),
      part = new THREE.Box3(),
      matrix = new THREE.Matrix4();
    for (const { indices, meshes, far } of [
      ...(this.built?.standing ?? []),
      ...(this.built?.movers ?? []),
    ]) {
      indices.forEach((link, place) => {
        if (link < model.first_link || link >= model.first_link + model.links) return;
        for (const mesh of meshes) {
          if (mesh.userData.ground) continue;
          if (!mesh.geometry.boundingBox) mesh.geometry.computeBoundingBox();
          if (far) matrix.fromArray(far.matrices, 16 * place);
          else mesh.getMatrixAt(place, matrix);
          box.union(part.copy(mesh.geometry.boundingBox!).applyMatrix4(matrix));
        }
      });
    }
    return box;
  }

  private ndc(x: number, y: number): THREE.Vector2 {
    const box = this.canvas.getBoundingClientRect();
    return new THREE.Vector2(
      (2 * (x - box.left)) / box.width - 1,
      1 - (2 * (y - box.top)) / box.height,
    );
  }

  private resize(): void {
    const box = this.canvas.parentElement!.getBoundingClientRect();
    if (box.width === 0 || box.height === 0) return;
    this.renderer?.setPixelRatio(Math.min(this.quality.now.ratio, devicePixelRatio));
    this.renderer?.setSize(box.width, box.height, false);
    this.camera.aspect = box.width / box.height;
    this.camera.updateProjectionMatrix();
    this.touch();
  }

  // Wheels may turn where the robot stays.
  turnWheels(robot: number, angles: Float64Array): void {
    const before = this.wheelAngles.get(robot);
    if (before && angles.every((angle, i) => Math.abs(angle - before[i]!) < kSeen_rad)) return;
    this.wheelAngles.set(robot, angles);
    this.spun = true;
  }

  // One frame at that moment; overlays: called when bodies may have moved.
  frame(at_ms: number, overlays: () => boolean): void {
    if (this.poses.advance(at_ms) || this.spun) {
      this.spun = false;
      this.place(false);
      this.touch();
    }
    if (overlays()) this.sense();
    this.track();
    this.controls.update();
    if (!this.renderer || !this.drawsNow(at_ms)) return;
    this.dirty = this.sensed = false;
    const begun = performance.now();
    if (this.regroup) for (const movers of this.built?.movers ?? []) this.group(movers);
    this.regroup = false;
    this.aimSun();
    this.renderer.render(this.scene, this.camera);
    if (this.quality.isSensing) this.timer!.begin();
    this.onDetail(this.quality.reduced);
    ++this.frames;
    if (this.built && this.firstDrawn_ms === 0) this.firstDrawn_ms = performance.now();
    this.frameCost_ms += 0.1 * (performance.now() - begun - this.frameCost_ms);
  }

  // Whether this frame is to be drawn, and made ready for that.
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

  private place(all: boolean): void {
    if (!this.built || (this.poses.size === 0 && !all)) return;
    for (const movers of this.built.movers) this.placeMovers(movers);
    if (all) for (const standing of this.built.standing) this.placeStanding(standing);
    this.moved = this.regroup = true;
  }

  private placeMovers({ links, indices, meshes, far }: Movers): void {
    const array = far?.matrices ?? (meshes[0]!.instanceMatrix.array as Float32Array);
    for (let i = 0; i < links.length; ++i) {
      const link = links[i]!;
      matrixOf(link.pose, 0, kLocal);
      const wheel = this.linkWheel.get(indices[i]!);
      const angle = wheel && this.wheelAngles.get(wheel.robot)?.[wheel.place];
      if (wheel && angle) {
        kTurn
          .makeTranslation(wheel.centre)
          .multiply(kSpin.makeRotationAxis(wheel.axis, angle))
          .multiply(kBack.makeTranslation(-wheel.centre.x, -wheel.centre.y, -wheel.centre.z));
        kLocal.multiply(kTurn);
      }
      if (link.body < this.poses.size)
        kLocal.premultiply(matrixOf(this.poses.now, 7 * link.body, kScratch));
      else kLocal.multiplyScalar(0);
      this.shift(indices[i]!, kLocal).toArray(array, 16 * i);
    }
    if (!far) spread(meshes);
  }

  private placeStanding({ links, indices, meshes }: Movers): void {
    links.forEach(({ pose }, i) => {
      this.shift(indices[i]!, matrixOf(pose, 0, kLocal)).toArray(
        meshes[0]!.instanceMatrix.array as Float32Array,
        16 * i,
      );
    });
    spread(meshes);
    for (const mesh of meshes) mesh.computeBoundingSphere();
  }

  // A link's place while its model is shown elsewhere.
  private shift(link: number, matrix: THREE.Matrix4): THREE.Matrix4 {
    const { moving } = this;
    return moving && link >= moving.first && link < moving.end
      ? matrix.premultiply(moving.by)
      : matrix;
  }

  // Shares many links out: those far from the camera are shown as boxes, wheels still farther not
  // at all.
  private group({ links, indices, meshes, far, shown }: Movers): void {
    if (!far) return;
    shown.length = far.shown.length = 0;
    const near = meshes[0]!.instanceMatrix.array as Float32Array,
      away = far.mesh.instanceMatrix.array as Float32Array;
    const { matrices } = far,
      eye = this.camera.position,
      { plain, ratio } = this.quality.now;
    // As many pixels of the picture
    const far_m = far.always || plain ? kFar_m * Math.min(1, ratio) : Infinity;
    let nearOnes = 0,
      farOnes = 0;
    for (let i = 0; i < links.length; ++i) {
      const at = 16 * i,
        dx = matrices[at + 12]! - eye.x,
        dy = matrices[at + 13]! - eye.y,
        dz = matrices[at + 14]! - eye.z;
      const away_m = Math.hypot(dx, dy, dz);
      if (far_m < Infinity && away_m > kNoWheels_m && this.linkWheel.has(indices[i]!)) continue;
      const isFar = away_m > far_m,
        into = isFar ? away : near,
        place = 16 * (isFar ? farOnes++ : nearOnes++);
      for (let k = 0; k < 16; ++k) into[place + k] = matrices[at + k]!;
      (isFar ? far.shown : shown).push(i);
    }
    far.mesh.count = farOnes;
    far.mesh.instanceMatrix.needsUpdate = true;
    for (const mesh of meshes) mesh.count = nearOnes;
    spread(meshes);
  }

  private track(): void {
    if (this.mode !== "follow" || !this.base(this.following, kScratch2)) return;
    this.followed.setFromMatrixPosition(kScratch2);
    if (!this.lastBase) {
      const offset = this.camera.position.clone().sub(this.controls.target);
      if (offset.length() > 7) offset.setLength(5);
      this.controls.target.copy(this.followed);
      this.camera.position.copy(this.followed).add(offset);
      this.lastBase = this.followed.clone();
      return;
    }
    const shift = this.followed.clone().sub(this.lastBase);
    if (shift.lengthSq() < kSeen_m2) return;
    this.controls.target.add(shift);
    this.camera.position.add(shift);
    this.lastBase.copy(this.followed);
    this.touch();
  }

  private aimSun(): void {
    if (!this.sun || !this.casts) return;
    const target = this.controls.target;
    if (!this.moved && this.sun.target.position.distanceToSquared(target) < 0.25) return;
    this.sun.target.position.copy(target);
    this.sun.position
      .copy(target)
      .addScaledVector(this.sun.userData.direction as THREE.Vector3, -30);
    this.renderer!.shadowMap.needsUpdate = true;
    this.moved = false;
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

const kScratch = new THREE.Matrix4(),
  kScratch2 = new THREE.Matrix4(),
  kLocal = new THREE.Matrix4(),
  kTurn = new THREE.Matrix4(),
  kSpin = new THREE.Matrix4(),
  kBack = new THREE.Matrix4();

// Gives the first mesh's matrices to the others.
function spread(meshes: THREE.InstancedMesh[]): void {
  for (const mesh of meshes) {
    if (mesh !== meshes[0])
      (mesh.instanceMatrix.array as Float32Array).set(meshes[0]!.instanceMatrix.array);
    mesh.instanceMatrix.needsUpdate = true;
  }
}
