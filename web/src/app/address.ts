// The place in the page's URL: moment, camera, robot, selected model, what is open.
import type { Stage } from "../scene/stage";
import { chooseRobot } from "../state/choices";
import { kLayers } from "../state/layers";
import { hashOf, placeOf, type Open } from "../state/place";
import { toast } from "../widgets/elements";
import type { Model } from "./model";

type Pane = Open["panes"][number];

export function goToAddress({ page, link }: Model, stage: Stage): void {
  const { time_s, camera, robot, selected } = placeOf(location.hash);
  if (camera) stage.view.at = camera;
  chooseRobot(page, page.now.world?.robots.findIndex(({ name }) => name === robot) ?? -1);
  if (selected) page.set({ selected });
  if (time_s !== null && page.now.hello?.mode === "log") {
    link.play(false, 1);
    link.seek(time_s);
  }
}

export async function copyLink(
  { page }: Model,
  stage: Stage,
  panes: Pane[],
  layout: unknown,
): Promise<void> {
  const { hello, playback, past, world, robot, selected, tab, layers } = page.now,
    open = { page: tab, off: kLayers.filter((layer) => !layers.has(layer)), panes, layout },
    time_s = hello?.mode === "log" ? (playback?.now ?? null) : (past?.now ?? null);
  const name = world?.robots[robot]?.name ?? "";
  location.hash = hashOf({ time_s, camera: stage.view.at, robot: name, selected, open });
  try {
    await navigator.clipboard.writeText(location.href);
    toast("The link is copied.");
  } catch {
    toast("The link is in the address bar.");
  }
}
