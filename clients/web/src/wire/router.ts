// Messages to those who show them. Which type a channel has is told by ruedo/info.
import type { device_info_t, Messages } from "../../generated/messages";
import { isCompared } from "../state/comparison";
import type { Loading } from "../state/loading";
import { pointsOfDepth, pointsOfLidar } from "../scene/clouds";
import { isDepth } from "../state/wanted";
import { channelOfType, type World } from "../state/world";
import type { Clock } from "../state/clock";
import type { Page } from "../state/page";
import type { Poses } from "../state/poses";
import type { Ghosts } from "../scene/ghosts";
import type { Markers } from "../scene/markers";
import type { OverlaySet } from "../scene/overlay_set";
import type { Stage } from "../scene/stage";
import type { ChannelList } from "../ui/channels";
import type { Inset } from "../ui/inset";
import type { RobotPages } from "../ui/robot";
import { decode, fingerprint, typeOf, type TypeName } from "./lcm";
import type { Session } from "./session";

interface Route {
  type: TypeName;
  robot: string;
  device: device_info_t | undefined;
}

// The channels whose types this page knows as the server does.
export function routesOf(world: World): Map<string, Route> {
  const routes = new Map<string, Route>();
  for (const { name, type, robot, device, fingerprint: hash } of world.channels) {
    if (fingerprint(type) !== hash) continue;
    routes.set(name, {
      type: type as TypeName,
      robot,
      device: world.devices.find((d) => d.robot === robot && d.name === device),
    });
  }
  return routes;
}

export interface Views {
  loading: Loading<unknown>;
  session: Session;
  poses: Poses;
  clock: Clock;
  stage: Stage;
  overlays: OverlaySet;
  markers: Markers;
  ghosts: Ghosts;
  pages: RobotPages;
  channels: ChannelList;
  inset: Inset;
}

export class Router {
  private routes = new Map<string, Route>();
  private told = ""; // the type that tells the time

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

  // Where the other run's bodies are.
  private ofOther(bytes: Uint8Array): void {
    if (typeOf(bytes) === "world_state_t" && this.views.loading.complete)
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
    if (!loading.complete) return;
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
    if (route?.robot) this.ofRobot(route, channel, read);
  }

  private ofRobot(
    { type, robot, device }: Route,
    channel: string,
    read: <T extends TypeName>(name: T) => Messages[T],
  ): void {
    const { world, robot: chosen } = this.page.now;
    const overlay = this.views.overlays.of.get(robot);
    const pages = world?.robots[chosen]?.name === robot ? this.views.pages : null;
    switch (type) {
      case "planar_lidar_t": {
        const m = read(type);
        if (device) {
          overlay?.scan(device, m);
          pages?.scan(device, m);
        }
        return;
      }
      case "sonar_t": {
        const m = read(type);
        if (device) {
          overlay?.sonar(device, m);
          pages?.sonar(device, m);
        }
        return;
      }
      case "pose_t": {
        const m = read(type);
        if (device && device.kind !== "pose") return pages?.other(device, m);
        overlay?.pose(m);
        pages?.pose(m);
        return;
      }
      case "odometry_t": {
        const m = read(type);
        overlay?.odometer(m);
        pages?.odometry(m);
        this.views.stage.wheelAngles.set(
          world!.robots.findIndex(({ name }) => name === robot),
          m.angle,
        );
        return;
      }
      case "contact_t": {
        const m = read(type);
        overlay?.contact(m);
        if (device) pages?.contact(device, m);
        return;
      }
      case "collisions_t":
        pages?.collisions(read(type));
        return;
      case "motion_status_t":
        pages?.motion(read(type));
        return;
      case "imu_t":
        if (device) pages?.imu(device, read(type));
        return;
      case "image_t": {
        const m = read(type);
        if (device && isDepth(channel, type)) {
          const points = pointsOfDepth(m, device.fov_horizontal);
          if (points) overlay?.cloud(device, points);
        }
        this.views.inset.message(channel, m);
        pages?.camera(channel.slice(channel.indexOf("/") + 1), m);
        return;
      }
      case "lidar_t":
        if (device) overlay?.cloud(device, pointsOfLidar(read(type)));
        return;
      case "joint_state_t":
        pages?.joints(read(type));
        return;
      default:
        if (device) pages?.other(device, read(type));
    }
  }
}
