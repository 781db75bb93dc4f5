// A dialog with a command to copy into a terminal.
import { h } from "./elements";

export function showCommand(heading: string, command: string): void {
  const text = h("code", { id: "command" }, command),
    copy = h("button", { type: "button", class: "on", autofocus: true }, "Copy");
  copy.addEventListener("click", () => {
    // The clipboard is missing on pages from another machine over an unencrypted connection.
    const copied = navigator.clipboard?.writeText(command) ?? Promise.reject(new Error());
    copied.then(
      () => (copy.textContent = "Copied"),
      () => getSelection()?.selectAllChildren(text),
    );
  });
  const dialog = h(
    "dialog",
    { class: "confirm", "aria-labelledby": "command-heading" },
    h("h2", { id: "command-heading" }, heading),
    h("p", {}, "A second run continues from there:"),
    h("p", {}, text),
    h("form", { method: "dialog", class: "row" }, copy, h("button", { value: "" }, "Close (Esc)")),
  );
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}
