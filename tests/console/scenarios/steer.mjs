// The basic controls in short: pause, step, drive, place, rate, reset. For each transport;
// controls.mjs has the details.
export default async function steer({ page, seen, until, ready, server, serverIs, fact, check }) {
  await page.setViewportSize({ width: 900, height: 300 }); // software draws every pixel
  await ready();
  await page.locator("#canvas").focus();
  const state = (text) =>
    until(
      `(it is ${text})`,
      (wanted) => document.getElementById("state").textContent === wanted,
      text,
    );
  await page.keyboard.press(" ");
  await state("paused");
  seen("space pauses");
  const held = await server();
  await page.keyboard.press(".");
  await until("(a step)", (t) => window.ruedo.page.now.time_s > t, held.utime * 1e-6);
  check("a step is taken", (await server()).step === held.step + 1);
  await page.keyboard.press(" ");
  await state("running");
  seen("space goes on");
  const begin = await fact("pose");
  await page.keyboard.down("KeyW");
  await until(
    "W drives",
    (from) => parseFloat(document.querySelector('[data-fact="pose"]').textContent) > from + 0.2,
    begin,
  );
  await page.keyboard.up("KeyW");
  await page.getByLabel("rate").selectOption("0.25");
  await serverIs("a rate is taken", ({ rate }) => rate === 0.25);
  await page.keyboard.press("b");
  await page.locator("#canvas").click({ position: { x: 420, y: 150 } }); // above the time line
  await until("a box is placed", () =>
    window.ruedo.page.now.world.bodies.some((b) => b.name === "box/link"),
  );
  await page.locator("#canvas").focus();
  await page.keyboard.press("r");
  await page.keyboard.press("Enter"); // confirms
  await until(
    "reset takes it away",
    () => !window.ruedo.page.now.world.bodies.some((b) => b.name === "box/link"),
  );
}
