// A place to return to (time, camera, robot and selected model), as the fragment of a URL.
export interface Place {
  time_s: number | null; // sim time of a live run, log time of a log
  camera: number[] | null; // position and target: x, y, z, x, y, z
  robot: string;
  selected: string;
}

export function hashOf({ time_s, camera, robot, selected }: Place): string {
  const parts = new URLSearchParams();
  if (time_s !== null) parts.set("t", time_s.toFixed(6));
  if (camera) parts.set("camera", camera.map((value) => value.toFixed(3)).join(","));
  if (robot) parts.set("robot", robot);
  if (selected) parts.set("selected", selected);
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
  };
}
