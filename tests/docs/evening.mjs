// The world of docs/getting-started.md, drawn as that page says, and saved.
export default async function evening({ page, until, picture, still, onScreen, given }) {
  await page.setViewportSize({ width: 1100, height: 640 });
  await until(
    "(the floor is drawn)",
    () =>
      window.ruedo?.page.now.world &&
      window.ruedo.stage.bodies.description &&
      window.ruedo.stage.frames > 1,
  );
  await page.keyboard.press("3"); // from above
  const has = (name) =>
    until(`(${name} is there)`, (wanted) => window.ruedo.editor.find(wanted) !== undefined, name);
  const tool = (name) => page.locator(`[data-tool="${name}"]`).click();
  await tool("room");
  await page.mouse.move(...(await onScreen(-2, -1.5)));
  await page.mouse.down();
  await page.mouse.move(...(await onScreen(0, 0)), { steps: 3 });
  await page.mouse.move(...(await onScreen(2, 1.5)), { steps: 3 });
  await page.mouse.up();
  await has("room");
  await tool("select");
  await page.getByLabel("what to place").selectOption({ label: "a box" });
  await page.locator("#place").click();
  await page.mouse.click(...(await onScreen(1.2, 0.9)));
  await has("box");
  await until(
    "(the library is there)",
    () => document.querySelectorAll("#library button").length > 5,
  );
  await page.locator('[data-library="p3dx"]').click();
  await page.mouse.click(...(await onScreen(-0.8, -0.5)));
  await has("p3dx");
  await still();
  if (given?.pictures) await picture("evening-draw");
  await page.keyboard.press("Control+s");
  await until("saved", () => window.notes.some((note) => /^Saved to/.test(note)));
}
