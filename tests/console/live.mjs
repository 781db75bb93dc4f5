// A run as a user sees it: robots, rays, pictures, plots, channels, pause and step. Takes pictures of the page.
export default async function live({ page, seen, until, fact, clock, picture, check, ready }) {
  await page.setViewportSize({ width: 1366, height: 820 });
  await ready();
  seen("robots are listed");
  await until("rays have appeared", () => {
    let lines = 0;
    window.ruedo.stage.scene.traverse((o) => { if (o.isLineSegments && o.geometry.drawRange.count > 100 && Number.isFinite(o.geometry.drawRange.count)) ++lines; });
    return lines > 0;
  });
  await page.locator("canvas#canvas").focus();
  const before = parseFloat(await fact("pose"));
  await page.keyboard.down("KeyW");
  await until("the robot moved when driven", (x) => Math.abs(parseFloat(document.querySelector('[data-fact="pose"]').textContent) - x) > 0.2, before);
  await page.keyboard.up("KeyW");
  await until("a picture has come", () => document.querySelector("img.picture")?.naturalWidth > 0);
  await picture("laptop");
  await page.setViewportSize({ width: 900, height: 480 });    // software draws every pixel
  await page.getByRole("tab", { name: "Plots" }).click();
  await page.waitForTimeout(2500);
  await picture("plots");
  await page.getByRole("tab", { name: "Channels" }).click();
  await page.locator('tr[data-channel$="/odometry"]').first().click();
  await until("values of a channel are shown", () => /theta/.test(document.querySelector(".channels pre")?.textContent ?? ""));
  await until("rates are shown", () => [...document.querySelectorAll(".channels .number")].some((cell) => parseFloat(cell.textContent) > 1));
  await picture("channels");
  await page.locator("#pause").click();
  await until("it says that it is paused", () => document.getElementById("state").textContent === "paused");
  await page.waitForTimeout(500);
  const held = await clock();
  await page.waitForTimeout(1500);
  check("pause holds the clock", await clock() === held);
  const paused = await page.evaluate(() => window.ruedo.time_s);
  await page.keyboard.press(".");
  await until("a step moves the clock", (t) => window.ruedo.time_s > t, paused);
  await page.locator("#pause").click();
  await until("it goes on", () => document.getElementById("state").textContent === "running");
  await page.getByRole("tab", { name: "Robot" }).click();
  await page.keyboard.press("t");
  await page.setViewportSize({ width: 390, height: 844 });
  await page.waitForTimeout(2000);
  await picture("phone");
}
