// The page's keys. None of them acts while something is typed or a dialog is open.
import { dialogIsOpen } from "../widgets/confirm";
import { isTyping } from "../widgets/typing";

// Names as KeyboardEvent.key has them; a capital is with Shift. Those that turn the view repeat.
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
    if (event.key !== "Escape") event.preventDefault(); // the browser closes what is open by it, too
    action();
  });
}
