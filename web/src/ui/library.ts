// Models to place, with previews that the page renders itself.
import * as THREE from "three";
import { disposeOf, SceneBuilder } from "../scene/build";
import { loadScene } from "../wire/description";
import { matrixOf } from "../scene/matrix";
import type { Page, Thing } from "../state/page";
import { h } from "../widgets/elements";

interface Entry {
  name: string;
  robot: boolean;
}
const kWidth = 144,
  kHeight = 108;

export class Library {
  readonly element = h("section", { class: "library", id: "library" });
  private asked = false;

  constructor(private readonly page: Page) {
    page.watch(["tool"], ({ tool }) => {
      for (const button of this.element.querySelectorAll("button"))
        button.classList.toggle(
          "on",
          typeof tool !== "string" && button.dataset.library === tool.model,
        );
    });
  }

  // When it first becomes visible.
  async fill(): Promise<void> {
    if (this.asked) return;
    this.asked = true;
    const answer = await fetch("/library.json").catch(() => null);
    if (!answer?.ok) return;
    const entries = (await answer.json()) as Entry[],
      painter = new Painter();
    for (const [index, entry] of entries.entries()) {
      const image = h("img", { alt: "", width: kWidth / 2, height: kHeight / 2 }),
        thing: Thing = { name: entry.name, model: entry.name, text: "" };
      this.element.append(
        h(
          "button",
          {
            "data-library": entry.name,
            title: `place ${entry.name} by a click`,
            click: () => this.page.set({ tool: this.page.now.tool === thing ? "select" : thing }),
          },
          image,
          entry.name,
        ),
      );
      await painter.paint(index, image).catch(() => undefined);
    }
    painter.dispose();
  }
}

// Renders one model, seen from the front and above.
class Painter {
  private readonly renderer: THREE.WebGLRenderer | null = makeRenderer();

  async paint(index: number, image: HTMLImageElement): Promise<void> {
    const files = this.renderer && (await loadScene(null, `/library/${index}/scene`));
    if (!files || !this.renderer) return;
    const builder = new SceneBuilder(files),
      built = builder.build(),
      scene = new THREE.Scene(),
      matrix = new THREE.Matrix4();
    scene.add(
      built.still,
      new THREE.HemisphereLight(0xffffff, 0x99a0a8, 2.4),
      new THREE.DirectionalLight(0xffffff, 2),
    );
    for (const { links, meshes } of built.standing) {
      for (const mesh of meshes)
        links.forEach(({ pose }, i) => mesh.setMatrixAt(i, matrixOf(pose, 0, matrix)));
    }
    const { low, high } = files.description,
      centre = new THREE.Vector3(
        ...(low.map((v, i) => (v + high[i]!) / 2) as [number, number, number]),
      );
    const size = Math.max(0.1, Math.hypot(...high.map((v, i) => v - low[i]!))),
      camera = new THREE.PerspectiveCamera(30, kWidth / kHeight, 0.01, 100);
    camera.up.set(0, 0, 1);
    camera.position.copy(centre).add(new THREE.Vector3(1.1, -1.2, 0.8).multiplyScalar(size * 1.15));
    camera.lookAt(centre);
    await Promise.all(builder.loading);
    this.renderer.render(scene, camera);
    image.src = this.renderer.domElement.toDataURL("image/png");
    disposeOf(built);
  }

  dispose(): void {
    this.renderer?.dispose();
    this.renderer?.forceContextLoss();
  }
}

function makeRenderer(): THREE.WebGLRenderer | null {
  try {
    const renderer = new THREE.WebGLRenderer({
      antialias: true,
      alpha: true,
      preserveDrawingBuffer: true,
    });
    renderer.setSize(kWidth, kHeight, false);
    return renderer;
  } catch {
    return null;
  }
}
