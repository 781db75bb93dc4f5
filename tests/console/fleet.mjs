// A thousand robots: frames a second, what a frame costs this thread, and what is left of it when nothing is rasterised.
// Given: {"robots": how many there must be, "seconds": of each measurement}.
export default async function fleet({ page, given, until, check, picture }) {
  await until("robots are listed", (n) => window.ruedo?.world?.robots.length >= n, given.robots);
  await until("the world is drawn", () => window.ruedo.stage.description && window.ruedo.stage.frames > 2);
  // The log's beginning again and again: it always moves on.
  await page.evaluate(() => setInterval(() => { window.ruedo.link.seek(0); if (window.ruedo.paused) window.ruedo.link.play(true, 1); }, 3000));
  const { calls, triangles } = await page.evaluate(() => window.ruedo.stage.renderer.info.render);
  console.log(`measured: ${JSON.stringify({ calls, triangles })}`);
  check("they are a few draw calls", calls < 200, calls);
  const measure = (seconds) => page.evaluate((s) => new Promise((done) => {
    const { stage, poses } = window.ruedo, frame = stage.frame.bind(stage);
    let cost = 0, states = 0;
    const add = poses.add.bind(poses);
    poses.add = (state, at) => { const begun = performance.now(); add(state, at); cost += performance.now() - begun; if (state.part === 0) ++states; };
    stage.frame = (at, overlays) => { const begun = performance.now(); frame(at, overlays); cost += performance.now() - begun; };
    const from = { frames: stage.frames, at: performance.now() };
    setTimeout(() => {
      const frames = stage.frames - from.frames, wall = performance.now() - from.at;
      stage.frame = frame;
      poses.add = add;
      done({ frames_per_s: frames * 1000 / wall, states_per_s: states * 1000 / wall, own_ms_per_frame: cost / Math.max(1, frames) });
    }, s * 1000);
  }), seconds);
  for (const [name, width, height] of [["laptop", 1366, 820], ["small", 640, 400], ["tiny", 320, 200]]) {
    await page.setViewportSize({ width, height });
    if (name === "laptop") { await page.keyboard.press("p"); await page.keyboard.press("Home"); }
    await page.waitForTimeout(2000);
    if (name === "laptop") await picture("fleet");
    for (const shadows of [true, false]) {
      await page.evaluate((on) => window.ruedo.stage.setShadows(on), shadows);
      await page.waitForTimeout(1000);
      console.log(`measured: ${JSON.stringify({ view: name, width, height, shadows, ...await measure(given.seconds) })}`);
    }
    await page.evaluate(() => window.ruedo.stage.setShadows(true));
  }
}
