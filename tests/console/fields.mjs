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
    if (await page.locator(`tr[data-channel="${channel}"] + tr [data-field]`).count()) return;
    await page.locator(`tr[data-channel="${channel}"]`).click();
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
    document.getElementById("tab-Plots").dispatchEvent(event("dragover"));
    document.getElementById("fields").dispatchEvent(event("drop"));
  });
  await until("a drag onto Plots does, too", () => window.ruedo.plots.panes[0].series.length === 2);
  const before = await points(0);
  await until(
    "the plot grows",
    (n) => window.ruedo.plots.panes[0].series.every(({ times }) => times.length > n / 2 + 10),
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
  await page.reload();
  await until("panes are kept", () => window.ruedo?.plots.panes[0]?.series.length === 2);
}
