// A recorded run: the time line, and that the page shows what the log has at each moment. Given: moments of the log, with
// the pose of the robot's body then, and the bodies that there are then.
export default async function log({ page, given, seen, until, check, clock, picture }) {
  await until("the time line is there", () => !document.getElementById("timeline").hidden);
  await until("robots are listed", () => window.ruedo?.world?.robots.length > 0);
  await until("the world is shown", () => window.ruedo.stage.description?.world && window.ruedo.stage.frames > 1);
  const playback = () => page.evaluate(() => window.ruedo.timeline.playback);
  check("it plays by itself", (await playback()).playing);
  await until("the time goes on", (t) => window.ruedo.timeline.playback.now > t + 0.3, (await playback()).now);
  await page.keyboard.press(" ");
  await until("space pauses it", () => !window.ruedo.timeline.playback.playing && document.getElementById("state").textContent === "log, paused");

  // As a hand does it: to a place on the line.
  const line = await page.locator("#scrub").boundingBox();
  await page.mouse.click(line.x + 0.8 * line.width, line.y + line.height / 2);
  await until("a click on the time line goes there", () => { const { begin, end, now } = window.ruedo.timeline.playback; return Math.abs((now - begin) / (end - begin) - 0.8) < 0.03; });
  await picture("log");

  for (const { time, body, pose, bodies, sim_time } of given.moments) {
    await page.evaluate((t) => {
      const slider = document.getElementById("scrub");
      slider.value = String(t);
      slider.dispatchEvent(new Event("change"));
    }, time);
    await until("", (t) => Math.abs(window.ruedo.timeline.playback.now - t) < 1e-6, time);
    await until("", (count) => window.ruedo.world.bodies.filter((b) => b.index >= 0).length === count, bodies).catch(async () => { throw new Error(`at ${time} s there are ${await page.evaluate(() => window.ruedo.world.bodies.filter((b) => b.index >= 0).map((b) => b.name))}, not ${bodies} bodies`); });
    await until("", ([at, x, y]) => { const { now } = window.ruedo.poses; return Math.hypot(now[7 * at] - x, now[7 * at + 1] - y) < 1e-4; }, [body, pose[0], pose[1]])
      .catch(async () => { throw new Error(`at ${time} s the robot is at ${await page.evaluate((b) => [...window.ruedo.poses.now.slice(7 * b, 7 * b + 3)], body)}, not at ${pose}`); });
    if (Math.abs(await clock() - sim_time) > 0.006) throw new Error(`at ${time} s of the log the clock says ${await clock()}, not ${sim_time}`);
  }
  seen("the time line scrubs");
  check("the robot is where the log has it, at each of many moments", given.moments.length >= 5);
  if (given.rays) {
    await until("rays have appeared", () => [...window.ruedo.overlays.values()].some((o) => [...o.scans.values()].some((s) => s.lines.object.geometry.drawRange.count > 100)));
    await until("a picture has come", () => document.querySelector("img.picture")?.naturalWidth > 0);
  }

  await page.getByLabel("speed", { exact: true }).last().selectOption("5");
  await page.evaluate(() => { const s = document.getElementById("scrub"); s.value = s.min; s.dispatchEvent(new Event("change")); });
  await page.keyboard.press(" ");
  await until("another speed is taken", () => window.ruedo.timeline.playback.speed === 5 && window.ruedo.timeline.playback.playing);
  await until("it stops at the end", () => { const p = window.ruedo.timeline.playback; return !p.playing && p.now === p.end; });
  await page.keyboard.press(" ");
  await until("and begins anew", () => { const p = window.ruedo.timeline.playback; return p.playing && p.now < p.end; });
  await page.getByRole("tab", { name: "Channels" }).click();
  await until("the channels of the log are listed", () => document.querySelector('tr[data-channel="ruedo/state_hash"]') && document.querySelector('tr[data-channel="ruedo/world"]'));
  check("a recorded run cannot be steered", await page.evaluate(() => !document.querySelector("[aria-label^='reset']") && getComputedStyle(document.querySelector(".stick")).display === "none"));
}
