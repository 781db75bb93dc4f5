// What is needed less often: among the other controls, and on a phone in a list that a button
// opens.
import { h } from "./elements";
import { icon } from "./icons";

export function more(
  id: string,
  title: string,
  ...controls: HTMLElement[]
): [list: HTMLElement, button: HTMLElement] {
  return [
    h("span", { id, class: "more", popover: true }, ...controls),
    h(
      "button",
      { class: "icon open-more", popovertarget: id, title, "aria-label": title },
      icon("more"),
    ),
  ];
}
