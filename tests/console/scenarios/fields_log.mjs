// A field of a log: the plot shows the whole run, and a click in it seeks to that moment.
export default async function fieldsOfLog({ page, until, check, ready, given, picture }) {
  await page.setViewportSize({ width: 1000, height: 620 });
  await ready();
  await page.keyboard.press(" ");
  await page.getByRole("tab", { name: "Plots" }).click();
  await page.getByLabel("channel to plot").selectOption("p3at/odometry");
  await page.getByLabel("field to plot").fill("x");
  await page.locator("#plot").click();
  await until(
    "the whole run is there",
    () => window.ruedo.plots.panes[0]?.series[0]?.times.length > 0,
  );
  const found = await page.evaluate(() => {
    const { times, values, note } = window.ruedo.plots.panes[0].series[0];
    return [times.length, times[0], times.at(-1), Math.min(...values), Math.max(...values), note];
  });
  const { count, begin, end, least, most } = given;
  check(
    "it is the log's, from its first message to its last",
    found.join() === [count, begin, end, least, most, ""].join(),
    found.join(),
  );
  await until(
    "and its statistics are shown",
    (text) => document.querySelector(".statistics .number")?.textContent === text,
    String(Number(least.toPrecision(5))),
  );
  await page.getByLabel("field to plot").fill("y");
  await page.locator("#plot").click();
  await page.locator(".pane").getByRole("button", { name: "x-y" }).click();
  await until(
    "the whole path of the log is seen at once",
    (n) => window.ruedo.plots.panes[0].curves?.points[0].length === n,
    count,
  );
  await page.locator(".pane").getByRole("button", { name: "x-y" }).click();
  await page.locator(".pane").scrollIntoViewIfNeeded();
  await page.locator(".pane .u-over").click();
  await until(
    "a click in a plot seeks",
    ({ begin, end }) =>
      Math.abs(window.ruedo.page.now.playback.now - (begin + end) / 2) < 0.2 * (end - begin),
    given,
  );
  // 30 s of them: at 20 Hz or more, of a robot that goes round.
  await until(
    "standard plots show what was before",
    () =>
      window.ruedo.pages.speed.data[0].length > 300 &&
      window.ruedo.pages.error.data[0].length > 300,
  );
  const path = await page.evaluate(() => window.ruedo.pages.path.points[0]);
  check(
    "and the path, as y over x",
    path.length > 300 && Math.max(...path.map(([, y]) => y)) > 0.05,
    path.length,
  );
  await picture("fields-log");
  await page.locator(".xy").first().scrollIntoViewIfNeeded();
  await picture("path-log");
  check("(it is seen)", true);
}
