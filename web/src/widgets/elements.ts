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

// Without a sign where it is shown as zero.
export const decimals = (value: number, digits: number) =>
  value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1");

// Sets a text only if it differs: most values do not change.
export function say(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

// After a click on a button its focus is given back, so that space does not press it again;
// keyboard users keep it.
export function giveFocusBack(place: HTMLElement): void {
  place.addEventListener("click", (event) => {
    if (event.detail > 0) (event.target as Element).closest("button")?.blur();
  });
}

const kToast_ms = 6000;
type Kind = "info" | "error";
const hearers: ((text: string, kind: Kind) => void)[] = [];
// Calls with each toast.
export function onToast(call: (text: string, kind: Kind) => void): void {
  hearers.push(call);
}

export function toast(text: string, kind: Kind = "info"): void {
  const place = document.getElementById("toasts")!;
  for (const old of place.children) if (old.textContent === text) return;
  const note = h("div", { class: `toast ${kind}`, role: "status" }, text);
  place.append(note);
  for (const call of hearers) call(text, kind);
  setTimeout(() => note.remove(), kToast_ms);
}

// An element of index.html.
export const byId = (id: string) => document.getElementById(id)!;
