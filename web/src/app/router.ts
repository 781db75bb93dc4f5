// Passes messages to the views that show them. ruedo/info has the type of each channel.
import type { device_info_t, Messages } from "../../generated/messages";
import { isCompared } from "../state/comparison";
import type { Loading } from "../state/loading";
import { intensitiesOf, pointsOfDepth, pointsOfLidar } from "../scene/clouds";
import { pictureSource } from "../state/labels";
import { isDepth } from "../state/wanted";
import { channelOfType, type World } from "../state/world";
import type { Clock } from "../state/clock";
import type { Page } from "../state/page";
import type { Poses } from "../state/poses";
import type { Ghosts } from "../scene/ghosts";
import type { Markers } from "../scene/markers";
import type { RobotOverlay } from "../scene/overlays";
import type { OverlaySet } from "../scene/overlay_set";
import type { Stage } from "../scene/stage";
import type { ChannelList } from "../ui/channels";
import type { FieldPlots } from "../ui/field_plots";
import type { RobotPages } from "../ui/robot";
import type { Source } from "../widgets/picture";
import { decode, fingerprint, typeOf, type TypeName } from "../wire/lcm";
import type { Session } from "../wire/session";

interface Route {
  type: TypeName;
  robot: string; // "" for none
  index: number; // of the robot in the world
  device: device_info_t | undefined;
}

// The channels whose types page and server define alike.
export function routesOf(world: World): Map<string, Route> {
  const routes = new Map<string, Route>();
  const places = new Map(world.robots.map((robot, index) => [robot.name, index]));
  const devices = new Map(
    world.devices.map((device) => [`${device.robot}/${device.name}`, device]),
  );
  for (const { name, type, robot, device, fingerprint: hash } of world.channels) {
    if (fingerprint(type) !== hash) continue;
    routes.set(name, {
      type: type as TypeName,
      robot,
      index: places.get(robot) ?? -1,
      device: devices.get(`${robot}/${device}`),
    });
  }
  return routes;
}

// The views for pictures of single channels.
type Cameras = readonly {
  message(channel: string, image: Messages["image_t"], source: Source): void;
}[];

const seconds = ({ utime }: { utime: bigint }) => Number(utime) * 1e-6;

// The source of a robot's message, and the views that show it.
interface Shown {
  channel: string;
  device: device_info_t | undefined;
  index: number; // of the robot
  overlay: RobotOverlay | undefined;
  pages: RobotPages | undefined; // for the chosen robot only
  stage: Stage;
  cameras: Cameras;
  source: Source; // of pictures
}
// Messages are decoded only if a view shows them.
type Show<Type extends TypeName> = (to: Shown, read: () => Messages[Type]) => void;

// How each type of a robot's messages is shown; other types are listed on the page Robot, member by
// member.
const kShow: { [Type in TypeName]?: Show<Type> } = {
  planar_lidar_t({ device, overlay, pages }, read) {
    if (!device) return;
    const scan = read();
    overlay?.scan(device, scan);
    pages?.scan(device, scan);
  },
  sonar_t({ device, overlay, pages }, read) {
    if (!device) return;
    const ranges = read();
    overlay?.sonar(device, ranges);
    pages?.sonar(device, ranges);
  },
  // The robot's own pose; that of a device is one of its readings.
  pose_t({ device, overlay, pages }, read) {
    const pose = read();
    if (device && device.kind !== "pose") return pages?.other(device, pose);
    overlay?.pose(pose);
    pages?.pose(pose);
  },
  odometry_t({ index, overlay, pages, stage }, read) {
    const odometry = read();
    overlay?.odometer(odometry);
    pages?.odometry(odometry);
    stage.bodies.turnWheels(index, odometry.angle);
  },
  contact_t({ device, overlay, pages }, read) {
    const contact = read();
    overlay?.contact(contact);
    if (device) pages?.contact(device, contact);
  },
  collisions_t: ({ pages }, read) => pages?.collisions(read()),
  motion_status_t: ({ pages }, read) => pages?.motion(read()),
  imu_t({ device, pages }, read) {
    if (device) pages?.imu(device, read());
  },
  image_t({ channel, device, overlay, pages, cameras, source }, read) {
    const image = read();
    const points =
      device && isDepth(channel, "image_t") ? pointsOfDepth(image, device.fov_horizontal) : null;
    if (points) overlay?.cloud(device!, seconds(image), points, null);
    for (const each of cameras) each.message(channel, image, source);
    pages?.camera(channel.slice(channel.indexOf("/") + 1), image, source);
  },
  lidar_t({ device, overlay }, read) {
    if (!device) return;
    const scan = read();
    overlay?.cloud(device, seconds(scan), pointsOfLidar(scan), intensitiesOf(scan));
  },
  joint_state_t: ({ pages }, read) => pages?.joints(read()),
};

