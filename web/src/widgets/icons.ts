// Icons on buttons.
import { h } from "./elements";

const kIcons = {
  pause: "M5 3h4v14H5zM11 3h4v14h-4z",
  play: "M5 3l12 7-12 7z",
  step: "M4 3l9 7-9 7zM14 3h3v14h-3z",
  reset: "M10 3a7 7 0 1 0 7 7h-2.4A4.6 4.6 0 1 1 10 5.4V9l5-4.5L10 0z",
  back: "M16 3l-9 7 9 7zM3 3h3v14H3z",
  before: "M16 4l-6 6 6 6zM9 4l-6 6 6 6z",
  after: "M4 4l6 6-6 6zM11 4l6 6-6 6z",
  loop: "M6 4h7a5 5 0 0 1 0 10H9v3l-5-4 5-4v3h4a3 3 0 0 0 0-6H6z",
  more: "M2 8h4v4H2zM8 8h4v4H8zM14 8h4v4h-4z",
  panels: "M2 3h9v14H2zM13 3h5v6h-5zM13 11h5v6h-5z",
  panel: "M2 3h16v14H2zM12 5v10h4V5z",
  theme: "M10 2a8 8 0 1 0 0 16zM10 2a8 8 0 0 1 0 16",
  help: "M10 1a9 9 0 1 0 0 18 9 9 0 0 0 0-18zm-1 12h2v2H9zm1-8c2 0 3.4 1.2 3.4 3 0 2.2-2.4 2.4-2.4 4H9c0-2.6 2.4-2.7 2.4-4 0-.7-.6-1.1-1.4-1.1S8.600 7.300 8.500 8.200L6.600 7.900C6.800 6.100 8.100 5 10 5z",
};
export function icon(name: keyof typeof kIcons): SVGSVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 20 20");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", kIcons[name]);
  svg.append(path);
  return svg;
}
export const iconButton = (
  name: keyof typeof kIcons,
  title: string,
  click: () => void,
  more = "",
) => h("button", { class: `icon ${more}`, title, "aria-label": title, click }, icon(name));
