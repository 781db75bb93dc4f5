// The page offers only what can be done and seen here. Given: {"is": "bare" (no robot), "log",
// "watched" (--control off) or "hall" (with a roof)}.
export default async function offers({ page, given, until, check, picture }) {
  await page.setViewportSize({ width: 1100, height: 640 });
  await until(
    "it is drawn",
    () =>
      window.ruedo?.page.now.world &&
      window.ruedo.stage.bodies.description &&
      window.ruedo.stage.frames > 1,
  );
  await page.getByRole("tab", { name: "Robot" }).click();
  const seen = (selector) => page.locator(selector).isVisible();
  const motions = await seen("#move"),
    pad = await seen("#pad"),
    chips = await page.locator(".chip[data-layer]:visible").allInnerTexts();
  if (given.is === "bare") {
    check("no motions are offered where no robot is", !motions && !pad);
    check("no choice of robots", !(await seen(".robots")) && !(await seen(".find")));
    check("it shows a note", /no robot/.test(await page.locator(".page").innerText()));
    check("no samples of robots", chips.join() === "shapes", chips.join());
    await page.getByRole("tab", { name: "Plots" }).click();
    check("no plots of a robot", (await page.locator(".u-title:visible").count()) === 0);
  } else if (given.is === "log") {
    await until("(values are there)", () => document.querySelector('[data-fact="pose"]'));
    check("a log offers no motions", !motions && !pad);
    check(
      "nor what changes a run",
      !(await seen('[aria-label^="reset"]')) && !(await seen("[data-tool]")),
    );
  } else if (given.is === "watched") {
    check(
      "a viewer without control has no request buttons",
      await page.locator("#pause").isDisabled(),
    );
    await page.waitForTimeout(1000);
    const notes = await page.evaluate(() => window.notes.join());
    check("and gets no error", notes === "", notes);
  } else {
    check("there is a chip for the roof", chips.includes("roof"), chips.join());
    const height = () =>
      page.evaluate(() => {
        const { left, top, width, height } = document
          .getElementById("canvas")
          .getBoundingClientRect();
        return window.ruedo.stage.picker.pick(left + width / 2, top + height / 2).point?.z ?? 0;
      });
    check("things below the roof are visible and clickable", (await height()) < 2, await height());
    await picture("hall");
    await page.locator('[data-layer="roof"]').click();
    check("the roof, if chosen", (await height()) > 2.9, await height());
    const away = await page.evaluate(() => {
      const { stage } = window.ruedo;
      const corners = [-5, 5].flatMap((x) => [-4, 4].flatMap((y) => [0, 2].map((z) => [x, y, z])));
      return Math.max(
        ...corners.flatMap((corner) => {
          const p = stage.view.camera.position
            .clone()
            .set(...corner)
            .project(stage.view.camera);
          return [Math.abs(p.x), Math.abs(p.y)];
        }),
      );
    });
    check("all of the world is in view, and fills it", away < 1 && away > 0.6, away);
  }
}
