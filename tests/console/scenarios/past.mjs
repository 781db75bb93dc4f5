// The last minutes of a run are viewed while it continues: by the time line, with models that were
// added and removed meanwhile.
export default async function past({ page, seen, until, check, ready, server, picture, onScreen }) {
  await page.setViewportSize({ width: 1000, height: 460 }); // software draws every pixel
  await ready();
  await page.getByRole("tab", { name: "Robot" }).click();
  await page.locator("#canvas").focus();
  const pose = () => page.evaluate(() => window.ruedo.poses.to[0]);
  await until(
    "a live run has a time line",
    () =>
      document.getElementById("scrub").checkVisibility() &&
      window.ruedo.rewind.range.end - window.ruedo.rewind.range.begin > 1,
  );
  const begin = await page.evaluate(() => ({
    time: window.ruedo.page.now.time_s,
    x: window.ruedo.poses.to[0],
  }));
  await page.keyboard.down("KeyW");
  await until("(it drives)", (x) => window.ruedo.poses.to[0] > x + 0.5, begin.x);
  await page.keyboard.up("KeyW");
  await page.evaluate(() => {
    const { rewind } = window.ruedo;
    rewind.show(rewind.range.end - 0.5);
  });
  await until("a moment ago is called so, where nothing came or went since", () =>
    /s ago$/.test(document.getElementById("state")?.textContent),
  );
  await page.locator("#live").click();
  await page.keyboard.press("b");
  await page.mouse.click(...(await onScreen(-1.5, 0.4))); // nothing is there
  const box = () => window.ruedo.page.now.scene.models.some(({ name }) => name === "box");
  await until("(a box is placed)", box);
  const scrub = async (time_s) => {
    await page.evaluate((t) => {
      const slider = document.getElementById("scrub");
      slider.value = String(t);
      slider.dispatchEvent(new Event("change"));
    }, time_s);
  };
  await scrub(begin.time);
  await until(
    "the robot is where it was",
    (x) => Math.abs(window.ruedo.poses.to[0] - x) < 0.02,
    begin.x,
  );
  await until(
    "what came later is not there",
    () => !window.ruedo.page.now.scene.models.some(({ name }) => name === "box"),
  );
  await until("it says how long ago that was", () =>
    /s ago$/.test(document.getElementById("state")?.textContent),
  );
  await until(
    "values are of that moment",
    (x) =>
      Math.abs(parseFloat(document.querySelector('[data-fact="pose"]')?.textContent) - x) < 0.05,
    begin.x,
  );
  await picture("past");
  const first = await server();
  // Meanwhile ruedo/info, which comes once a second, has another time.
  await until(
    "the run goes on meanwhile",
    (t) => window.ruedo.rewind.range.end > t + 2.5,
    first.utime * 1e-6,
  );
  const times = await page.evaluate(() => [
    parseFloat(document.getElementById("clock").textContent),
    window.ruedo.poses.utime * 1e-6,
  ]);
  check("the clock shows the time of the picture", Math.abs(times[0] - times[1]) < 0.006, times);
  check("(and the page stays)", Math.abs((await pose()) - begin.x) < 0.02);
  await page.locator("#timeline button").first().click();
  await until("the past plays on", (t) => window.ruedo.page.now.past.now > t + 0.3, begin.time);
  // A page that was starved has seen few of its points.
  const hasTrail = (what) =>
    until(
      what,
      (x) => {
        const { points } = window.ruedo.overlays.of.get("p3at").truth;
        return points.length > 6 && Math.max(...points.filter((_, i) => i % 3 === 0)) > x + 0.4;
      },
      begin.x,
    );
  await scrub(await page.evaluate(() => window.ruedo.page.now.kept.end));
  await hasTrail("its trail is that of what was before");
  await page.keyboard.press(",");
  await hasTrail("(and after a step back)");
  await scrub(begin.time);
  await page.locator("#canvas").focus();
  const isPlaying = () => window.ruedo.page.now.past.playing;
  await page.keyboard.press(" ");
  await until("(it plays)", isPlaying);
  await page.keyboard.press(" ");
  await until("(and stops)", () => !window.ruedo.page.now.past.playing);
  check(
    "space plays the past, as its button says",
    !(await server()).paused && !/space/.test(await page.locator("#pause").getAttribute("title")),
    "the run is paused",
  );
  await page.locator("#live").click();
  await until("Live shows what runs now", (x) => window.ruedo.poses.to[0] > x + 0.5, begin.x);
  await until("with all that came", box);
  await until(
    "(nothing is said of the past)",
    () => document.getElementById("state").textContent === "running",
  );
  seen("all was seen");
}
