// The page's state: what runs, what is shown of it, and how.
import type { Hello, LinkState, Playback, RunEvent, Comparison } from "../wire/protocol";
import type { Past } from "../wire/rewind";
import type { Description } from "../wire/description";
import { kLayers, kOffAtFirst, type Layer } from "./layers";
import { recall } from "./memory";
import { Store } from "./store";
import type { World } from "./world";

export const kTabs = ["Robot", "Plots", "Channels", "World"] as const;
export type Tab = (typeof kTabs)[number];

export type ViewMode = "orbit" | "follow" | "top";

// What can be placed. name: its model gets; a model of the server's, or SDF.
export interface Thing {
  name: string;
  model: string;
  text: string;
  label?: string;
}

// What a click on the scene does: selects, sends the chosen robot there, places a thing, or draws.
export type Tool = "select" | "go" | "wall" | "room" | "door" | "measure" | Thing;
// What the handles of the selected model do.
export type Handle = "translate" | "rotate" | "scale";

// What can be taken back and done again: names of the next steps, and how many were done, to and
// fro.
export interface HistoryState {
  undo: string | null;
  redo: string | null;
  changes: number;
}

export interface PageState {
  link: LinkState;
  hello: Hello | null;
  controlled: boolean; // the run takes requests
  world: World | null; // and its scene: both of one moment, by Loading
  scene: Description | null;
  complete: boolean; // both are there, of this connection: messages of the run mean something
  robot: number; // chosen, index into world.robots; -1 for none
  paused: boolean;
  time_s: number; // sim time
  factor: number | null; // sim time per real time
  playback: Playback | null; // of a log
  past: Past | null; // of a live run: the earlier moment that is shown; null: the present
  kept: { begin: number; end: number }; // what can be shown of it
  comparison: Comparison | null; // with the other log; null: none, or not known yet
  events: readonly RunEvent[]; // what happened, in the order of time
  eventKind: string; // which of them are shown; "" for all
  loop: boolean; // what plays starts over when it has ended
  marks: { begin: number | null; end: number | null }; // of what is looped; null: all of it
  layers: ReadonlySet<Layer>;
  mode: ViewMode;
  drawn: boolean; // clients have drawn something
  reduced: boolean; // drawn with fewer pixels than the page has
  theme: string;
  selected: string; // name of the model that is being edited; "" for none
  tool: Tool;
  handle: Handle;
  snap_m: number; // 0: off
  edits: HistoryState;
  saved: number; // changes that were done when the world was saved
  tab: Tab;
  panel: boolean; // is open
}

export type Page = Store<PageState>;

export function makePage(): Page {
  const off = recall("layers-off")?.split(",") ?? kOffAtFirst;
  const tab = recall("page");
  return new Store<PageState>({
    link: "connecting",
    hello: null,
    controlled: false,
    world: null,
    scene: null,
    complete: false,
    robot: -1,
    paused: false,
    time_s: 0,
    factor: null,
    playback: null,
    past: null,
    kept: { begin: 0, end: 0 },
    comparison: null,
    events: [],
    eventKind: "",
    loop: false,
    marks: { begin: null, end: null },
    layers: new Set(kLayers.filter((layer) => !off.includes(layer))),
    mode: "orbit",
    drawn: false,
    reduced: false,
    theme:
      recall("theme") ?? (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark"),
    selected: "",
    tool: "select",
    handle: "translate",
    snap_m: Number(recall("snap") ?? 0.1),
    edits: { undo: null, redo: null, changes: 0 },
    saved: 0,
    tab: kTabs.find((name) => name === tab) ?? "Robot",
    panel: innerWidth >= 860 && recall("panel") !== "closed",
  });
}

// What is said of the run in the bar, and whether that is good; null: neither.
const kLinkWords = {
  connecting: "connecting",
  silent: "no answer",
  lost: "no connection",
  ended: "ended",
};
export function stateWords({
  link,
  hello,
  world,
  paused,
  playback,
  past,
}: Readonly<PageState>): [words: string, good: boolean | null] {
  if (link !== "open") return [kLinkWords[link], false];
  if (hello?.mode === "log" && playback) return [playback.playing ? "log" : "log, paused", null];
  if (!world) return ["connected", true];
  if (past) return [`${(past.end - past.now).toFixed(1)} s ago`, null];
  return paused ? ["paused", false] : ["running", true];
}

// The robots that show what they sense in the view: all while they are few, else the chosen one.
export const kShownRobots = 4;
export function shownRobots({ world, robot }: Readonly<PageState>): string[] {
  const names = world?.robots.map(({ name }) => name) ?? [];
  return names.length <= kShownRobots ? names : names.slice(robot, robot + 1);
}
