// A panel with a further 3-D view: free, from above, or following a robot.
import type { FurtherView } from "../scene/further_view";
import type { Stage } from "../scene/stage";
import type { Page, ViewMode } from "../state/page";
import { h } from "../widgets/elements";

const kModes: readonly ViewMode[] = ["orbit", "follow", "top"];

export interface SceneSettings {
  mode?: unknown;
  robot?: unknown; // its name
  at?: unknown; // of the camera: position and target
}

// keep: called with settings that have changed.
export function makeScenePanel(page: Page, stage: Stage, settings: SceneSettings) {
  let keep: (settings: SceneSettings) => void = () => undefined;
  const shown: FurtherView = stage.addView(),
    modes = h(
      "select",
      { "aria-label": "kind of view" },
      ...kModes.map((mode) => h("option", {}, mode)),
    ),
    robots = h("select", { "aria-label": "robot to follow" });
  const follow = () => {
    const { scene } = page.now;
    shown.view.follow(scene?.bases.findIndex(({ robot }) => robot === robots.value) ?? -1);
  };
  const changed = () => {
    robots.hidden = modes.value !== "follow";
    keep({ mode: modes.value, robot: robots.value, at: shown.view.at });
  };
  const list = () => {
    const { scene } = page.now,
      before = robots.value || (typeof settings.robot === "string" ? settings.robot : "");
    robots.replaceChildren(...(scene?.bases ?? []).map(({ robot }) => h("option", {}, robot)));
    robots.value = before;
    if (robots.selectedIndex < 0) robots.selectedIndex = 0;
    follow();
  };
  shown.canvas.setAttribute("aria-label", "a further view of the world");
  modes.value = kModes.find((mode) => mode === settings.mode) ?? "orbit";
  modes.addEventListener("change", () => {
    shown.view.setMode(modes.value as ViewMode);
    changed();
  });
  robots.addEventListener("change", () => {
    follow();
    changed();
  });
  shown.view.controls.addEventListener("end", changed);
  const stop = page.watch(["scene"], list);
  shown.view.at = placeOf(settings.at) ?? stage.view.at;
  shown.view.setMode(modes.value as ViewMode);
  robots.hidden = modes.value !== "follow";
  return {
    element: h(
      "div",
      { class: "scene-panel" },
      shown.canvas,
      h("div", { class: "row over" }, modes, robots),
    ),
    init: ({ api }: { api: { updateParameters(settings: object): void } }) => {
      keep = (now) => api.updateParameters(now);
    },
    dispose: () => {
      stop();
      stage.removeView(shown);
    },
  };
}

function placeOf(at: unknown): number[] | null {
  return Array.isArray(at) && at.length === 6 && at.every(Number.isFinite) ? at : null;
}
