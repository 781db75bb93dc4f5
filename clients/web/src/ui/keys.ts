// The page's keys. None of them acts while something is typed or a dialog is open.
import { dialogIsOpen } from "./confirm";
import { isTyping } from "./drive";

// Names as KeyboardEvent.key has them, letters small.
export function listenToKeys(actions: Record<string, () => void>): void {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || isTyping(event.target) || dialogIsOpen()) return;
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || ((event.key === " " || event.key === "Enter") && event.target instanceof HTMLButtonElement)) return;
    event.preventDefault();
    action();
  });
}
