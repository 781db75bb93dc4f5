// A run as a user sees it: robots, rays, pictures, plots, channels, pause and step. Takes pictures
// of the page.
export default async function live({
  page,
  seen,
  until,
  fact,
  clock,
  picture,
  check,
  ready,
  still,
  server,
}) {
  await page.setViewportSize({ width: 1366, height: 820 });
  await ready();
  seen("robots are listed");
  await until("rays have appeared", () =>
    [...window.ruedo.overlays.of.values()].some((o) =>
      [...o.scans.values()].some((s) => s.lines.object.geometry.drawRange.count > 100),
    ),
  );
  await page.locator("canvas#canvas").focus();
  const before = await fact("pose");
  await page.keyboard.down("KeyW");
  await until(
    "the robot moved when driven",
    (x) => Math.abs(parseFloat(document.querySelector('[data-fact="pose"]').textContent) - x) > 0.2,
    before,
  );
  await page.keyboard.up("KeyW");
  await until(
    "a picture has come",
    () => document.querySelector("canvas.picture:not([hidden])")?.width === 640,
  );
  await picture("laptop");
  await page.setViewportSize({ width: 900, height: 480 }); // software draws every pixel
  await page.getByRole("tab", { name: "Plots" }).click();
  await until("the odometry's error is known", () =>
    /m, .*°/.test(window.ruedo.pages.values.get("odometry error")?.textContent ?? ""),
  );
  await until(
    "plots grow",
    () =>
      document.querySelectorAll(".plot canvas").length === 3 &&
      ["speed", "error"].every((name) => window.ruedo.pages[name].data[0].length > 10) &&
      window.ruedo.pages.path.points.every((points) => points.length > 10),
  );
  await picture("plots");
  await page.getByRole("tab", { name: "Channels" }).click();
  await page.locator('tr[data-channel$="/odometry"]').first().click();
  await until("values of a channel are shown", () =>
    /theta/.test(document.querySelector(".channels pre")?.textContent ?? ""),
  );
  await until("rates are shown", () =>
    [...document.querySelectorAll(".channels .number")].some(
      (cell) => parseFloat(cell.textContent) > 1,
    ),
  );
  await picture("channels");
  await page.locator("#pause").click();
  await until(
    "it says that it is paused",
    () => document.getElementById("state").textContent === "paused",
  );
  const held = await server();
  await until(
    "(the page shows the last state)",
    (t) => Math.abs(window.ruedo.page.now.time_s - t) < 1e-6,
    held.utime * 1e-6,
  );
  await page.waitForTimeout(1500);
  const later = await server();
  check(
    "pause holds the clock",
    held.paused &&
      later.paused &&
      later.utime === held.utime &&
      Math.abs((await clock()) - held.utime * 1e-6) < 0.006,
    JSON.stringify([held, later, await clock()]),
  );
  await page.keyboard.press(".");
  await until("a step moves the clock", (t) => window.ruedo.page.now.time_s > t, held.utime * 1e-6);
  check(
    "(by one step)",
    (await server()).step === held.step + 1,
    JSON.stringify([held, await server()]),
  );
  await page.locator("#pause").click();
  await until("it goes on", () => document.getElementById("state").textContent === "running");
  await page.getByRole("tab", { name: "Robot" }).click();
  await page.keyboard.press("t");
  const read = await page.evaluate(async () => {
    const { pages } = window.ruedo,
      { createImageBitmap } = window,
      canvas = new OffscreenCanvas(1, 1);
    canvas.getContext("2d");
    const data = new Uint8Array(await (await canvas.convertToBlob()).arrayBuffer());
    let count = 0;
    window.createImageBitmap = (blob) => {
      if (blob.size === data.length) ++count; // the run's own go on
      return createImageBitmap(blob);
    };
    const source = { kind: "", nameOf: String };
    for (let i = 0; i < 50; ++i)
      pages.camera(
        "fast",
        { utime: 0n, width: 1, height: 1, pixelformat: 1196444237, data },
        source,
      );
    while (document.querySelector('[data-camera="fast"] canvas').width !== 1)
      await new Promise((next) => requestAnimationFrame(next));
    window.createImageBitmap = createImageBitmap;
    document.querySelector('[data-camera="fast"]').remove();
    return count;
  });
  check("of pictures that come too fast the first and the newest are read", read <= 2, read);
  await page.setViewportSize({ width: 390, height: 844 });
  await still();
  await picture("phone");
}
