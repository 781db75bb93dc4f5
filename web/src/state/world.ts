// The run's world, assembled from the parts of ruedo/info.
import type {
  body_info_t,
  channel_info_t,
  device_info_t,
  robot_info_t,
  world_info_t,
} from "../../generated/messages";

export interface World {
  runId: bigint;
  epoch: number;
  utime: bigint;
  name: string;
  version: string;
  seed: bigint;
  step_us: number;
  features: bigint;
  paused: boolean;
  robots: robot_info_t[];
  devices: device_info_t[];
  channels: channel_info_t[];
  bodies: body_info_t[];
}

export class InfoAssembler {
  private parts: world_info_t[] = [];

  // The world if this was its last missing part.
  add(part: world_info_t): World | undefined {
    const first = this.parts[0];
    if (
      part.part === 0 ||
      !first ||
      first.run_id !== part.run_id ||
      first.epoch !== part.epoch ||
      first.utime !== part.utime
    )
      this.parts = [];
    if (part.part !== this.parts.length) return undefined;
    this.parts.push(part);
    if (this.parts.length < part.nparts) return undefined;
    const parts = this.parts;
    this.parts = [];
    return {
      runId: part.run_id,
      epoch: part.epoch,
      utime: part.utime,
      name: part.world,
      version: part.version,
      seed: part.seed,
      step_us: Number(part.step_us),
      features: part.features,
      paused: part.paused,
      robots: parts.flatMap((p) => p.robots),
      devices: parts.flatMap((p) => p.devices),
      channels: parts.flatMap((p) => p.channels),
      bodies: parts.flatMap((p) => p.bodies),
    };
  }
}

export const channelOfType = (world: World, type: string, robot = "") =>
  world.channels.find((c) => c.type === type && c.robot === robot)?.name;
export const inputOf = (world: World, robot: string, type: string) =>
  world.channels.find((c) => c.robot === robot && c.input && c.type === type)?.name;
export const sees = (world: World, kind: number) => (world.features >> BigInt(kind)) & 1n;
