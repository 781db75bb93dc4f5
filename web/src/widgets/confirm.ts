// A question before something that cannot be undone. Enter takes the first answer, Esc cancels.
import { h } from "./elements";

export async function confirmed(question: string, words: string, yes: string): Promise<boolean> {
  return (await chosen(question, words, [["yes", yes]])) === "yes";
}

// "" if it was cancelled.
export function chosen<Answer extends string>(
  question: string,
  words: string,
  answers: [Answer, text: string][],
): Promise<Answer | ""> {
  const dialog = h(
    "dialog",
    { class: "confirm", "aria-labelledby": "question" },
    h("h2", { id: "question" }, question),
    h("p", {}, words),
    h(
      "form",
      { method: "dialog", class: "row" },
      ...answers.map(([value, text], i) =>
        h("button", { value, class: i === 0 ? "on" : "", autofocus: i === 0 }, text),
      ),
      h("button", { value: "" }, "Cancel (Esc)"),
    ),
  );
  document.body.append(dialog);
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue as Answer | "");
    });
  });
}

// Keys belong to the dialog while it is open.
export const dialogIsOpen = () => document.querySelector("dialog[open]") !== null;
