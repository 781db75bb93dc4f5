// Small helpers that make elements.
type Child = Node | string | null | undefined | false;
type Attributes = Record<string, string | number | boolean | ((event: Event) => void) | undefined>;

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== undefined) element.setAttribute(name, String(value));
  }
  element.append(
    ...children.filter(
      (child): child is Node | string => child !== null && child !== undefined && child !== false,
    ),
  );
  return element;
}

// Sets a text only if it differs: most values do not change.
export function say(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

const kToast_ms = 6000;
export function toast(text: string, kind: "info" | "error" = "info"): void {
  const place = document.getElementById("toasts")!;
  for (const old of place.children) if (old.textContent === text) return;
  const note = h("div", { class: `toast ${kind}`, role: "status" }, text);
  place.append(note);
  setTimeout(() => note.remove(), kToast_ms);
}

// An element of index.html.
export const byId = (id: string) => document.getElementById(id)!;
