// A recorded run: the time line, and that the page shows what the log has at each moment. Given:
// moments of the log, with the pose of the robot's body then, and the bodies that there are then;
// channels that it has, if they are not the usual ones.
export default async function log({ page, given, seen, until, check, picture }) {
  await until("the time line is there", () => !document.getElementById("timeline").hidden);
  await until("robots are listed", () => window.ruedo?.page.now.world?.robots.length > 0);
  await until(
    "the world is shown",
    () => window.ruedo.stage.bodies.description?.world && window.ruedo.stage.frames > 1,
  );
  const playback = () => page.evaluate(() => window.ruedo.page.now.playback);
  await until(
    "it plays by itself",
    () => window.ruedo.page.now.playback.now > window.ruedo.page.now.playback.begin,
  );
  // At a fiftieth of its speed the log does not end before the page is checked.
  const first = (await playback()).begin;
  await page.evaluate((t) => {
    window.ruedo.link.seek(t);
    window.ruedo.link.play(true, 0.02);
  }, first);
  await until(
    "the time goes on",
    (t) => {
      const { now, end, playing, speed } = window.ruedo.page.now.playback;
      return speed === 0.02 && playing && now > t && now < end;
    },
    first,
  );
  await page.keyboard.press(" ");
  await until(
    "space pauses it",
    () =>
      !window.ruedo.page.now.playback.playing &&
      document.getElementById("state").textContent === "log, paused",
  );

  // As by hand: to a place on the line.
  const line = page.locator("#scrub");
  const { width, height } = await line.boundingBox();
  await line.click({ position: { x: 0.8 * width, y: height / 2 } });
  await until("a click on the time line goes there", () => {
    const { begin, end, now } = window.ruedo.page.now.playback;
    return Math.abs((now - begin) / (end - begin) - 0.8) < 0.03;
  });
  await picture("log");

  for (const { time, body, pose, bodies, sim_time } of given.moments) {
    await page.evaluate((t) => {
      const slider = document.getElementById("scrub");
      slider.value = String(t);
      slider.dispatchEvent(new Event("change"));
    }, time);
    await until(
      `(the log at ${time} s)`,
      (t) => Math.abs(window.ruedo.page.now.playback.now - t) < 1e-6,
      time,
    );
    await until(
      `(${bodies} bodies at ${time} s)`,
      (count) => window.ruedo.page.now.world.bodies.filter((b) => b.index >= 0).length === count,
      bodies,
    );
    await until(
      `(the robot at ${pose} m at ${time} s)`,
      ([at, x, y]) => {
        const { now } = window.ruedo.poses;
        return Math.hypot(now[7 * at] - x, now[7 * at + 1] - y) < 1e-4;
      },
      [body, ...pose],
    );
    await until(
      `(sim time ${sim_time} s)`,
      (t) => Math.abs(parseFloat(document.getElementById("clock").textContent) - t) < 0.006,
      sim_time,
    );
  }
  seen("the time line scrubs");
  check("the robot is where the log has it, at each of many moments", given.moments.length >= 5);
  if (given.rays) {
    await until("rays have appeared", () =>
      [...window.ruedo.overlays.of.values()].some((o) =>
        [...o.scans.values()].some((s) => s.lines.object.geometry.drawRange.count > 100),
      ),
    );
    await until(
      "a picture has come",
      () => document.querySelector("canvas.picture:not([hidden])")?.width === 640,
    );
  }

  const speed = page.getByLabel("speed", { exact: true }).last();
  await speed.selectOption("10");
  await until("another speed is taken", () => window.ruedo.page.now.playback.speed === 10);
  await page.evaluate(() => {
    const {
      link,
      page: {
        now: { playback },
      },
    } = window.ruedo;
    link.seek(Math.max(playback.begin, playback.end - 2));
  }); // a long log would take minutes
  await until("(it is near the end)", () => {
    const { begin, end, now } = window.ruedo.page.now.playback;
    return Math.abs(now - Math.max(begin, end - 2)) < 1e-3;
  });
  await page.keyboard.press(" ");
  await until("it stops at the end", () => {
    const p = window.ruedo.page.now.playback;
    return !p.playing && p.now === p.end;
  });
  await speed.selectOption("0.25");
  const { jumps } = await playback();
  await page.keyboard.press(" ");
  await until("and begins anew", (n) => window.ruedo.page.now.playback.jumps > n, jumps);
  await page.getByRole("tab", { name: "Channels" }).click();
  await until(
    "the channels of the log are listed",
    (names) => names.every((name) => document.querySelector(`tr[data-channel="${name}"]`)),
    given.channels ?? ["ruedo/state_hash", "ruedo/world"],
  );
  check(
    "a recorded run cannot be steered",
    await page.evaluate(
      () =>
        !document.querySelector("#bar [aria-label^='reset']") &&
        !document.querySelector("#bar [aria-label='rate']") &&
        !document.querySelector(".stick").checkVisibility(),
    ),
    "reset, rate or stick",
  );
}
