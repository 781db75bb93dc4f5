// A recorded run as one file, opened from the disk: it requests nothing, and shows what the log
// has.
import { readdirSync } from "node:fs";

export default async function disk({ page, given, until, check, picture }) {
  await page.setViewportSize({ width: 900, height: 420 });
  await until(
    "the run is there",
    () =>
      window.ruedo?.page.now.world?.robots.length > 0 &&
      window.ruedo.stage.bodies.description &&
      window.ruedo.stage.frames > 1,
  );
  await until(
    "it plays by itself",
    () => window.ruedo.page.now.playback.now > window.ruedo.page.now.playback.begin,
  );
  await page.locator("#canvas").focus();
  await page.keyboard.press(" ");
  await until("space pauses it", () => !window.ruedo.page.now.playback.playing);
  for (const { time, body, pose } of given.moments) {
    await page.evaluate((t) => window.ruedo.link.seek(t), time);
    // Thinned, the newest message may be as old as the interval.
    await until(
      `(the robot near ${pose} m at ${time} s)`,
      ([at, x, y, near]) => {
        const { now } = window.ruedo.poses;
        return Math.hypot(now[7 * at] - x, now[7 * at + 1] - y) <= near;
      },
      [body, ...pose, given.near],
    );
  }
  check("the robot is where the log has it", given.moments.length >= 4);
  await until("rays are drawn", () =>
    [...window.ruedo.overlays.of.values()].some((o) =>
      [...o.scans.values()].some((s) => s.lines.object.geometry.drawRange.count > 100),
    ),
  );
  if (given.pictures)
    await until(
      "a picture has come",
      () => document.querySelector("canvas.picture:not([hidden])")?.width === 640,
    );
  await page.getByRole("tab", { name: "Plots" }).click();
  await page.evaluate(() => {
    const { begin } = window.ruedo.page.now.playback;
    window.ruedo.link.seek(begin);
    window.ruedo.link.play(true, 1);
  });
  await until("plots grow", () => window.ruedo.pages.speed.data[0].length > 10);
  await page.getByRole("tab", { name: "Channels" }).click();
  await until("channels have rates", () =>
    [...document.querySelectorAll(".channels .number")].some(
      (cell) => parseFloat(cell.textContent) > 1,
    ),
  );
  check(
    "nothing was asked of anybody",
    await page.evaluate(() =>
      performance.getEntriesByType("resource").every(({ name }) => /^(blob|data):/.test(name)),
    ),
    "something was",
  );
  await picture("disk");
  check(
    "(the page is alone)",
    readdirSync(given.folder).length === 1,
    String(readdirSync(given.folder)),
  );
}
