// A log that the page records. Given: {"file": where it is to be saved}.
export default async function record({ page, given, until, check, ready }) {
  await ready();
  await page.getByRole("tab", { name: "World" }).click();
  const button = page.locator("#record-log");
  await button.click();
  await page.locator("#canvas").focus();
  const x = await page.evaluate(() => window.ruedo.poses.to[0]);
  await page.keyboard.down("w");
  await until("(it drives)", (from) => window.ruedo.poses.to[0] > from + 0.3, x);
  await page.keyboard.up("w");
  await until("the size is shown", () =>
    /^Stop log \(\d+\.\d MB\)$/.test(document.getElementById("record-log")?.textContent),
  );
  const [download] = await Promise.all([page.waitForEvent("download"), button.click()]);
  await download.saveAs(given.file);
  check(
    "it is called after its world",
    /^arena_\d+\.\d\ds\.lcm$/.test(download.suggestedFilename()),
    download.suggestedFilename(),
  );
  await until(
    "and can be recorded again",
    () => document.getElementById("record-log").textContent === "Record log",
  );
}
