// The layers that can be drawn over the scene, and their colours.
export const kLayers = [
  "rays",
  "points",
  "sonar",
  "trail",
  "odometry",
  "contacts",
  "frames",
  "clouds",
  "labels",
  "shapes",
  "roof",
  "ghosts",
  "markers",
] as const;
export type Layer = (typeof kLayers)[number];

export const kLayerColours: Record<Layer, string> = {
  rays: "#ff6b5e",
  points: "#ffd24a",
  sonar: "#3fb6ff",
  trail: "#27c46b",
  odometry: "#ff9d2e",
  contacts: "#ff2d8a",
  frames: "linear-gradient(90deg,#e33,#3c3,#36f)",
  clouds: "linear-gradient(90deg,#f33,#3f3,#33f)",
  labels: "var(--text)",
  shapes: "#8fd14f",
  roof: "#a0764a",
  ghosts: "#b58cff",
  markers: "#f2f2f2",
};

// The robots' samples and positions.
export const kOfRobots: readonly Layer[] = [
  "rays",
  "points",
  "sonar",
  "trail",
  "odometry",
  "contacts",
  "frames",
  "clouds",
  "labels",
];

// Off until the user turns them on.
export const kOffAtFirst: readonly Layer[] = ["frames", "labels", "shapes", "roof"];
