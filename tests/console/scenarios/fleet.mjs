// Many robots, all of them in motion: frames a second, what a frame costs this page's own thread
// (states received, matrices made, draw calls issued), and the processor time of the browser's
// processes for a frame. Given: {"robots": how many there must be, "seconds": of each measurement,
// "views": of which, or all}.
import { readFileSync, readdirSync } from "node:fs";

const kTicks_per_s = 100; // of /proc

// Processor time (s), by kind of process, of all child processes.
function cpuTimes() {
  const processes = readdirSync("/proc")
    .filter((name) => /^\d+$/.test(name))
    .flatMap((name) => {
      try {
        const [, rest] = readFileSync(`/proc/${name}/stat`, "utf8").split(") "),
          fields = rest.split(" ");
        const command = readFileSync(`/proc/${name}/cmdline`, "utf8"),
          kind = command.match(/--type=([a-z]+)/)?.[1] ?? "browser";
        const ticks = Number(fields[11]) + Number(fields[12]);
        return [{ id: Number(name), parent: Number(fields[1]), kind, ticks }];
      } catch {
        return []; // it has ended
      }
    });
  const times = {},
    add = (parent) => {
      for (const { id, kind, ticks } of processes.filter((each) => each.parent === parent)) {
        times[kind] = (times[kind] ?? 0) + ticks / kTicks_per_s;
        add(id);
      }
    };
  add(process.pid);
  return times;
}

export default async function fleet({ page, given, until, check, picture }) {
  await until(
    "robots are listed",
    (n) => window.ruedo?.page.now.world?.robots.length >= n,
    given.robots,
  );
  await until(
    "the world is drawn",
    () => window.ruedo.stage.bodies.description && window.ruedo.stage.frames > 2,
  );
  // Loops over the beginning of the log, so that time always advances.
  await page.evaluate(() =>
    setInterval(() => {
      window.ruedo.link.seek(0);
      if (window.ruedo.page.now.paused) window.ruedo.link.play(true, 1);
    }, 3000),
  );
  await page.evaluate(() => {
    const { stage, poses } = window.ruedo,
      frame = stage.frame.bind(stage),
      add = poses.add.bind(poses);
    let adding = 0;
    window.costs = [];
    // The robots of the log stand still. Here each drives a circle of 0.2 m at 0.4 m/s.
    poses.add = (state, at) => {
      const angle = Number(state.utime) / 500_000;
      for (let i = 0; i < state.index.length; ++i) {
        state.position[3 * i] += 0.2 * Math.cos(angle);
        state.position[3 * i + 1] += 0.2 * Math.sin(angle);
      }
      const begun = performance.now();
      add(state, at);
      adding += performance.now() - begun;
      if (state.part === 0) ++window.states;
    };
    stage.frame = (at, overlays) => {
      const begun = performance.now(),
        moving = !poses.settled;
      frame(at, overlays);
      if (!moving) return; // a redraw without motion is cheaper
      window.costs.push(adding + performance.now() - begun);
      adding = 0;
    };
  });
  const measure = async (name, width, height, shadows, automatic) => {
    if (given.views && !given.views.includes(name)) return;
    await page.setViewportSize({ width, height });
    await page.evaluate(
      ([s, a]) => {
        window.ruedo.stage.setShadows(s);
        window.ruedo.stage.setAutomatic(a);
        window.ruedo.stage.home();
      },
      [shadows, automatic],
    );
    const before = await page.evaluate(() => window.ruedo.stage.frames);
    await until("(it is drawn so)", (n) => window.ruedo.stage.frames > n + 5, before);
    // Until its level of detail has settled
    if (automatic) await page.waitForTimeout(given.seconds * 1000);
    const cpuBefore = cpuTimes();
    const { frames, wall, costs, states, level } = await page.evaluate(
      (s) =>
        new Promise((done) => {
          const { stage } = window.ruedo,
            from = { frames: stage.frames, at: performance.now() };
          window.costs = [];
          window.states = 0;
          const look = () => {
            // for that long, and that many frames
            if (performance.now() - from.at < s * 1000 || window.costs.length < 4)
              return void setTimeout(look, 50);
            done({
              frames: stage.frames - from.frames,
              wall: performance.now() - from.at,
              costs: window.costs,
              states: window.states,
              level: stage.quality.now,
            });
          };
          look();
        }),
      given.seconds,
    );
    const cpu = Object.fromEntries(
      Object.entries(cpuTimes()).map(([kind, time_s]) => [
        kind,
        Math.round((10_000 * (time_s - (cpuBefore[kind] ?? 0))) / frames) / 10,
      ]),
    );
    const { calls, triangles } = await page.evaluate(() => window.ruedo.stage.renderer.info.render);
    check("they are a few draw calls", calls < 200, calls);
    costs.sort((a, b) => a - b);
    const round = (v) => Math.round(v * 100) / 100;
    console.log(
      `measured: ${JSON.stringify({
        view: name,
        width,
        height,
        shadows: shadows && level.shadows,
        ratio: Math.min(1, level.ratio),
        calls,
        triangles,
        frames_per_s: round((frames * 1000) / wall),
        states_per_s: round((states * 1000) / wall),
        ms_per_frame: round(wall / frames),
        own_ms_median: round(costs[costs.length >> 1]),
        own_ms_least: round(costs[0]),
        cpu_ms_per_frame: cpu,
      })}`,
    );
  };
  await page.keyboard.press("p");
  await measure("laptop", 1366, 768, true, false);
  await picture("fleet");
  await measure("laptop, automatic", 1366, 768, true, true);
  await measure("tiny", 320, 200, false, false);
}
