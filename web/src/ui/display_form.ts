// How layers are drawn: sizes, opacities, how long points stay, colours; of all robots or of one.
import {
  displayFor,
  displayKey,
  kColourings,
  kLimits,
  kSettings,
  rememberDisplays,
  type Display,
} from "../state/display";
import type { Layer } from "../state/layers";
import type { Page } from "../state/page";
import { h } from "../widgets/elements";

type Key = keyof typeof kLimits;
const kWords: Record<Key, string> = {
  size: "size",
  strength: "strength",
  opacity: "opacity",
  decay_s: "points stay, s",
};
const isRatio = (key: Key) => key === "size" || key === "strength"; // set by its logarithm
const kMost_steps = 60;

export function makeDisplayForm(page: Page): HTMLElement {
  const robots = h("select", { "aria-label": "display of" }),
    layers = choice("layer", Object.keys(kSettings)),
    colouring = choice("coloured by", kColourings);
  layers.value = "points";
  const layer = () => layers.value as Layer,
    now = () => displayFor(page.now.displays, layer(), robots.value),
    change = (by: Partial<Display>) => {
      const key = displayKey(layer(), robots.value),
        displays = new Map(page.now.displays).set(key, { ...now(), ...by });
      rememberDisplays(displays);
      page.set({ displays });
    };
  const sliders = (Object.keys(kLimits) as Key[]).map((key) => makeSlider(key, now, change)),
    colours = row("coloured by", colouring);
  const show = () => {
    const settings = kSettings[layer()] ?? [];
    for (const slider of sliders) {
      slider.element.hidden = !settings.includes(slider.key);
      slider.show();
    }
    colours.hidden = !settings.includes("colouring");
    colouring.value = now().colouring;
  };
  for (const each of [robots, layers]) each.addEventListener("change", show);
  colouring.addEventListener("change", () =>
    change({ colouring: colouring.value as Display["colouring"] }),
  );
  page.watch(["world"], ({ world }) => {
    const before = robots.value;
    robots.replaceChildren(
      h("option", { value: "" }, "all robots"),
      ...(world?.robots ?? []).map(({ name }) => h("option", {}, name)),
    );
    robots.value = before;
    if (robots.selectedIndex < 0) robots.value = "";
    show();
  });
  return h(
    "div",
    { class: "display" },
    row("display of", robots),
    row("layer", layers),
    ...sliders.map(({ element }) => element),
    colours,
  );
}

function makeSlider(key: Key, now: () => Display, change: (by: Partial<Display>) => void) {
  const [least, most] = kLimits[key],
    to = isRatio(key) ? Math.log2 : Number,
    from = isRatio(key) ? (x: number) => 2 ** x : Number;
  const field = h("input", {
    type: "range",
    min: to(least),
    max: to(most),
    step: isRatio(key) ? 0.25 : (most - least) / kMost_steps,
    "aria-label": kWords[key],
  });
  field.addEventListener("input", () => change({ [key]: from(Number(field.value)) }));
  return {
    key,
    element: row(kWords[key], field),
    show: () => (field.value = String(to(now()[key]))),
  };
}

const choice = (label: string, options: readonly string[]) =>
  h("select", { "aria-label": label }, ...options.map((each) => h("option", {}, each)));
const row = (words: string, field: HTMLElement) =>
  h("label", { class: "row" }, h("span", { class: "dim" }, words), field);
