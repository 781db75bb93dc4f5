// Panels beside the scene: their width, what was said, messages and faults by hand, a part of the
// time line.
export default async function panels({ page, until, check, ready, picture }) {
  await page.setViewportSize({ width: 1100, height: 600 });
  await ready();
  const width = () => page.evaluate(() => document.getElementById("panel").clientWidth);
  const before = await width(),
    edge = await page.locator("#splitter").boundingBox();
  await page.mouse.move(edge.x + edge.width / 2, 200);
  await page.mouse.down();
  await page.mouse.move(edge.x + edge.width / 2 - 100, 200, { steps: 3 });
  await page.mouse.up();
  check("the panel is dragged wider", Math.abs((await width()) - before - 100) < 3, await width());
  await page.locator("#splitter").focus();
  await page.keyboard.press("ArrowRight");
  check("and moved by keys", Math.abs((await width()) - before - 80) < 3, await width());

  // ---- a message by hand
  await page.getByRole("tab", { name: "Channels" }).click();
  await page.locator("#publish summary").click();
  await page.getByLabel("channel to publish on").selectOption("p3at/velocity");
  const send = async (text) => {
    await page.getByLabel("message", { exact: true }).fill(text);
    await page.locator("#send").click();
    return page.locator("#published").innerText();
  };
  const refused = await send('{"utime": 0, "vx": "fast", "vy": 0, "omega": 0}');
  check("its type is checked", /vx is a number/.test(refused), refused);
  const x = await page.evaluate(() => window.ruedo.poses.to[0]);
  await send('{"utime": 0, "vx": 0.5, "vy": 0, "omega": 0}');
  await until(
    "a message that is written moves the robot",
    (from) => window.ruedo.poses.to[0] > from + 0.02,
    x,
  );
  await picture("publish");

  // ---- a fault
  await page.getByRole("tab", { name: "Robot" }).click();
  await page.locator("#faults summary").click();
  await page.getByLabel("fault", { exact: true }).selectOption("weak_motor");
  await page.getByLabel("how much").fill("7");
  await page.locator("#fault").click();
  await until("a fault that there is not is refused", () =>
    window.notes.some((note) => /^weak_motor: a number from 0 to 1/.test(note)),
  );
  await page.getByLabel("how much").fill("0.5");
  await page.locator("#fault").click();
  await until("a fault is injected, and one of the events", () =>
    window.ruedo.page.now.events.some(({ kind }) => kind === "fault"),
  );
  await picture("faults");

  // ---- what was said
  await page.getByRole("tab", { name: "Notes" }).click();
  check(
    "notes are kept",
    /weak_motor: a number from 0 to 1/.test(await page.locator("#notes").innerText()),
    await page.locator("#notes").innerText(),
  );
  await picture("notes");

  // ---- the time line
  await until(
    "(there is a past)",
    () => window.ruedo.page.now.kept.end - window.ruedo.page.now.kept.begin > 3,
  );
  const lane = await page.locator("#events").boundingBox();
  await page.mouse.move(lane.x + lane.width / 2, lane.y + 5);
  for (let i = 0; i < 4; ++i) await page.mouse.wheel(0, -100);
  await until("the wheel zooms the time line", () => {
    const { min, max } = document.getElementById("scrub"),
      { kept } = window.ruedo.page.now;
    return (max - min) / (kept.end - kept.begin) < 0.6;
  });
  await page.locator("#events").dblclick();
  await until("and a double click shows everything", () => window.ruedo.page.now.span === null);
}
