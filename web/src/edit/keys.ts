// Keys of the page World: undo, redo, duplicate, delete, save.
import type { Page } from "../state/page";
import { dialogIsOpen } from "../widgets/confirm";
import { isTyping } from "../widgets/typing";
import type { Editor } from "./editor";

export function listenToEditing(page: Page, editor: Editor): void {
  addEventListener("keydown", (event) => {
    const { shown, hello, controlled, selected } = page.now;
    if (!shown.has("World") || hello?.mode !== "live" || !controlled || dialogIsOpen()) return;
    const key = event.key.toLowerCase(),
      command = event.ctrlKey || event.metaKey,
      typing = isTyping(event.target);
    let action: (() => void) | null = null;
    if (command && key === "s" && hello.save) action = () => void editor.save();
    else if (typing) return;
    else if (command && (key === "y" || (key === "z" && event.shiftKey)))
      action = () => void editor.history.redo();
    else if (command && key === "z") action = () => void editor.history.undo();
    else if (command && key === "d" && selected) action = () => void editor.duplicate(selected);
    else if (!command && (key === "delete" || key === "backspace") && selected)
      action = () => void editor.remove(selected);
    if (!action) return;
    event.preventDefault();
    action();
  });
  // Asks before unsaved changes are left.
  addEventListener("beforeunload", (event) => {
    const { hello, edits, saved } = page.now;
    if (hello?.save && edits.changes !== saved) event.preventDefault();
  });
}
