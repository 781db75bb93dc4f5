// States as a run tells them, for tests.
import type { world_state_t } from "../generated/messages";

// Of one body, which stands upright.
export const stateOf = (body: number, position: [x: number, y: number, z: number]) =>
  ({
    utime: 0n,
    epoch: 0,
    part: 0,
    nparts: 1,
    n: 1,
    index: new Int32Array([body]),
    position: new Float64Array(position),
    orientation: new Float64Array([1, 0, 0, 0]),
  }) as unknown as world_state_t;
