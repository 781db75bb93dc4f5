// The page's state: what runs, what is shown of it, and how.
import type { Hello, LinkState, Playback, RunEvent, Comparison, Warning } from "../wire/protocol";
import type { Past } from "../wire/rewind";
import type { Description } from "../wire/description";
import { recallDisplays, type Displays } from "./display";
import { kLayers, kOffAtFirst, type Layer } from "./layers";
import { recall } from "./memory";
import { Store } from "./store";
import type { World } from "./world";

export const kTabs = ["Robot", "Plots", "Channels", "World", "Notes"] as const;
export type Tab = (typeof kTabs)[number];

export type ViewMode = "orbit" | "follow" | "top";

// A thing to place: one of the server's models, or SDF. name: of the model that is made.
export interface Thing {
  name: string;
  model: string;
  text: string;
  label?: string;
}

// The action of a click on the scene: select, send the chosen robot there, place a thing, or draw.
export type Tool = "select" | "go" | "wall" | "room" | "door" | "measure" | Thing;
// The action of the selected model's handles.
export type Handle = "translate" | "rotate" | "scale";

// Undo and redo: the names of the next steps, and the net number of changes.
export interface HistoryState {
  undo: string | null;
  redo: string | null;
  changes: number;
}

export interface PageState {
  link: LinkState;
  hello: Hello | null;
  controlled: boolean; // the run takes requests
  world: World | null; // set together with its scene by Loading
  scene: Description | null;
  // world and scene of this connection are known, so that messages can be interpreted
  complete: boolean;
  robot: number; // the chosen one, an index into world.robots; -1 for none
  paused: boolean;
  time_s: number; // sim time
  factor: number | null; // sim time per real time
  playback: Playback | null; // of a log
  past: Past | null; // of a live run: the earlier moment that is shown; null for the present
  kept: { begin: number; end: number }; // what can be shown of the past
  comparison: Comparison | null; // with the other log; null if there is none, or not yet
  events: readonly RunEvent[]; // in order of time
  warnings: readonly Warning[]; // of the program
  eventKind: string; // which of them are shown; "" for all
  loop: boolean; // playback starts over at the end
  // of the part that is looped; null: from the beginning, to the end
  marks: { begin: number | null; end: number | null };
  span: Span | null; // the part of the time line that is shown; null: all of it
  layers: ReadonlySet<Layer>;
  displays: Displays; // of what robots sense
  mode: ViewMode;
  drawn: boolean; // clients have drawn something
  reduced: boolean; // drawn with fewer pixels than the display has
  theme: string;
  selected: string; // name of the model being edited; "" for none
  tool: Tool;
  handle: Handle;
  snap_m: number; // 0: off
  edits: HistoryState;
  saved: number; // number of changes when the world was last saved
  tab: Tab; // the page that was opened last
  shown: ReadonlySet<Tab>; // pages that are seen
  panel: boolean; // whether pages are seen at all
}

export interface Span {
  begin: number; // s
  end: number;
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
    warnings: [],
    eventKind: "",
    loop: false,
    marks: { begin: null, end: null },
    span: null,
    layers: new Set(kLayers.filter((layer) => !off.includes(layer))),
    displays: recallDisplays(),
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
    shown: new Set<Tab>(),
    panel: innerWidth >= 860 && recall("panel") !== "closed",
  });
}

// The state of the run in words, and whether it is good; null: neither.
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

// The robots whose sensors are drawn: all if they are few, else the chosen one.
export const kShownRobots = 4;
export function shownRobots({ world, robot }: Readonly<PageState>): string[] {
  const names = world?.robots.map(({ name }) => name) ?? [];
  return names.length <= kShownRobots ? names : names.slice(robot, robot + 1);
}
