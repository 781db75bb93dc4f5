// What lies high: clicks, coordinates and ways meet what is seen, not the plane of 0 m.
// Given: a point that is seen, and whether the robot can drive there.
export default async function ground({ page, until, check, ready, onScreen, given }) {
  const [x, y, z] = given.point;
  await page.setViewportSize({ width: 1000, height: 520 });
  await ready();
  await page.locator("#canvas").focus();
  await page.keyboard.press(" ");
  await until("(paused)", () => document.getElementById("state").textContent === "paused");
  await page.mouse.move(...(await onScreen(x, y, z)));
  await until(
    "coordinates are those of what is under the pointer",
    (at) => {
      const shown = document.getElementById("coordinates").textContent.split(",").map(parseFloat);
      return shown.length === 3 && shown.every((value, i) => Math.abs(value - at[i]) < 0.05);
    },
    [x, y, z],
  );
  await page.keyboard.press("b");
  await page.mouse.click(...(await onScreen(x, y, z)));
  await until(
    "what is placed stands where the click was",
    ([x, y, z]) => {
      const {
          page: { now },
          poses,
        } = window.ruedo,
        body = now.world.bodies.find(({ name }) => name === "box/link")?.index ?? -1;
      if (body < 0) return false;
      const [px, py, pz, qw, qx, qy, qz] = poses.now.subarray(7 * body, 7 * body + 7),
        up = [2 * (qx * qz + qw * qy), 2 * (qy * qz - qw * qx), 1 - 2 * (qx * qx + qy * qy)],
        foot = [px, py, pz].map((v, i) => v - 0.2 * up[i]); // it lies on the slope
      return Math.hypot(foot[0] - x, foot[1] - y) < 0.1 && Math.abs(foot[2] - z) < 0.03;
    },
    [x, y, z],
  );
  await page.keyboard.press("g");
  await page.mouse.click(...(await onScreen(x, y - 1, z)));
  const point = await page.evaluate(() => window.ruedo.trip.points()[0]);
  check(
    "a robot is sent to what was clicked",
    Math.hypot(point.x - x, point.y - y + 1) < 0.1 && Math.abs(point.z - z) < 0.03,
    JSON.stringify(point),
  );
  check(
    "and the way is drawn there",
    await page.evaluate((z) => {
      const { position } = window.ruedo.way.ends.geometry.attributes;
      return Math.abs(position.getZ(0) - z) < 0.05;
    }, z),
    "at another height",
  );
  if (!given.drives) return;
  await page.keyboard.press(" ");
  await until(
    "and drives there, over the ground",
    ([x, y, z]) => {
      const {
          page: { now },
          poses,
          trip,
        } = window.ruedo,
        base = now.scene.bases[0].body,
        at = poses.now.subarray(7 * base, 7 * base + 3);
      return (
        trip.points().length === 0 &&
        Math.hypot(at[0] - x, at[1] - y) < 0.1 &&
        Math.abs(at[2] - z) < 0.3
      );
    },
    [x, y - 1, z],
  );
}
