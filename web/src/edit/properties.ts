// A model's properties in its text: whether it is fixed, its colour, mass and size.
import {
  changed,
  child,
  each,
  inner,
  multiply,
  numbers,
  topModel,
  type Change,
  type Place,
  type Size,
} from "./sdf";

export interface Properties {
  isStatic: boolean;
  mass: number | null; // kg, of all links; null: the file gives none
  colour: string | null; // "#rrggbb" of the first visible shape; null: the file gives none
  // of all its geometries, and its size in m; null if they differ, or are of another kind
  shape: "box" | "cylinder" | "sphere" | null;
  size: Size | null;
}

const all = (top: Place, name: string): Place[] => {
  const found: Place[] = [];
  each(top, name, (place) => found.push(place));
  return found;
};
const sumOf = (values: number[]) => values.reduce((sum, value) => sum + value, 0);

// Throws, with the reason, for what comes from another file.
export function propertiesOf(xml: string): Properties {
  const top = topModel(xml),
    masses = all(top, "mass").map((mass) => numbers(xml, mass)[0]!),
    material = all(top, "material").map(
      (place) => child(place, "diffuse") ?? child(place, "ambient"),
    ),
    fixed = child(top, "static");
  return {
    isStatic: fixed !== undefined && /^(1|true)$/.test(inner(xml, fixed)),
    mass: masses.length > 0 ? sumOf(masses) : null,
    colour: material[0] ? hexOf(numbers(xml, material[0])) : null,
    ...shapeOf(xml, top),
  };
}

type Shape = Pick<Properties, "shape" | "size">;

// The one that all of a model's geometries have; null if they differ, or are of another kind.
function shapeOf(xml: string, top: Place): Shape {
  const none: Shape = { shape: null, size: null };
  const shapes = all(top, "geometry").map((geometry): Shape => {
    const value = (shape: string, part: string) => {
      const place = child(child(geometry, shape), part);
      return place ? numbers(xml, place) : [];
    };
    const [radius] = value("cylinder", "radius"),
      [length] = value("cylinder", "length"),
      [ball] = value("sphere", "radius"),
      box = value("box", "size");
    if (box.length === 3) return { shape: "box", size: box as Size };
    if (radius && length) return { shape: "cylinder", size: [2 * radius, 2 * radius, length] };
    return ball ? { shape: "sphere", size: [2 * ball, 2 * ball, 2 * ball] } : none;
  });
  const [first] = shapes,
    isOne = shapes.every(
      ({ shape, size }) => shape === first!.shape && size?.join() === first!.size?.join(),
    );
  return first && isOne ? first : none;
}

export function withStatic(xml: string, on: boolean): string {
  const top = topModel(xml),
    fixed = child(top, "static");
  if (!on && all(top, "inertial").length === 0 && all(top, "plane").length > 0)
    throw new Error("a plane without end does not move");
  if (fixed) return changed(xml, [[fixed.inside, fixed.past, String(on)]]);
  return changed(xml, [[top.inside, top.inside, `\n      <static>${on}</static>`]]);
}

// ---- any element

const kEntities: Record<string, string> = {
  "&lt;": "<",
  "&gt;": ">",
  "&quot;": '"',
  "&apos;": "'",
  "&amp;": "&",
};

// The text of an element without others inside; null if it has none that can be changed.
export function textIn(xml: string, { tag, inside, past }: Place): string | null {
  const raw = xml.slice(inside, past);
  if (tag.endsWith("/>") || raw.includes("<")) return null; // empty, or with a comment
  return raw.trim().replace(/&(lt|gt|quot|apos|amp);/g, (entity) => kEntities[entity]!);
}

// "" if the tag has none of that name.
export const attributeOf = (tag: string, name: string) =>
  new RegExp(`\\s${name}\\s*=\\s*(["'])(.*?)\\1`).exec(tag)?.[2] ?? "";

// How many numbers a text is a list of; 0: it is something else.
function numbersIn(text: string): number {
  const parts = text.trim().split(/\s+/);
  return parts.every((part) => part !== "" && Number.isFinite(Number(part))) ? parts.length : 0;
}

// A list of numbers keeps its length. path: the indices among the children, from the model on.
// Throws, with the reason.
export function withText(xml: string, path: readonly number[], text: string): string {
  const place = path.reduce((at, i) => at.children[i]!, topModel(xml));
  const before = textIn(xml, place);
  if (before === null) throw new Error(`<${place.name}> has no text`);
  const count = numbersIn(before);
  if (count > 0 && numbersIn(text) !== count)
    throw new Error(`<${place.name}> takes ${count === 1 ? "a number" : `${count} numbers`}`);
  const written = text.trim().replace(/&/g, "&amp;").replace(/</g, "&lt;");
  return changed(xml, [[place.inside, place.past, written]]);
}

// Of several links each keeps its share. Moments of inertia go with the mass.
export function withMass(xml: string, mass: number): string {
  const top = topModel(xml),
    masses = all(top, "mass"),
    total = sumOf(masses.map((place) => numbers(xml, place)[0]!)),
    changes: Change[] = [];
  if (!(mass > 0)) throw new Error("a mass is above 0");
  if (!(total > 0)) throw new Error("the file gives it no mass");
  for (const place of masses) multiply(xml, place, [mass / total], changes);
  for (const moments of all(top, "inertia"))
    for (const place of moments.children) {
      const value = numbers(xml, place)[0]! * (mass / total);
      changes.push([place.inside, place.past, String(Number(value.toPrecision(6)))]);
    }
  return changed(xml, changes);
}

// Of all its visible shapes; how transparent they are stays.
export function withColour(xml: string, hex: string): string {
  const top = topModel(xml),
    rgb = [1, 3, 5].map((at) => Number((parseInt(hex.slice(at, at + 2), 16) / 255).toFixed(3))),
    changes: Change[] = [];
  for (const visual of all(top, "visual")) {
    const material = child(visual, "material"),
      parts = ["ambient", "diffuse"],
      missing = parts.filter((part) => !child(material, part));
    for (const place of parts.map((part) => child(material, part))) {
      if (!place) continue;
      const alpha = numbers(xml, place)[3] ?? 1;
      changes.push([place.inside, place.past, [...rgb, alpha].join(" ")]);
    }
    const added = missing.map((part) => `<${part}>${rgb.join(" ")} 1</${part}>`).join("");
    if (added && material) changes.push([material.inside, material.inside, added]);
    else if (added) changes.push([visual.past, visual.past, `<material>${added}</material>`]);
  }
  if (changes.length === 0) throw new Error("it has no visible shapes");
  return changed(xml, changes);
}

function hexOf(rgb: number[]): string | null {
  if (rgb.length < 3 || !rgb.slice(0, 3).every(Number.isFinite)) return null;
  const byte = (value: number) =>
    Math.round(255 * Math.max(0, Math.min(1, value)))
      .toString(16)
      .padStart(2, "0");
  return `#${rgb.slice(0, 3).map(byte).join("")}`;
}
