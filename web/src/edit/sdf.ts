// SDF as text: of drawn things, and of models that get another name, another size, or a door. Only
// what must change is changed; the rest stays as it was written.

// ---- making

export type Size = [x: number, y: number, z: number];
interface Part {
  name: string;
  geometry: string;
  pose: string;
  colour: string;
}

const kWall = "0.82 0.8 0.75",
  kThing = "0.85 0.6 0.25";
const text = (value: number) => String(Number(value.toFixed(4)) || 0);
const list = (values: number[]) => values.map(text).join(" ");
const escaped = (name: string) =>
  name.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/"/g, "&quot;");

export const boxOf = (size: Size) => `<box><size>${list(size)}</size></box>`;
export const cylinderOf = (radius: number, length: number) =>
  `<cylinder><radius>${text(radius)}</radius><length>${text(length)}</length></cylinder>`;
export const sphereOf = (radius: number) => `<sphere><radius>${text(radius)}</radius></sphere>`;

// Models in a world file are indented by four spaces.
function model(name: string, inertial: string, parts: Part[]): string {
  const shown = parts
    .map(
      (part) => `
        <collision name="${part.name}">
          <pose>${part.pose}</pose>
          <geometry>${part.geometry}</geometry>
        </collision>
        <visual name="${part.name}">
          <pose>${part.pose}</pose>
          <geometry>${part.geometry}</geometry>
          <material><ambient>${part.colour} 1</ambient><diffuse>${part.colour} 1</diffuse></material>
        </visual>`,
    )
    .join("");
  return `<?xml version="1.0"?>
<sdf version="1.9">
    <model name="${escaped(name)}">${inertial === "" ? "\n      <static>true</static>" : ""}
      <pose>0 0 0 0 0 0</pose>
      <link name="link">${inertial}${shown}
      </link>
    </model>
</sdf>
`;
}

const inertia = (mass: number, moments: Size) => `
        <inertial>
          <mass>${text(mass)}</mass>
          <inertia><ixx>${moments[0].toPrecision(4)}</ixx><ixy>0</ixy><ixz>0</ixz><iyy>${moments[1].toPrecision(4)}</iyy><iyz>0</iyz><izz>${moments[2].toPrecision(4)}</izz></inertia>
        </inertial>`;

// Of solid things, kg/m^3. Whoever places one chooses its height.
const kDensity = 100;
export function boxModel(name: string, size: Size): string {
  const [x, y, z] = size,
    mass = kDensity * x * y * z,
    of = (a: number, b: number) => (mass / 12) * (a * a + b * b);
  return model(name, inertia(mass, [of(y, z), of(x, z), of(x, y)]), [
    { name: "box", geometry: boxOf(size), pose: "0 0 0 0 0 0", colour: kThing },
  ]);
}
export function cylinderModel(name: string, radius: number, length: number): string {
  const mass = kDensity * Math.PI * radius * radius * length,
    across = (mass / 12) * (3 * radius * radius + length * length);
  return model(name, inertia(mass, [across, across, (mass / 2) * radius * radius]), [
    { name: "cylinder", geometry: cylinderOf(radius, length), pose: "0 0 0 0 0 0", colour: kThing },
  ]);
}
export function sphereModel(name: string, radius: number): string {
  const mass = ((kDensity * 4) / 3) * Math.PI * radius ** 3,
    moment = 0.4 * mass * radius * radius;
  return model(name, inertia(mass, [moment, moment, moment]), [
    { name: "sphere", geometry: sphereOf(radius), pose: "0 0 0 0 0 0", colour: kThing },
  ]);
}

