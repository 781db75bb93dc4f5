// The keyboard shortcuts.
import type { Stage } from "../scene/stage";
import { chooseNextRobot, toggleGoing, togglePanel, toggleTheme } from "../state/choices";
import type { EditPage } from "../ui/edit_page";
import type { Timeline } from "../ui/timeline";
import type { Model } from "./model";
import type { SceneView } from "./scene_view";

const kTurn_rad = Math.PI / 24,
  kPan = 0.06,
  kZoom = 1.15; // of one press of a key

export type Shortcuts = Record<string, () => void>;

export function shortcutsOf(
  model: Model,
  scene: SceneView,
  editPage: EditPage,
  timeline: Timeline,
  help: HTMLDialogElement,
): Shortcuts {
  return {
    ...ofRun(model),
    ...ofTime(model, timeline),
    ...ofView(scene, scene.stage),
    ...ofPage(model, editPage),
    "?": () => help.showModal(),
  };
}

const ofRun = (model: Model): Shortcuts => ({
  ...ofRobot(model),
  " ": () => model.playOrPause(),
});

const ofRobot = ({ page, control }: Model): Shortcuts => ({
  r: () => void control.reset(),
  x: () => control.stop(),
  g: () => toggleGoing(page),
});

const ofTime = (model: Model, { lane }: Timeline): Shortcuts => ({
  ".": () => model.step(true),
  ",": () => model.step(false),
  ">": () => lane.jump(true),
  "<": () => lane.jump(false),
  o: () => model.page.set({ loop: !model.page.now.loop }),
  "[": () => lane.mark("begin"),
  "]": () => lane.mark("end"),
  End: () => model.live(),
});

const ofView = (scene: SceneView, stage: Stage): Shortcuts => ({
  "1": () => scene.setMode("orbit"),
  "2": () => scene.setMode("follow"),
  "3": () => scene.setMode("top"),
  Home: () => stage.home(),
  j: () => stage.view.turn(-kTurn_rad, 0),
  l: () => stage.view.turn(kTurn_rad, 0),
  i: () => stage.view.turn(0, kTurn_rad),
  k: () => stage.view.turn(0, -kTurn_rad),
  J: () => stage.view.pan(-kPan, 0),
  L: () => stage.view.pan(kPan, 0),
  I: () => stage.view.pan(0, kPan),
  K: () => stage.view.pan(0, -kPan),
  "+": () => stage.view.zoom(1 / kZoom),
  "-": () => stage.view.zoom(kZoom),
});

const ofPage = ({ page }: Model, editPage: EditPage): Shortcuts => ({
  n: () => chooseNextRobot(page),
  p: () => togglePanel(page),
  t: () => toggleTheme(page),
  b: () => editPage.startPlacing(),
  // First cancels what was begun, then clears the selection.
  Escape: () => (page.now.tool !== "select" ? editPage.stop() : page.set({ selected: "" })),
  m: () => page.set({ handle: "translate" }),
  e: () => page.set({ handle: "rotate" }),
  z: () => page.set({ handle: "scale" }),
});
