// Many robots: frames a second, and what a frame costs this page's own thread: states taken,
// matrices made, draw calls given. The rest of a frame is the rasteriser's. Given: {"robots": how
// many there must be, "seconds": of each measurement, "views": of which, or all}.
export default async function fleet({ page, given, until, check, picture }) {
  await until(
    "robots are listed",
    (n) => window.ruedo?.page.now.world?.robots.length >= n,
    given.robots,
  );
  await until(
    "the world is drawn",
    () => window.ruedo.stage.description && window.ruedo.stage.frames > 2,
  );
  // The log's beginning again and again: it always moves on.
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
    poses.add = (state, at) => {
      const begun = performance.now();
      add(state, at);
      poses.forgetSeen(); // as if all of them moved
      adding += performance.now() - begun;
      if (state.part === 0) ++window.states;
    };
    stage.frame = (at, overlays) => {
      const begun = performance.now(),
        moving = !poses.settled;
      frame(at, overlays);
      if (!moving) return; // what is drawn again without motion is cheaper
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
    // Until it has come to its level
    if (automatic) await page.waitForTimeout(given.seconds * 1000);
    const { frames, wall, costs, states, level } = await page.evaluate(
      (s) =>
        new Promise((done) => {
          const { stage } = window.ruedo,
            from = { frames: stage.frames, at: performance.now() };
          window.costs = [];
          window.states = 0;
          const look = () => {
            // for so long, and so many frames
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
      })}`,
    );
  };
  await page.keyboard.press("p");
  await measure("laptop", 1366, 768, true, false);
  await picture("fleet");
  await measure("laptop, automatic", 1366, 768, true, true);
  await measure("tiny", 320, 200, false, false);
}
