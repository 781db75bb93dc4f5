// A past moment of a run is saved, to go on from there. Prints the moment, and the command.
export default async function branch({ page, seen, until, check, ready, picture }) {
  await page.setViewportSize({ width: 1000, height: 460 }); // software draws every pixel
  await ready();
  await page.locator("#canvas").focus();
  await page.keyboard.down("KeyW");
  await until("(it drives)", () => window.ruedo.poses.to[0] > 1);
  await page.keyboard.down("KeyA");
  await until("(and turns)", () => Math.abs(window.ruedo.poses.to[1]) > 0.3);
  check("the present has no branch", !(await page.locator("#branch").isVisible()));
  // A past state, while the run continues with its robot driving.
  await page.evaluate(() => {
    const { rewind } = window.ruedo;
    rewind.show(rewind.range.end - 0.8);
    rewind.step(false);
  });
  await until("(the past is shown)", () => window.ruedo.page.now.past);
  const time = await page.evaluate(() => window.ruedo.page.now.past.now);
  await page.locator("#branch").click();
  await until("its command is shown", () => document.getElementById("command")?.textContent);
  const command = await page.locator("#command").innerText();
  seen(`branch ${JSON.stringify({ time, command })}`);
  await picture("branch");
  await page.keyboard.press("Escape");
  await until("Esc closes it", () => !document.querySelector("dialog[open]"));
}
