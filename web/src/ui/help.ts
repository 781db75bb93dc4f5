// The keys, in a dialog.
import { h } from "../widgets/elements";

const kKeys: [string[], string][] = [
  [["W", "A", "S", "D"], "drive the chosen robot (arrow keys, a gamepad and the stick, too)"],
  [["X"], "stop it"],
  [["G"], "send it to where you click; with Shift, further points"],
  [["Arrows", "Enter"], "with the focus on the view: where a tool acts, in place of a click"],
  [["Space"], "pause and go on"],
  [[".", ","], "one step, while paused; in a log or the past, a state on and back"],
  [[">", "<"], "next event, event before"],
  [["O"], "loop what is played: between [ and ], which mark where it begins and ends"],
  [["End"], "what runs now"],
  [["R"], "reset the world"],
  [["1", "2", "3"], "orbit, follow and top view"],
  [["I", "J", "K", "L"], "turn the view; with Shift, move it"],
  [["+", "-"], "nearer, farther"],
  [["Home"], "the whole world in view"],
  [["N"], "next robot"],
  [["P"], "panel"],
  [["T"], "dark or light"],
  [["B"], "place something with the next click"],
  [["M", "E", "Z"], "move, turn or scale what is selected on the page World"],
  [["Ctrl Z", "Ctrl Y"], "take back, do again"],
  [["Ctrl D"], "a copy of it"],
  [["Del"], "delete it"],
  [["Ctrl S"], "save the world"],
  [["Esc"], "leave a tool, select nothing"],
  [["?"], "these keys"],
];

export function fillHelp(dialog: HTMLDialogElement): void {
  dialog.append(
    h("h2", { tabindex: -1, autofocus: true }, "Keys"), // else the last button has the focus, and is in view
    h(
      "div",
      { class: "keys" },
      ...kKeys.flatMap(([keys, text]) => [
        h("span", {}, ...keys.map((key) => h("kbd", {}, key))),
        h("span", {}, text),
      ]),
    ),
    h(
      "p",
      { class: "dim" },
      "Drag to turn the view, with the right button or two fingers to move it, turn the wheel to " +
        "come nearer. Click a robot to choose it.",
    ),
    h("div", { class: "row" }, h("button", { click: () => dialog.close() }, "Close")),
  );
}
