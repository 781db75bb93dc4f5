// Faults are reported: a robot that falls out of the world, driving while paused, graphics that the
// browser takes away. And control without a mouse.
export default async function odd({ page, until, check, ready, server, expect, picture }) {
  await page.setViewportSize({ width: 1000, height: 520 });
  await ready();
  const noted = (what, words) =>
    until(what, (text) => window.notes.some((note) => new RegExp(text).test(note)), words);
  await noted("missing parts of the world are reported", "^Parts of this world are missing");
  await noted("a fallen robot is reported", "^falling has fallen out of the world");
  await page.locator("#canvas").focus();
  await page.keyboard.press(" ");
  await until("(paused)", () => document.getElementById("state").textContent === "paused");
  await until("a pause is announced", () =>
    /paused/.test(document.querySelector('[role="status"]').textContent),
  );
  await page.evaluate(() => window.ruedo.choose(0));
  await page.keyboard.press("w");
  await noted("driving while paused gives a note", "The run is paused");
  const ring = await page.locator("#canvas").evaluate((canvas) => {
    const { outlineStyle, outlineWidth } = getComputedStyle(canvas);
    return outlineStyle !== "none" && parseFloat(outlineWidth) >= 2;
  });
  check("the view shows that it has the focus", ring);

  const share = await page.evaluate(() =>
    [...window.ruedo.overlays.of.values()].map(({ scans }) =>
      [...scans.values()].map(({ fan, lines }) =>
        [fan, lines].map((s) => s.object.material.opacity),
      ),
    ),
  );
  check(
    "rays of two robots are as strong as those of one",
    share.length === 2 &&
      share.every((scans) =>
        scans.every(
          ([fan, lines]) => Math.abs(fan - 0.05) < 1e-6 && Math.abs(lines - 0.175) < 1e-6,
        ),
      ),
    JSON.stringify(share),
  );

  // ---- by keyboard
  await page.keyboard.press("3");
  await page.keyboard.press("g");
  for (const key of ["ArrowRight", "ArrowRight", "Shift+ArrowUp"]) await page.keyboard.press(key);
  await picture("cross");
  const cross = await page.locator(".cross").boundingBox(),
    view = await page.locator("#canvas").boundingBox();
  check(
    "arrows move a cross",
    Math.abs(cross.x + cross.width / 2 - view.x - view.width / 2 - 32) < 1 &&
      Math.abs(cross.y + cross.height / 2 - view.y - view.height / 2 + 2) < 1,
    JSON.stringify(cross),
  );
  await page.keyboard.press("Enter");
  check(
    "and Enter sends the robot there",
    await page.evaluate(
      ([x, y]) => {
        const at = window.ruedo.stage.picker.point(x, y),
          to = window.ruedo.trip.points()[0];
        return to && Math.hypot(at.x - to.x, at.y - to.y) < 0.01;
      },
      [cross.x + cross.width / 2, cross.y + cross.height / 2],
    ),
  );
  await page.keyboard.press("b");
  await page.keyboard.press("ArrowDown");
  for (let i = 0; i < 4; ++i) await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("Enter");
  await until("or places something", () =>
    window.ruedo.page.now.scene.models.some(({ name }) => name === "box"),
  );
  await page.getByRole("tab", { name: "World" }).click();
  await page.locator('[data-tool="room"]').click();
  await page.locator("#canvas").focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  const begun = await page.locator(".cross").boundingBox();
  for (let i = 0; i < 5; ++i) await page.keyboard.press("ArrowRight");
  for (let i = 0; i < 4; ++i) await page.keyboard.press("ArrowUp");
  await until("what is drawn by keys is seen", () =>
    /^\d+\.\d\d × \d+\.\d\d m$/.test(document.getElementById("drawing")?.textContent),
  );
  await picture("drawn");
  const ended = await page.locator(".cross").boundingBox();
  await page.keyboard.press("Enter");
  await until(
    "a room is drawn by keys between two points",
    ([a, b]) => {
      const { stage, page } = window.ruedo,
        room = page.now.scene.models.find(({ name }) => name === "room");
      if (!room) return false;
      const [from, to] = [a, b].map(({ x, y }) => stage.picker.level(x + 12.5, y + 12.5, 0));
      return (
        Math.abs(room.pose[0] - (from.x + to.x) / 2) < 0.11 &&
        Math.abs(room.pose[1] - (from.y + to.y) / 2) < 0.11
      );
    },
    [begun, ended],
  );
  await page.keyboard.press("Escape");
  check("(the run stands)", (await server()).paused);

  // ---- what the program warns of
  await page.getByRole("tab", { name: "Notes" }).click();
  await until("the page has the program's warnings", () =>
    /unsupported.*world\.sdf:\d+.*audio/.test(document.getElementById("warnings")?.textContent),
  );

  // ---- the graphics
  expect(/Context (Lost|Restored)/); // three says so, too
  await page.evaluate(() => {
    const context = window.ruedo.stage.renderer.getContext();
    window.loss = context.getExtension("WEBGL_lose_context");
    window.loss.loseContext();
  });
  await until("lost graphics are reported", () =>
    /3-D graphics/.test(document.getElementById("notice")?.textContent),
  );
  await page.evaluate(() => window.loss.restoreContext());
  await until("and come back", () => document.getElementById("notice").hidden);
  const colours = await page.evaluate(() => {
    window.ruedo.stage.redraw();
    const small = document.createElement("canvas");
    [small.width, small.height] = [40, 20];
    const pen = small.getContext("2d");
    pen.drawImage(document.getElementById("canvas"), 0, 0, 40, 20);
    const { data } = pen.getImageData(0, 0, 40, 20);
    return new Set(Array.from({ length: 800 }, (_, i) => data.slice(4 * i, 4 * i + 3).join())).size;
  });
  check("with the world in them", colours > 10, `${colours} colours`);
  await picture("restored");
}
