// A world is edited as by a user: drawn, placed, moved by handles and numbers, cut, undone,
// settled, saved.
export default async function edit({ page, seen, until, check, picture, still, onScreen, given }) {
  await page.setViewportSize({ width: 1100, height: 640 });
  await until(
    "(the world is drawn)",
    () =>
      window.ruedo?.page.now.world &&
      window.ruedo.stage.bodies.description &&
      window.ruedo.stage.frames > 1,
  );
  check(
    "it opens with the page World",
    (await page.getByRole("tab", { name: "World" }).getAttribute("aria-selected")) === "true",
  );
  await until("it says where it saves to", () =>
    /Save to .*\.sdf/.test(document.getElementById("save")?.textContent ?? ""),
  );
  await page.keyboard.press("3");
  const has = (name) =>
    until(`(${name} is there)`, (wanted) => window.ruedo.editor.find(wanted) !== undefined, name);
  const gone = (name) =>
    until(`(${name} is gone)`, (wanted) => window.ruedo.editor.find(wanted) === undefined, name);
  const drag = async (from, to, meanwhile = () => undefined) => {
    await page.mouse.move(...(await onScreen(...from)));
    await page.mouse.down();
    await page.mouse.move(...(await onScreen((from[0] + to[0]) / 2, (from[1] + to[1]) / 2)), {
      steps: 3,
    });
    await page.mouse.move(...(await onScreen(...to)), { steps: 3 });
    await meanwhile();
    await page.mouse.up();
  };
  const pose = (name) => page.evaluate((wanted) => window.ruedo.editor.pose(wanted), name);
  const near = (a, b, within = 1e-3) => a && b.every((v, i) => Math.abs(v - a[i]) < within);
  const tool = (name) => page.locator(`[data-tool="${name}"]`).click();

  // ---- drawn
  await tool("wall");
  await drag([-2, 1], [1, 1]);
  await has("wall");
  check(
    "a wall stands where it was drawn",
    near(await pose("wall"), [-0.5, 1, 0, 1, 0, 0, 0]),
    JSON.stringify(await pose("wall")),
  );
  for (const odd of ["1e7", ""]) {
    await page.getByLabel("wall height").fill(odd);
    await page.getByLabel("wall height").press("Tab");
    await until(
      `a height that no wall has is refused: "${odd}"`,
      () =>
        document.querySelector('[aria-label="wall height"]').value === "1.2" &&
        window.notes.some((note) => /^wall height: a number from/.test(note)),
    );
  }
  await tool("room");
  await drag([-2, -2], [1, 0], async () => {
    const differs = await page.evaluate(() => {
      const { stage, draw } = window.ruedo,
        picture = (visible) => {
          draw.ghost.visible = visible;
          stage.redraw();
          return document.getElementById("canvas").toDataURL();
        };
      return picture(false) !== picture(true);
    });
    check("the unfinished drawing is visible", differs, "the same picture without it");
  });
  await has("room");
  check(
    "a room stands where it was drawn",
    near(await pose("room"), [-0.5, -1, 0, 1, 0, 0, 0]),
    JSON.stringify(await pose("room")),
  );
  await tool("door");
  await page.mouse.click(...(await onScreen(-0.5, 1, 1.2)));
  await until("a door is cut", () => window.ruedo.page.now.edits.undo === "door in wall");
  await has("wall");

  // ---- placed
  await tool("select");
  await page.getByLabel("what to place").selectOption({ label: "a box" });
  await page.locator("#place").click();
  await page.mouse.click(...(await onScreen(1.7, 0.5)));
  await has("box");
  await until(
    "pictures of the library are there",
    () =>
      [...document.querySelectorAll("#library button")].length > 5 &&
      [...document.querySelectorAll("#library img")].every((image) => image.naturalWidth > 0),
  );
  await page.locator('[data-library="p3dx"]').click();
  await page.mouse.click(...(await onScreen(-0.5, -1)));
  await has("p3dx");
  seen("a robot from the library stands there");
  await picture("edit");

  // ---- selected, moved
  await page.mouse.click(...(await onScreen(1.7, 0.5, 0.4)));
  await until("a click selects", () => window.ruedo.page.now.selected === "box");
  const shownX = await page.locator('[data-number="x"]').inputValue();
  for (const odd of ["", "1e300"]) {
    await page.locator('[data-number="x"]').fill(odd);
    await page.locator('[data-number="x"]').press("Enter");
    await until(
      `what is no place is taken back: "${odd}"`,
      (shown) => document.querySelector('[data-number="x"]').value === shown,
      shownX,
    );
  }
  await page.locator('[data-number="x"]').fill("2.25");
  await page.locator('[data-number="x"]').press("Enter");
  await until("numbers move it", () => Math.abs(window.ruedo.editor.pose("box")[0] - 2.25) < 1e-6);
  await page.locator("#canvas").focus();
  await page.locator('[data-number="yaw"]').fill("30");
  await page.locator('[data-number="yaw"]').press("Tab");
  await until(
    "numbers turn it",
    () =>
      Math.abs(
        2 * Math.atan2(window.ruedo.editor.pose("box")[6], window.ruedo.editor.pose("box")[3]) -
          Math.PI / 6,
      ) < 1e-6,
  );
  const before = await pose("box"),
    [hx, hy] = await onScreen(before[0], before[1], before[2]);
  await page.mouse.move(hx + 60, hy); // the handle along x, seen from above
  await until("(the pointer is on a handle)", () => window.ruedo.gizmo.seized);
  await page.mouse.down();
  await page.mouse.move(hx + 90, hy, { steps: 4 });
  await page.mouse.move(hx + 120, hy, { steps: 4 });
  await page.mouse.up();
  await until("a handle moves it", (x) => window.ruedo.editor.pose("box")[0] > x + 0.05, before[0]);
  const moved = await pose("box");
  check(
    "along one axis, with a snap",
    Math.abs(moved[1] - before[1]) < 1e-6 && Math.abs(moved[2] - before[2]) < 1e-6,
    JSON.stringify([before, moved]),
  );
  await page.locator("#find-model").fill("roo");
  await page.locator("#find-model").press("Enter");
  await until("the tree's search selects", () => window.ruedo.page.now.selected === "room");
  await page.locator("#find-model").fill("");
  await page.locator("#canvas").focus();

  // ---- fixed models; copies, and removal
  await page.locator('[data-model="wall"]').click();
  await page.locator('[data-number="y"]').fill("1.5");
  await page.locator('[data-number="y"]').press("Enter");
  await until("a wall is moved", () => Math.abs(window.ruedo.editor.pose("wall")[1] - 1.5) < 1e-6);
  const moved_wall = await pose("wall");
  await page.locator("#duplicate").click();
  await has("wall_2");
  const apart = (await pose("wall_2")).map((v, i) => v - moved_wall[i]);
  check(
    "a copy finds room: the nearest is behind it",
    Math.abs(apart[0]) < 1e-6 && Math.abs(Math.abs(apart[1]) - 0.2) < 1e-3,
    JSON.stringify(apart),
  );
  seen("a copy stands beside it");
  await page.locator("#canvas").focus();
  await page.keyboard.press("Delete");
  await gone("wall_2");
  seen("it is deleted");
  await page.keyboard.press("Control+z");
  await has("wall_2");
  await page.keyboard.press("Control+z");
  await gone("wall_2");
  seen("undo takes both back");
  await page.keyboard.press("Control+y");
  await has("wall_2");
  seen("redo does it again");
  await page.locator('[data-model="box"]').click();
  await page.locator('[aria-label="factor along z"]').fill("2");
  await page.locator("#scale").click();
  await until("it is scaled", () => window.ruedo.page.now.edits.undo === "scale box");
  await has("box");

  // ---- its properties; the box is 0.4 m wide and 0.8 m high by now, of 100 kg/m^3
  await page.locator('[data-model="box"]').click();
  const property = (name) => page.locator(`[data-property="${name}"]`);
  await until("properties are those of its text", () => {
    const value = (name) => document.querySelector(`[data-property="${name}"]`).value;
    return (
      Number(value("mass")) === 12.8 &&
      ["size-x", "size-y", "size-z"].map(value).join() === "0.4,0.4,0.8"
    );
  });
  // Not by until(), which takes the promise of the text for the answer.
  const becomes = async (what, pattern) => {
    const textOfSelected = () =>
      page.evaluate(async () => {
        const { editor, page } = window.ruedo;
        return (await editor.textOf(page.now.selected)) ?? "";
      });
    const end = performance.now() + 60_000;
    let text = await textOfSelected();
    while (!pattern.test(text) && performance.now() < end) text = await textOfSelected();
    check(what, pattern.test(text), text);
  };
  await property("size-x").fill("0.5");
  await property("size-x").press("Tab");
  await becomes("a size in metres", /<size>0\.5 0\.4 0\.8<\/size>/);
  await property("mass").fill("20");
  await property("mass").press("Tab");
  await becomes("a mass", /<mass>20<\/mass>/);
  await property("colour").fill("#ff8000");
  await becomes("a colour", /<diffuse>1 0\.502 0 1<\/diffuse>/);
  await page.locator("#elements > summary").click();
  const branch = (name) =>
    page.locator("#elements details > summary").filter({ hasText: name }).first();
  for (const name of [/^collision box$/, /^surface$|^geometry$/, /^box$/])
    if (!(await branch(name).evaluate(({ parentElement }) => parentElement.open)))
      await branch(name).click();
  const size = page.locator('#elements [data-element="size"]').filter({ visible: true }).first();
  await size.fill("0.5 0.3 0.8");
  await size.press("Tab");
  await becomes("any element", /<collision[^]*<size>0\.5 0\.3 0\.8<\/size>[^]*<visual/);
  await size.fill("much");
  await size.press("Tab");
  await until("what cannot be is refused in words", () =>
    window.notes.some((note) => /<size> takes 3 numbers/.test(note)),
  );
  await until(
    "(and taken back)",
    () => document.querySelector('#elements [data-element="size"]')?.value === "0.5 0.3 0.8",
  );
  await size.fill("0.5 0.4 0.8");
  await size.press("Tab");
  await becomes("(and back)", /<collision[^]*<size>0\.5 0\.4 0\.8<\/size>[^]*<visual/);
  await page.locator("#elements > summary").click();
  await property("static").check();
  await becomes("fixed", /<static>true<\/static>/);
  await property("static").uncheck();
  await becomes("and movable", /<static>false<\/static>/);
  await property("name").fill("crate");
  await property("name").press("Enter");
  await has("crate");
  await page.locator("#properties").scrollIntoViewIfNeeded();
  await picture("properties");
  await until("a name", () => window.ruedo.page.now.selected === "crate");
  await property("name").fill("box");
  await property("name").press("Enter");
  await has("box");

  // ---- settled: the box, now 0.8 m high, was put back where it stood before: its lower half in
  // the ground
  await page.locator('[data-model="box"]').click();
  await page.locator('[data-number="z"]').fill("1");
  await page.locator('[data-number="z"]').press("Enter");
  await until(
    "(it hangs in the air)",
    () => Math.abs(window.ruedo.editor.pose("box")[2] - 1) < 1e-6,
  );
  await page.locator("#settle").click();
  await until(
    "physics settles it",
    () =>
      window.ruedo.page.now.edits.undo === "settle" &&
      window.ruedo.page.now.paused &&
      Math.abs(window.ruedo.editor.pose("box")[2] - 0.4) < 5e-3,
  );

  // ---- saved
  await page.locator("#canvas").focus();
  await page.keyboard.press("Control+s");
  await until("it is saved", () => window.notes.some((note) => /^Saved to/.test(note)));
  await until(
    "nothing is left to save",
    () => !/•/.test(document.getElementById("save")?.textContent),
  );
  console.log(
    `poses: ${JSON.stringify(await page.evaluate(() => Object.fromEntries(window.ruedo.editor.models.map(({ name }) => [name, window.ruedo.editor.pose(name)]))))}`,
  );
  await page.setViewportSize({ width: 390, height: 844 });
  await still();
  await picture("edit-phone");
  if (given?.dark) await picture("edit-dark");
}
