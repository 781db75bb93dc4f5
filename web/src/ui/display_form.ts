// How what robots sense is drawn: sizes, opacities, how long points stay, colours; of all robots or
// of one.
import { displayFor, kColourings, kLimits, rememberDisplays, type Display } from "../state/display";
import type { Page } from "../state/page";
import { h } from "../widgets/elements";

type Key = keyof typeof kLimits;
const kWords: Record<Key, string> = {
  size: "size of points",
  opacity: "strength of rays",
  cover: "opacity of points",
  decay_s: "points stay, s",
};
const isRatio = (key: Key) => key === "size" || key === "opacity"; // set by its logarithm

export function makeDisplayForm(page: Page): HTMLElement {
  const robots = h("select", { "aria-label": "display of" }),
    colouring = h(
      "select",
      { "aria-label": "colour of clouds" },
      ...kColourings.map((each) => h("option", {}, each)),
    );
  const now = () => displayFor(page.now.displays, robots.value),
    change = (by: Partial<Display>) => {
      const displays = new Map(page.now.displays).set(robots.value, { ...now(), ...by });
      rememberDisplays(displays);
      page.set({ displays });
    };
  const sliders = (Object.keys(kLimits) as Key[]).map((key) => {
    const [least, most] = kLimits[key],
      to = isRatio(key) ? Math.log2 : Number,
      from = isRatio(key) ? (x: number) => 2 ** x : Number;
    const field = h("input", {
      type: "range",
      min: to(least),
      max: to(most),
      step: isRatio(key) ? 0.25 : (most - least) / 60,
      "aria-label": kWords[key],
    });
    field.addEventListener("input", () => change({ [key]: from(Number(field.value)) }));
    return { key, field, show: () => (field.value = String(to(now()[key]))) };
  });
  const show = () => {
    for (const slider of sliders) slider.show();
    colouring.value = now().colouring;
  };
  robots.addEventListener("change", show);
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
  const row = (words: string, field: HTMLElement) =>
    h("label", { class: "row" }, h("span", { class: "dim" }, words), field);
  return h(
    "div",
    { class: "display" },
    row("display of", robots),
    ...sliders.map(({ key, field }) => row(kWords[key], field)),
    row("clouds coloured by", colouring),
  );
}
