// The chips that turn layers over the scene on and off.
import { kLayerColours, kLayers, kOfRobots, type Layer } from "../state/layers";
import type { Page } from "../state/page";
import { h } from "../widgets/elements";

export function makeLegend(place: HTMLElement, page: Page): void {
  const chips = new Map(
    kLayers.map((layer) => [
      layer,
      h(
        "button",
        {
          class: "chip",
          "data-layer": layer,
          style: `--colour: ${kLayerColours[layer]}`,
          click: () => toggle(page, layer),
        },
        h("i"),
        layer,
      ),
    ]),
  );
  const sign = h(
    "span",
    {
      class: "chip sign",
      id: "reduced",
      title: "drawing is slow here; when nothing moves, all pixels are drawn",
    },
    "reduced detail",
  );
  place.append(...chips.values(), sign);
  page.watch(["hello", "drawn"], ({ hello, drawn }) => {
    chips.get("ghosts")!.hidden = !hello?.compared;
    chips.get("markers")!.hidden = !drawn;
  });
  page.watch(["scene", "world"], ({ scene, world }) => {
    chips.get("roof")!.hidden = typeof scene?.ceiling !== "number";
    for (const layer of kOfRobots) chips.get(layer)!.hidden = world?.robots.length === 0;
  });
  page.watch(["reduced"], ({ reduced }) => {
    sign.hidden = !reduced;
  });
  page.watch(["layers"], ({ layers }) => {
    for (const [layer, chip] of chips) {
      chip.classList.toggle("on", layers.has(layer));
      chip.setAttribute("aria-pressed", layers.has(layer) ? "true" : "false");
    }
  });
}

function toggle(page: Page, layer: Layer): void {
  const layers = new Set(page.now.layers);
  if (!layers.delete(layer)) layers.add(layer);
  page.set({ layers });
}
