// The numbers of the selected model, while it moves.
export default async function numbers({ page, until, check, ready, server }) {
  await page.setViewportSize({ width: 1000, height: 520 });
  await ready();
  const x = () => page.evaluate(() => window.ruedo.editor.pose("p3at")[0]);
  await page.getByRole("tab", { name: "World" }).click();
  await page.locator('[data-model="p3at"]').click();
  const field = page.locator('[data-number="x"]');
  await field.focus(); // from here on it shows where the robot was
  const stale = Number(await field.inputValue());
  await page.evaluate(() => {
    const { control } = window.ruedo;
    control.move({ kind: 1, value: 0.6, radius: 0, speed: 0, acceleration: 0, deceleration: 0 });
  });
  await until(
    "the robot goes on while its number is edited",
    (from) => window.ruedo.editor.pose("p3at")[0] > from + 0.2,
    stale,
  );
  for (const [what, typed] of [
    ["Enter alone", null],
    ["an emptied field", ""],
    ["what is no place", "1e300"],
  ]) {
    const before = await x();
    if (typed !== null) await field.fill(typed);
    await field.press("Enter");
    const { utime } = await server(); // answered after any request of the field
    await until("(time passes)", (s) => window.ruedo.page.now.time_s > s, utime * 1e-6);
    const after = await x();
    check(`${what} does not move the robot`, after > before - 0.01, `${before} to ${after}`);
    if (typed !== null)
      await until(
        `${what} is taken back`,
        (wrong) => {
          const { value } = document.querySelector('[data-number="x"]');
          return value !== wrong && value !== "" && Math.abs(Number(value)) < 1;
        },
        typed,
      );
  }
  const asked = await page.evaluate(() =>
    window.ruedo.page.now.events.filter(({ kind }) => kind === "request").map(({ text }) => text),
  );
  check("and sends no request to the run", asked.length === 0, asked.join());
  check("nor is it an edit", await page.evaluate(() => window.ruedo.page.now.edits.changes === 0));
}
