// The page's keyboard shortcuts, inactive while typing or while a dialog is open.
import { dialogIsOpen } from "../widgets/confirm";
import { isTyping } from "../widgets/typing";

// Names as in KeyboardEvent.key; a capital means Shift. Keys that turn the view repeat.
const kRepeat = new Set([..."ijklIJKL+-"]);

export function listenToKeys(actions: Record<string, () => void>): void {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || isTyping(event.target) || dialogIsOpen())
      return;
    const action =
      actions[event.key] ?? (event.key.length === 1 ? actions[event.key.toLowerCase()] : undefined);
    if (
      !action ||
      (event.repeat && !kRepeat.has(event.key)) ||
      ((event.key === " " || event.key === "Enter") && event.target instanceof HTMLButtonElement)
    )
      return;
    // the browser needs Escape to close what is open
    if (event.key !== "Escape") event.preventDefault();
    action();
  });
}
