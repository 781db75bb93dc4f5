// The name of the shown world in the browser's memory and in names of downloads.
import type { PageState } from "./page";
import { shownOf } from "./time";

// The file's name, since many worlds are called "default"; the world's if there is no file.
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
