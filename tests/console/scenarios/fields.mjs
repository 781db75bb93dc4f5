// Any field of any channel, by a click or a drag; statistics, a table, and panes that are kept.
import { readFileSync } from "node:fs";

export default async function fields({ page, until, check, ready, picture }) {
  await page.setViewportSize({ width: 1000, height: 560 });
  await ready();
  await page.locator("#canvas").focus();
  await page.keyboard.down("KeyW");
  await until("(it drives)", () => window.ruedo.poses.to[0] > 0.3);
  await page.keyboard.up("KeyW");
  await page.getByRole("tab", { name: "Channels" }).click();
  const open = async (channel) => {
    await page.getByRole("tab", { name: "Channels" }).click();
    const row = page.locator(`tr[data-channel="${channel}"]`);
    await row.waitFor();
    if (!(await row.locator("+ tr:not([data-channel])").count())) await row.click();
    await row.locator("+ tr [data-field]").first().waitFor(); // with the next message
  };
  await open("p3at/odometry");
  await page.locator('[data-field="x"]').click();
  const points = (series) =>
    page.evaluate((i) => window.ruedo.plots.panes[0]?.series[i]?.times.length ?? 0, series);
  await until(
    "a click on a field plots it",
    () => window.ruedo.page.now.tab === "Plots" && document.querySelectorAll(".pane").length === 1,
  );
  await open("p3at/odometry");
  // By hand: the target page opens during the drag, and Playwright's dragTo would wait for it.
  await page.evaluate(() => {
    const data = new DataTransfer(),
      event = (type) =>
        new DragEvent(type, { dataTransfer: data, cancelable: true, bubbles: true });
    document.querySelector('[data-field="theta"]').dispatchEvent(event("dragstart"));
    document.querySelector('[data-tab-panel-id="Plots"]').dispatchEvent(event("dragover"));
    document.getElementById("fields").dispatchEvent(event("drop"));
  });
  await until("a drag onto Plots does, too", () => window.ruedo.plots.panes[0].series.length === 2);
  const before = await points(0);
  await until(
    "the plot grows",
    (n) => window.ruedo.plots.panes[0].series.every(({ times }) => times.length > n / 2 + 20),
    before,
  );
  await until("(statistics)", () =>
    /\d/.test(document.querySelector(".statistics .number")?.textContent),
  );
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page.getByRole("button", { name: "CSV" }).click(),
  ]);
  const table = readFileSync(await download.path(), "utf8").split("\n");
  check(
    "it is a table",
    table[0] === "time_s,p3at/odometry x,p3at/odometry theta" &&
      table.length > 20 &&
      table[1].split(",").every((cell) => Number.isFinite(Number(cell))),
    table.slice(0, 3).join(" | "),
  );
  await page.locator(".pane").scrollIntoViewIfNeeded();
  await picture("fields");
  // ---- formulas
  await page.getByLabel("channel to plot").selectOption("p3at/lrf");
  await until("every element of an array is offered", () => {
    const offered = [...document.querySelectorAll("#offered-fields option")].map((o) => o.value);
    return offered.includes("ranges[180]") && offered.includes("min(ranges)");
  });
  const plot = async (text, apart = false) => {
    await page.getByLabel("field to plot").fill(text);
    await page.locator(apart ? "#plot-apart" : "#plot").click();
  };
  const newest = (text) =>
    page.evaluate((wanted) => {
      const all = window.ruedo.plots.panes.flatMap(({ series }) => series);
      return all.find(({ path }) => path === wanted)?.values.at(-1) ?? NaN;
    }, text);
  const grows = (text, what) =>
    until(
      what,
      (wanted) =>
        window.ruedo.plots.panes.flatMap(({ series }) => series).find(({ path }) => path === wanted)
          ?.values.length > 5,
      text,
    );
  await plot("min(ranges)", true);
  await grows("min(ranges)", "(it grows)");
  const nearest = await page.evaluate(() =>
    Math.min(...window.ruedo.plots.newest.get("p3at/lrf").ranges.filter(Number.isFinite)),
  );
  check(
    "a formula over an array is plotted",
    Math.abs((await newest("min(ranges)")) - nearest) < 0.3,
    `${await newest("min(ranges)")} and ${nearest}`,
  );
  const apart = "{p3at/pose pos[0]} - {p3at/odometry x}";
  await plot(apart);
  await grows(apart, "a formula over two channels is plotted");
  check("(both are near each other)", Math.abs(await newest(apart)) < 0.2, await newest(apart));
  await plot("min(ranges");
  await until("what is no formula is refused in words", () =>
    window.notes.some((note) => /"\)" is missing/.test(note)),
  );
  await open("p3at/odometry");
  await page.evaluate(() => {
    const data = new DataTransfer(),
      event = (type) =>
        new DragEvent(type, { dataTransfer: data, cancelable: true, bubbles: true });
    document.querySelector('[data-field="v"]').dispatchEvent(event("dragstart"));
    document.querySelector(".page").dispatchEvent(event("drop"));
  });
  await until(
    "a drop anywhere on the panel plots",
    () =>
      window.ruedo.page.now.tab === "Plots" &&
      window.ruedo.plots.panes.at(-1).series.some(({ path }) => path === "v"),
  );

  // ---- one infinite value
  const scales = await page.evaluate(() => {
    const { plots, pages } = window.ruedo,
      [pane] = plots.panes,
      [{ values }] = pane.series;
    values[values.length >> 1] = Infinity;
    pane.touch();
    pane.draw(0, performance.now());
    pages.speed.add(0, pages.speed.data[0].at(-1), -Infinity);
    pages.speed.draw();
    return [pane.plot, pages.speed.plot].map(({ scales: { y } }) => [y.min, y.max]);
  });
  check(
    "one infinite value hides no others",
    scales.every(([low, high]) => low > -100 && high < 100 && high > low + 0.01),
    JSON.stringify(scales),
  );

  await page.getByLabel("channel to plot").selectOption("ruedo/tick");
  await plot("run_id", true); // some 2^60, the same always
  await until("a large number has an axis", () => {
    const { plot, series } = window.ruedo.plots.panes.at(-1),
      { min, max } = plot?.scales.y ?? {};
    return series[0].path === "run_id" && series[0].values.length > 5 && max - min > 1e9;
  });
  await page.locator(".pane").last().getByTitle("close this pane").click();

  // ---- zoomed, and over each other
  const over = page.locator(".pane .u-over").first();
  await over.scrollIntoViewIfNeeded();
  const { x, y, width, height } = await over.boundingBox();
  await page.mouse.move(x + 0.3 * width, y + height / 2);
  await page.mouse.down();
  await page.mouse.move(x + 0.6 * width, y + height / 2, { steps: 4 });
  await page.mouse.up();
  await until("panes zoom together", () => {
    const [a, b] = window.ruedo.plots.panes.map(({ plot }) => plot.scales.x);
    return Math.abs(a.min - b.min) < 1e-6 && Math.abs(a.max - b.max) < 1e-6 && a.max - a.min < 1e3;
  });
  await over.dblclick();
  await page.locator(".pane").first().getByRole("button", { name: "x-y" }).click();
  await until(
    "one series is drawn over another",
    () => window.ruedo.plots.panes[0].curves?.points[0].length > 10,
  );
  await picture("curves");
  await page.locator(".pane").nth(1).getByTitle("close this pane").click();
  await page.reload();
  await until(
    "panes are kept",
    () => window.ruedo?.plots.panes[0]?.series.length === 2 && window.ruedo.plots.panes[0].xy,
  );
}