export interface WallStyle {
  height: number;
  thickness: number;
}
// Along x, centred at the model's origin, on the ground.
export function wallModel(name: string, length: number, { height, thickness }: WallStyle): string {
  return model(name, "", [
    {
      name: "wall",
      geometry: boxOf([length, thickness, height]),
      pose: `0 0 ${text(height / 2)} 0 0 0`,
      colour: kWall,
    },
  ]);
}
// Four walls around the origin, given the inner dimensions.
export function roomModel(
  name: string,
  width: number,
  depth: number,
  { height, thickness }: WallStyle,
): string {
  const z = text(height / 2),
    outer = width + 2 * thickness;
  const side = (name: string, x: number, y: number, size: Size): Part => ({
    name,
    geometry: boxOf(size),
    pose: `${text(x)} ${text(y)} ${z} 0 0 0`,
    colour: kWall,
  });
  return model(name, "", [
    side("south", 0, -(depth + thickness) / 2, [outer, thickness, height]),
    side("north", 0, (depth + thickness) / 2, [outer, thickness, height]),
    side("west", -(width + thickness) / 2, 0, [thickness, depth, height]),
    side("east", (width + thickness) / 2, 0, [thickness, depth, height]),
  ]);
}

// ---- changing

export interface Place {
  name: string;
  begin: number;
  end: number;
  inside: number;
  past: number;
  tag: string;
  children: Place[];
}

