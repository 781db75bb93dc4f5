// A question before something that cannot be undone. Enter confirms, Esc cancels.
import { h } from "./elements";

export function confirmed(question: string, words: string, yes: string): Promise<boolean> {
  const dialog = h(
    "dialog",
    { class: "confirm", "aria-labelledby": "question" },
    h("h2", { id: "question" }, question),
    h("p", {}, words),
    h(
      "form",
      { method: "dialog", class: "row" },
      h("button", { value: "yes", class: "on", autofocus: true }, yes),
      h("button", { value: "" }, "Cancel (Esc)"),
    ),
  );
  document.body.append(dialog);
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue === "yes");
    });
  });
}

// Keys belong to the dialog while it is open.
export const dialogIsOpen = () => document.querySelector("dialog[open]") !== null;