export interface Views {
  loading: Pick<Loading<unknown>, "onInfo">;
  session: Session;
  poses: Poses;
  clock: Clock;
  stage: Stage;
  overlays: OverlaySet;
  markers: Markers;
  ghosts: Ghosts;
  pages: RobotPages;
  channels: ChannelList;
  plots: Pick<FieldPlots, "message">;
  cameras: Cameras;
}

export class Router {
  private routes = new Map<string, Route>();
  private told = ""; // the type of message that sets the clock

  constructor(
    private readonly page: Page,
    private readonly views: Views,
  ) {
    page.watch(["world"], ({ world }) => {
      this.routes = world ? routesOf(world) : new Map<string, Route>();
      this.told = world && channelOfType(world, "world_state_t") ? "world_state_t" : "tick_t";
    });
  }

  onMessage(channel: string, bytes: Uint8Array): void {
    this.views.channels.message(channel, bytes);
    if (this.page.now.hello?.mode === "log") this.views.plots.message(channel, bytes);
    if (isCompared(channel)) return this.ofOther(bytes);
    const route = this.routes.get(channel),
      type = route?.type ?? typeOf(bytes);
    if (!type) return;
    try {
      this.dispatch(type, route, channel, bytes);
    } catch (error) {
      console.warn(`${channel}: ${(error as Error).message}`);
    }
  }

  // The bodies of the other run.
  private ofOther(bytes: Uint8Array): void {
    if (typeOf(bytes) === "world_state_t" && this.page.now.complete)
      this.views.ghosts.poses.add(decode("world_state_t", bytes), performance.now());
  }

  private dispatch(
    type: TypeName,
    route: Route | undefined,
    channel: string,
    bytes: Uint8Array,
  ): void {
    const read = <T extends TypeName>(name: T): Messages[T] => decode(name, bytes);
    const { loading, session, poses, clock } = this.views;
    if (type === "world_info_t") return loading.onInfo(read(type));
    if (type === "reply_t") return session.onReply(bytes);
    if (!this.page.now.complete) return;
    if (type === "world_state_t") {
      const state = read(type);
      poses.add(state, performance.now());
      return clock.tell(Number(state.utime) * 1e-6, state.epoch, true);
    }
    if (type === "markers_t") return this.views.markers.take(read(type));
    if (type === "tick_t") {
      const tick = read(type);
      return clock.tell(Number(tick.utime) * 1e-6, tick.epoch, this.told === type);
    }
    if (route?.robot) this.ofRobot(type, route, channel, bytes);
  }

  private ofRobot<Type extends TypeName>(
    type: Type,
    { robot, index, device }: Route,
    channel: string,
    bytes: Uint8Array,
  ): void {
    const shown: Shown = {
      channel,
      device,
      index,
      overlay: this.views.overlays.of.get(robot),
      pages: index === this.page.now.robot ? this.views.pages : undefined,
      stage: this.views.stage,
      cameras: this.views.cameras,
      source: pictureSource(this.page.now, device),
    };
    const read = () => decode(type, bytes);
    const show: Show<Type> | undefined = kShow[type];
    if (show) show(shown, read);
    else if (device) shown.pages?.other(device, read());
  }
}
