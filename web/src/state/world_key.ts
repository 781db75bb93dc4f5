// What the browser's memory and the names of downloads call the shown world.
import type { PageState } from "./page";
import { shownOf } from "./time";

// Of its file, for many worlds are called "default"; its name if there is no file.
export function worldKey({ hello, world }: Pick<PageState, "hello" | "world">): string {
  return hello?.world || (world?.name ?? "");
}

// "arena_12.34s.png"
export function downloadName(state: Readonly<PageState>, what: string, ending: string): string {
  const title = state.hello?.title.replace(/\.\w+$/, "").replace(/[^\w.-]+/g, "_") || "ruedo",
    shown = shownOf(state);
  const time_s = state.hello?.mode === "log" && shown ? shown.now - shown.begin : state.time_s;
  return `${[title, what, `${time_s.toFixed(2)}s`].filter(Boolean).join("_")}.${ending}`;
}
