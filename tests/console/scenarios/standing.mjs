// An existing world, at rest: all of it is visible, and edits of models whose names are any text
// are undone without a trace. Given: {"model": its name, "pose": as
// the page has it in numbers}.
export default async function standing({ page, given, until, check }) {
  await page.waitForFunction(() => window.ruedo?.stage.bodies.description);
  const known = () =>
    window.ruedo.editor.models.every(({ name }) => window.ruedo.editor.pose(name));
  await until("where all models are is known", known);
  const numbers = () =>
    page.evaluate((name) => window.ruedo.editor.pose(name).map((v) => +v.toFixed(3)), given.model);
  const names = () => page.evaluate(() => window.ruedo.editor.models.map(({ name }) => name));
  const are = (pose) => JSON.stringify(pose) === JSON.stringify(given.pose);
  check("a model is where the file has it", are(await numbers()), await numbers());
  await page.getByRole("tab", { name: "World" }).click();
  await page.evaluate((name) => window.ruedo.page.set({ selected: name }), given.model);
  const count = (await names()).length;
  const has = ([n]) => window.ruedo.editor.models.length === n;
  const edits = () => page.evaluate(() => window.ruedo.page.now.edits.changes);
  const does = async (what, action, more) => {
    const before = await edits();
    await action();
    await until(`(${what})`, (n) => window.ruedo.page.now.edits.changes > n, before);
    await until(what, has, [count + more]);
  };
  const undo = () => page.keyboard.press("Control+z");
  await page.locator("#canvas").focus();
  await does("it is copied", () => page.keyboard.press("Control+d"), 1);
  await does("the copy is taken back", undo, 0);
  await page.evaluate((name) => window.ruedo.page.set({ selected: name }), given.model);
  await does("it is deleted", () => page.keyboard.press("Delete"), -1);
  await does("it is there again", undo, 0);
  await until("(it is known)", known);
  check("where it was", are(await numbers()), await numbers());
  await does(
    "it is scaled",
    () => page.evaluate((m) => window.ruedo.editor.scale(m, [2, 2, 2]), given.model),
    0,
  );
  await does("it has its size again", undo, 0);
  await does("physics settles it", () => page.evaluate(() => window.ruedo.editor.settle()), 0);
  await until("(it is known)", known);
  check("it fell", (await numbers())[2] < given.pose[2] - 0.1, await numbers());
  await does("that is taken back", undo, 0);
  await until(
    "it hangs there again",
    ([model, pose]) => {
      const now = window.ruedo.editor.pose(model);
      return now && now.every((v, i) => Math.abs(v - pose[i]) < 2e-3);
    },
    [given.model, given.pose],
  );
  await page.reload();
  await page.waitForFunction(() => window.ruedo?.stage.bodies.description);
  await until("a page that is loaded again knows it, too", known);
  check("as it is", are(await numbers()), await numbers());
  await page.evaluate(() => window.ruedo.editor.save());
}