// The elements of a text with their positions. Throws if it is not XML.
export function places(xml: string): Place[] {
  const root: Place = {
      name: "",
      begin: 0,
      end: xml.length,
      inside: 0,
      past: xml.length,
      tag: "",
      children: [],
    },
    open = [root];
  const tags =
    /<!--[^]*?-->|<!\[CDATA\[[^]*?\]\]>|<\?[^]*?\?>|<![^>]*>|<(\/?)([^\s/>]+)((?:[^>"']|"[^"]*"|'[^']*')*?)(\/?)>/g;
  for (let found = tags.exec(xml); found; found = tags.exec(xml)) {
    const [tag, closing, name, , empty] = found;
    if (!name) continue;
    const end = found.index + tag.length;
    if (closing) {
      const element = open.pop()!;
      if (element.name !== name || open.length === 0) throw new Error("the text is not XML");
      Object.assign(element, { past: found.index, end });
      continue;
    }
    const element: Place = {
      name,
      begin: found.index,
      end,
      inside: end,
      past: end,
      tag,
      children: [],
    };
    open.at(-1)!.children.push(element);
    if (!empty) open.push(element);
  }
  if (open.length !== 1) throw new Error("the text is not XML");
  return root.children;
}

export type Change = [begin: number, end: number, text: string];
export function changed(xml: string, changes: Change[]): string {
  let result = "",
    at = 0;
  for (const [begin, end, text] of changes.sort((a, b) => a[0] - b[0])) {
    result += xml.slice(at, begin) + text;
    at = end;
  }
  return result + xml.slice(at);
}

export const child = (place: Place | undefined, name: string) =>
  place?.children.find((each) => each.name === name);
export const inner = (xml: string, place: Place) => xml.slice(place.inside, place.past).trim();
export const numbers = (xml: string, place: Place | undefined) =>
  place ? inner(xml, place).split(/\s+/).map(Number) : [];

export function topModel(xml: string): Place {
  const root = places(xml).find(({ name }) => name === "sdf");
  const found = child(root, "model");
  if (!found) throw new Error("it comes from a file of its own: change that, or place a box");
  return found;
}

export function each(place: Place, name: string, found: (place: Place) => void): void {
  for (const inside of place.children) {
    if (inside.name === name) found(inside);
    each(inside, name, found);
  }
}

// Scales a model along each of its axes: shapes and their positions; masses scale with the volume.
// Throws, with the reason, if it cannot be scaled.
export function scaled(xml: string, factor: Size): string {
  const top = topModel(xml),
    changes: Change[] = [],
    links = top.children.filter(({ name }) => name === "link");
  if (!factor.every((f) => Number.isFinite(f) && f > 0)) throw new Error("a factor is above 0");
  if (child(top, "joint") || links.length !== 1)
    throw new Error("it has joints or several links: those are not scaled");
  const [fx, fy, fz] = factor,
    isSame = Math.abs(fx - fy) < 1e-9 && Math.abs(fx - fz) < 1e-9;
  scaleShapes(xml, top, factor, isSame, changes);
  each(links[0]!, "pose", (pose) => {
    const values = numbers(xml, pose);
    if (!isSame && values.slice(3).some((angle) => Math.abs(angle) > 1e-9))
      throw new Error("parts of it are turned: only one factor in all directions fits");
    const to = values.map((v, i) => (i < 3 ? v * factor[i]! : v));
    changes.push([pose.inside, pose.past, list(to)]);
  });
  each(links[0]!, "mass", (mass) => multiply(xml, mass, [fx * fy * fz], changes));
  each(links[0]!, "inertia", (moments) => scaleMoments(xml, moments, factor, changes));
  return changed(xml, changes);
}

// Numbers, each multiplied by its factor.
export function multiply(
  xml: string,
  place: Place | undefined,
  factors: number[],
  changes: Change[],
): void {
  if (!place) return;
  const values = numbers(xml, place).map((v, i) => v * (factors[i] ?? factors[0]!));
  changes.push([place.inside, place.past, list(values)]);
}

function scaleShapes(
  xml: string,
  top: Place,
  factor: Size,
  isSame: boolean,
  changes: Change[],
): void {
  const [fx, fy, fz] = factor;
  each(top, "box", (box) => multiply(xml, child(box, "size"), factor, changes));
  each(top, "cylinder", (shape) => {
    if (Math.abs(fx - fy) > 1e-9)
      throw new Error("a cylinder keeps its circle: x and y by the same factor");
    multiply(xml, child(shape, "radius"), [fx], changes);
    multiply(xml, child(shape, "length"), [fz], changes);
  });
  for (const shape of ["sphere", "capsule", "cone"]) {
    each(top, shape, (found) => {
      if (!isSame) throw new Error(`a ${shape} is scaled by one factor in all directions`);
      for (const part of ["radius", "length"]) multiply(xml, child(found, part), [fx], changes);
    });
  }
  each(top, "mesh", (mesh) => {
    const scale = child(mesh, "scale");
    if (scale) multiply(xml, scale, factor, changes);
    else changes.push([mesh.past, mesh.past, `<scale>${list(factor)}</scale>`]);
  });
}

// Moments of inertia from second moments, each of which scales with the square of its axis.
function scaleMoments(xml: string, place: Place, [fx, fy, fz]: Size, changes: Change[]): void {
  const value = (name: string) => {
    const found = child(place, name);
    return found ? Number(inner(xml, found)) : 0;
  };
  const [ixx, iyy, izz] = [value("ixx"), value("iyy"), value("izz")],
    volume = fx * fy * fz;
  const xx = ((iyy + izz - ixx) / 2) * fx * fx,
    yy = ((ixx + izz - iyy) / 2) * fy * fy,
    zz = ((ixx + iyy - izz) / 2) * fz * fz;
  const scaled: Record<string, number> = {
    ixx: yy + zz,
    iyy: xx + zz,
    izz: xx + yy,
    ixy: value("ixy") * fx * fy,
    ixz: value("ixz") * fx * fz,
    iyz: value("iyz") * fy * fz,
  };
  for (const found of place.children) {
    if (found.name in scaled)
      changes.push([
        found.inside,
        found.past,
        String(Number((scaled[found.name]! * volume).toPrecision(6))),
      ]);
  }
}

export interface Door {
  width: number;
  height: number;
}

// Makes a door in the wall that contains a point of the model, and leaves a piece to the left,
// one to the right and one above. Throws, with the reason, if there is no wall.
export function withDoor(xml: string, [px, py]: [x: number, y: number], door: Door): string {
  const top = topModel(xml),
    changes: Change[] = [],
    kTouch_m = 0.05;
  let cut = 0;
  for (const link of top.children.filter(({ name }) => name === "link")) {
    const base = numbers(xml, child(link, "pose")),
      [lx = 0, ly = 0] = base;
    if (base.slice(3).some((angle) => Math.abs(angle) > 1e-9)) continue;
    for (const part of link.children.filter(
      ({ name }) => name === "collision" || name === "visual",
    )) {
      const box = child(child(part, "geometry"), "box"),
        size = box && child(box, "size"),
        pose = child(part, "pose");
      if (!size) continue;
      const [sx, sy, sz] = numbers(xml, size) as Size,
        [x = 0, y = 0, z = 0, , , yaw = 0] = numbers(xml, pose),
        along = sx >= sy ? 0 : 1;
      const c = Math.cos(yaw),
        s = Math.sin(yaw),
        dx = px - lx - x,
        dy = py - ly - y,
        local = [c * dx + s * dy, -s * dx + c * dy];
      const half = [sx / 2, sy / 2];
      if (local.some((v, i) => Math.abs(v) > half[i]! + kTouch_m)) continue;
      const length = along === 0 ? sx : sy,
        middle = local[along]!,
        from = middle - door.width / 2,
        to = middle + door.width / 2;
      if (from < -length / 2 + 0.02 || to > length / 2 - 0.02)
        throw new Error(`there is no room for a door of ${text(door.width)} m here`);
      if (door.height > sz + 1e-9)
        throw new Error(`the wall is ${text(sz)} m high, the door ${text(door.height)} m`);
      changes.push([
        part.begin,
        part.end,
        pieces(
          xml,
          part,
          { size: [sx, sy, sz], at: [x, y, z], yaw, along, length, from, to },
          door,
        ),
      ]);
      ++cut;
    }
  }
  if (cut === 0) throw new Error("there is no wall of boxes here");
  return changed(xml, changes);
}

interface Cut {
  size: Size;
  at: number[];
  yaw: number;
  along: number;
  length: number;
  from: number;
  to: number;
}

function pieces(
  xml: string,
  part: Place,
  { size, at, yaw, along, length, from, to }: Cut,
  door: Door,
): string {
  const own = xml.slice(part.begin, part.end),
    line = xml.lastIndexOf("\n", part.begin),
    gap =
      line >= 0 && /^\s*$/.test(xml.slice(line, part.begin))
        ? xml.slice(line, part.begin)
        : "\n        ";
  const kinds: [suffix: string, begin: number, end: number, low: number, high: number][] = [
    ["left", -length / 2, from, 0, size[2]],
    ["right", to, length / 2, 0, size[2]],
  ];
  if (door.height < size[2] - 1e-6) kinds.push(["above", from, to, door.height, size[2]]);
  return kinds
    .map(([suffix, begin, end, low, high]) => {
      const shift = (begin + end) / 2,
        extent = [...size] as Size,
        place = [...at];
      extent[along] = end - begin;
      extent[2] = high - low;
      const dx = along === 0 ? shift : 0,
        dy = along === 1 ? shift : 0;
      place[0]! += Math.cos(yaw) * dx - Math.sin(yaw) * dy;
      place[1]! += Math.sin(yaw) * dx + Math.cos(yaw) * dy;
      place[2]! += (low + high - size[2]) / 2;
      return rewritten(own, suffix, [...place.slice(0, 3), 0, 0, yaw], extent);
    })
    .join(gap);
}

// A collision or visual with that name, position and size.
function rewritten(own: string, suffix: string, pose: number[], size: Size): string {
  const [element] = places(own),
    changes: Change[] = [],
    name = /\sname\s*=\s*(["'])(.*?)\1/.exec(element!.tag)!;
  const at = element!.begin + name.index + name[0].length - 1;
  changes.push([at, at, `_${suffix}`]);
  const old = child(element, "pose"),
    written = `<pose>${list(pose)}</pose>`;
  changes.push(old ? [old.begin, old.end, written] : [element!.inside, element!.inside, written]);
  const extent = child(child(child(element, "geometry"), "box"), "size")!;
  changes.push([extent.inside, extent.past, list(size)]);
  return changed(own, changes);
}
