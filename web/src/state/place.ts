// A place to return to (time, camera, robot, selected model, and what is open), as the fragment of
// a URL.

// The open parts of the page: the panel's page, the layers that are off, and the panes of plots.
export interface Open {
  page: string;
  off: string[];
  layout?: unknown; // of the panels
  panes: { xy: boolean; of: [channel: string, path: string][] }[];
}

export interface Place {
  time_s: number | null; // sim time of a live run, log time of a log
  camera: number[] | null; // position and target: x, y, z, x, y, z
  robot: string;
  selected: string;
  open: Open | null;
}

export function hashOf({ time_s, camera, robot, selected, open }: Place): string {
  const parts = new URLSearchParams();
  if (time_s !== null) parts.set("t", time_s.toFixed(6));
  if (camera) parts.set("camera", camera.map((value) => value.toFixed(3)).join(","));
  if (robot) parts.set("robot", robot);
  if (selected) parts.set("selected", selected);
  if (open) parts.set("open", JSON.stringify(open));
  return `#${parts.toString()}`;
}

// Missing or malformed parts are left out.
export function placeOf(hash: string): Place {
  const parts = new URLSearchParams(hash.replace(/^#/, "")),
    time = parts.get("t"),
    camera = parts.get("camera")?.split(",").map(Number) ?? [];
  const time_s =
    time !== null && time !== "" && Number.isFinite(Number(time)) ? Number(time) : null;
  return {
    time_s,
    camera: camera.length === 6 && camera.every(Number.isFinite) ? camera : null,
    robot: parts.get("robot") ?? "",
    selected: parts.get("selected") ?? "",
    open: openOf(parts.get("open")),
  };
}

function openOf(text: string | null): Open | null {
  try {
    const { page, off, panes, layout } = JSON.parse(text ?? "null") as Open;
    const good =
      typeof page === "string" &&
      off.every((layer) => typeof layer === "string") &&
      panes.every(
        ({ xy, of }) =>
          typeof xy === "boolean" && of.every((each) => each.length === 2 && each.every(isText)),
      );
    return good ? { page, off, panes, ...(layout ? { layout } : {}) } : null;
  } catch {
    return null;
  }
}
const isText = (value: unknown) => typeof value === "string";
