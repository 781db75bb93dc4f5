// Drawings of clients, live and from a log. Given: the names of its layers, the times of a log with
// the drawings then, or null for a live run.
export default async function markers({ page, given, seen, until, check, ready, picture }) {
  await ready();
  // For each layer, how many objects it shows, and where its first one is.
  const drawn = () =>
    Object.fromEntries(
      [...window.ruedo.markers.layers].map(([name, { group }]) => [
        name,
        group.visible ? group.children.length : 0,
      ]),
    );
  if (given?.moments) {
    await page.evaluate(() => window.ruedo.link.play(false, 1));
    for (const { time, layers } of given.moments) {
      await page.evaluate((t) => window.ruedo.link.seek(t), time);
      await until(
        `(${JSON.stringify(layers)} at ${time} s)`,
        (expected) => {
          const layers = Object.fromEntries(
            [...window.ruedo.markers.layers].map(([name, { group }]) => [
              name,
              group.children.length,
            ]),
          );
          return JSON.stringify(layers) === JSON.stringify(expected);
        },
        layers,
      );
    }
    seen("each moment shows what was drawn then");
    return;
  }
  await until("what was drawn before the page came is there", () =>
    window.ruedo.markers.layers.has("plan"),
  );
  await until("and is shown", () => window.ruedo.markers.layers.get("plan").group.visible);
  check("all of it", (await page.evaluate(drawn)).plan === 5, await page.evaluate(drawn));
  const kinds = await page.evaluate(() =>
    window.ruedo.markers.layers.get("plan").group.children.map((object) => object.type),
  );
  check(
    "as lines, a path, points, a text and a map",
    kinds.join() === "LineSegments2,LineSegments2,Points,Sprite,Mesh",
    kinds,
  );
  await page.evaluate(() => window.ruedo.stage.view.setMode("top"));
  await picture("markers");
  // The layer moves with its robot.
  const place = () => {
    const { elements } = window.ruedo.markers.layers.get("plan").group.matrix;
    return [elements[12], elements[13]];
  };
  const before = await page.evaluate(place);
  await page.locator("#canvas").focus();
  await page.keyboard.down("KeyW");
  await until(
    "it moves with its robot",
    ([x, y]) => {
      const { elements } = window.ruedo.markers.layers.get("plan").group.matrix;
      return Math.hypot(elements[12] - x, elements[13] - y) > 0.3;
    },
    before,
  );
  await page.keyboard.up("KeyW");
  await page.locator('.chip[data-layer="markers"]').click();
  await until(
    "markers can be switched off",
    () => !window.ruedo.markers.layers.get("plan").group.visible,
  );
  await page.locator('.chip[data-layer="markers"]').click();
  seen("empty the layer");
  await until("an empty layer is gone", () => !window.ruedo.markers.layers.has("plan"));
  // Seeking back shows it again.
  await page.evaluate(() => {
    const { rewind } = window.ruedo;
    rewind.show((rewind.range.begin + rewind.range.end) / 2);
  });
  await until("the past shows what was drawn then", () => window.ruedo.markers.layers.has("plan"));
  await page.keyboard.press("End");
  await until("and the present what is", () => !window.ruedo.markers.layers.has("plan"));
}
