// Which channels the page needs; it subscribes to no others.
import type { Layer } from "./layers";
import { kStates } from "./comparison";
import { inputOf } from "./world";
import type { RunLink } from "../wire/protocol";
import { shownRobots, type Page, type PageState, type Tab } from "./page";

const kMarkers = "ruedo/markers"; // in a log
const kOfPage = ["world_state_t", "tick_t", "reply_t"];
const kOfTab: Record<Exclude<Tab, "Robot">, string[]> = {
  Plots: ["pose_t", "odometry_t"],
  Channels: [],
  World: [],
  Notes: [],
};
const kNotOnRobotPage = ["lidar_t", "camera_info_t"]; // the page Robot shows all others
const kOfLayer: Partial<Record<Layer, string>> = {
  rays: "planar_lidar_t",
  points: "planar_lidar_t",
  sonar: "sonar_t",
  trail: "pose_t",
  contacts: "contact_t",
  clouds: "lidar_t",
};

export const isDepth = (channel: string, type: string) =>
  type === "image_t" && channel.endsWith("/depth");
const onTab = (tab: Tab, type: string) =>
  tab === "Robot" ? !kNotOnRobotPage.includes(type) : kOfTab[tab].includes(type);

// opened: channels that views need in addition.
export function wantedChannels(state: Readonly<PageState>, opened: Iterable<string>): Set<string> {
  const { hello, world, complete, robot, layers, shown: pages } = state;
  const wanted = new Set<string>();
  if (!hello) return wanted;
  wanted.add(hello.info);
  if (!world) {
    wanted.add("ruedo/reply"); // to the first requests
    return wanted;
  }
  const shown = new Set(shownRobots(state)),
    chosen = world.robots[robot]?.name;
  const drawn = new Set<string | undefined>([
    "odometry_t",
    ...[...layers].map((layer) => kOfLayer[layer]),
  ]); // wheels are turned by odometry
  const depths = layers.has("clouds");
  for (const { name, type, robot: of, input } of world.channels) {
    if (input) continue;
    if (!of) {
      if (type === "reply_t" || (complete && kOfPage.includes(type))) wanted.add(name);
    } else if (
      complete &&
      ((shown.has(of) && (drawn.has(type) || (depths && isDepth(name, type)))) ||
        (of === chosen && [...pages].some((tab) => onTab(tab, type))))
    ) {
      wanted.add(name);
    }
  }
  if (complete && hello.compared && layers.has("ghosts")) wanted.add(kStates);
  if (complete) wanted.add(inputOf(world, "", "markers_t") ?? kMarkers);
  for (const name of opened) wanted.add(name);
  return wanted;
}

// Tells the link what is needed whenever that may have changed.
export class Wanted {
  private readonly sources: (() => Iterable<string>)[] = [];

  constructor(
    private readonly page: Page,
    private readonly link: Pick<RunLink, "want" | "watchTraffic">,
  ) {}

  // Registers a source of additional channels; it calls update() when they change.
  add(channels: () => Iterable<string>): void {
    this.sources.push(channels);
  }

  // Starts watching, once all views exist.
  watch(): void {
    this.page.watch(["hello", "world", "scene", "complete", "robot", "layers", "shown"], () =>
      this.update(),
    );
  }

  update(): void {
    this.link.want(
      wantedChannels(
        this.page.now,
        this.sources.flatMap((channels) => [...channels()]),
      ),
    );
    this.link.watchTraffic(this.page.now.shown.has("Channels"));
  }
}
