// Panels beside the scene: their places, further views and cameras, notes, messages and faults by
// hand, a part of the time line.
export default async function panels({ page, until, check, ready, still, picture }) {
  await page.setViewportSize({ width: 1100, height: 600 });
  await ready();
  await arrange({ page, until, check, still, picture });

  // ---- a message by hand
  await page.getByRole("tab", { name: "Channels" }).click();
  await page.locator("#publish summary").click();
  await page.getByLabel("channel to publish on").selectOption("p3at/velocity");
  const send = async (text) => {
    await page.getByLabel("message", { exact: true }).fill(text);
    await page.locator("#send").click();
    return page.locator("#published").innerText();
  };
  const refused = await send('{"utime": 0, "vx": "fast", "vy": 0, "omega": 0}');
  check("its type is checked", /vx is a number/.test(refused), refused);
  const x = await page.evaluate(() => window.ruedo.poses.to[0]);
  await send('{"utime": 0, "vx": 0.5, "vy": 0, "omega": 0}');
  await until(
    "a message that is written moves the robot",
    (from) => window.ruedo.poses.to[0] > from + 0.02,
    x,
  );
  await picture("publish");

  // ---- a fault
  await page.getByRole("tab", { name: "Robot" }).click();
  await page.locator("#faults summary").click();
  await page.getByLabel("fault", { exact: true }).selectOption("weak_motor");
  await page.getByLabel("how much").fill("7");
  await page.locator("#fault").click();
  await until("a fault that there is not is refused", () =>
    window.notes.some((note) => /^weak_motor: a number from 0 to 1/.test(note)),
  );
  await page.getByLabel("how much").fill("0.5");
  await page.locator("#fault").click();
  await until("a fault is injected, and one of the events", () =>
    window.ruedo.page.now.events.some(({ kind }) => kind === "fault"),
  );
  await picture("faults");

  // ---- notes
  await page.getByRole("tab", { name: "Notes" }).click();
  check(
    "notes are kept",
    /weak_motor: a number from 0 to 1/.test(await page.locator("#notes").innerText()),
    await page.locator("#notes").innerText(),
  );
  await picture("notes");

  // ---- the time line
  await until(
    "(there is a past)",
    () => window.ruedo.page.now.kept.end - window.ruedo.page.now.kept.begin > 3,
  );
  const lane = await page.locator("#events").boundingBox();
  await page.mouse.move(lane.x + lane.width / 2, lane.y + 5);
  const length = () =>
    page.evaluate(() => {
      const { span } = window.ruedo.page.now;
      return span ? span.end - span.begin : 1e9;
    });
  for (let i = 0; i < 4; ++i) {
    const before = await length();
    await page.mouse.wheel(0, -100);
    await until(
      "(a turn of the wheel came)",
      (before) => {
        const { span } = window.ruedo.page.now;
        return span !== null && span.end - span.begin < before;
      },
      before,
    );
  }
  await until("the wheel zooms the time line", () => {
    const { min, max } = document.getElementById("scrub"),
      { kept } = window.ruedo.page.now;
    return (max - min) / (kept.end - kept.begin) < 0.6;
  });
  await page.locator("#events").dblclick();
  await until("and a double click shows everything", () => window.ruedo.page.now.span === null);
}

// Panels are resized, moved beside each other, closed and opened again; further views are added.
async function arrange({ page, until, check, still, picture }) {
  const box = (selector) => page.locator(selector).boundingBox(),
    width = async () => (await box(".page")).width;
  const before = await width(),
    edge = page.getByRole("separator", { name: "edge between panels" }),
    { x, width: thick } = await edge.boundingBox();
  await page.mouse.move(x + thick / 2, 200);
  await page.mouse.down();
  await page.mouse.move(x + thick / 2 - 100, 200, { steps: 3 });
  await page.mouse.up();
  check("the panel is dragged wider", Math.abs((await width()) - before - 100) < 3, await width());
  await edge.focus();
  await page.keyboard.press("ArrowRight");
  check("and moved by keys", Math.abs((await width()) - before - 80) < 3, await width());

  // The view takes the room of a window that grows, and gives it back.
  const kept = await width();
  for (const wide of [1900, 1100]) {
    await page.setViewportSize({ width: wide, height: 600 });
    await until("(it is arranged)", (w) => window.innerWidth === w, wide);
    await page.waitForFunction((w) => document.getElementById("dock").clientWidth === w, wide);
    await until(
      `the panel keeps its width in a window of ${wide} pixels`,
      (kept) => Math.abs(document.querySelector(".page").getBoundingClientRect().width - kept) < 3,
      kept,
    );
  }

  const view = await box("#view"),
    tab = (name) => page.getByRole("tab", { name });
  await tab("Plots").dragTo(page.locator("#canvas"), {
    targetPosition: { x: view.width / 2, y: view.height - 20 },
  });
  await until("a page is dragged below the view, and both pages are seen", () => {
    const { shown } = window.ruedo.page.now;
    return shown.has("Plots") && shown.has("Robot");
  });
  await until("(and drawn)", () => document.querySelectorAll(".plot canvas").length === 3);
  const plots = await page.locator(".plot").first().boundingBox(),
    left = await box("#view");
  check(
    "it is below what is left of the view",
    plots.y > left.y + left.height - 1 && left.height < view.height - 100 && plots.x < 100,
    JSON.stringify([plots, left]),
  );
  await until("the view fills its part", () => {
    const { aspect } = window.ruedo.stage.view.camera,
      { clientWidth, clientHeight } = document.getElementById("view");
    return Math.abs(aspect - clientWidth / clientHeight) < 0.02;
  });
  await picture("arranged");

  const menu = (name) => page.locator("#panels").getByText(name, { exact: true }).click();
  await page.locator("#open-panels").click();
  await menu("Notes");
  await tab("Notes").waitFor({ state: "detached" });
  await menu("Notes");
  await tab("Notes").waitFor();
  await menu("Add a 3-D view");
  await until("another 3-D view is drawn", () => {
    const canvas = document.querySelector(".scene-panel canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return new Set(data.filter((_, i) => i % 4 === 0)).size > 20;
  });
  const place = await page.evaluate(() => window.ruedo.stage.view.at);
  const other = await box(".scene-panel canvas");
  await page.mouse.move(other.x + other.width / 2, other.y + other.height / 2);
  await page.mouse.down();
  await page.mouse.move(other.x + other.width / 2 + 80, other.y + other.height / 2, { steps: 4 });
  await page.mouse.up();
  await until(
    "it is turned by itself",
    (main) => {
      const { panels } = window.ruedo.dock.kept,
        at = Object.values(panels).find(({ contentComponent: kind }) => kind === "scene").params
          ?.at;
      return at && Math.hypot(at[0] - main[0], at[1] - main[1]) > 0.3;
    },
    place,
  );
  const same = await page.evaluate(() => window.ruedo.stage.view.at);
  check(
    "and the first view stays",
    same.every((value, i) => Math.abs(value - place[i]) < 1e-6),
    JSON.stringify([same, place]),
  );
  await picks({ page, until, check, still });
  await page.locator("#open-panels").click();
  await page.getByLabel("add a camera").selectOption("p3at/camera");
  await page.keyboard.press("Escape");
  await until("a camera has a panel", () => {
    const canvas = document.querySelector(".camera-panel canvas");
    return canvas?.checkVisibility() && canvas.width > 100;
  });
  await picture("views");

  await page.reload();
  const again = (what) =>
    until(what, () => {
      const { shown } = window.ruedo?.page.now ?? {};
      return (
        shown?.has("Plots") &&
        shown.has("Notes") &&
        document.querySelector(".scene-panel canvas")?.width > 100 &&
        document.querySelector(".camera-panel canvas")?.checkVisibility()
      );
    });
  await again("all is there again after a reload");
  const notes = tab("Notes");
  await tab("World").click();
  await page.locator("#link").click();
  await until("(there is a link)", () => location.hash.includes("layout"));
  await notes.click();
  await page.evaluate(() => localStorage.clear());
  await page.reload();
  await until(
    "a link leads to the same arrangement",
    () =>
      window.ruedo?.page.now.shown.has("World") &&
      document.querySelector(".scene-panel canvas")?.width > 100 &&
      document.querySelectorAll(".camera-panel").length === 1,
  );
  await page.locator("#open-panels").click();
  await menu("Usual layout");
  await until(
    "and in its usual place when that is wanted",
    () =>
      !document.querySelector(".scene-panel, .camera-panel") &&
      document.querySelectorAll('[role="tab"]').length === 6 &&
      window.ruedo.page.now.shown.size === 1,
  );
  await until("one view is drawn then", () => window.ruedo.stage.further.size === 0);
}

// A click in a further view selects the thing that is visible there, from that view's camera.
async function picks({ page, until, check, still }) {
  const onFurther = ([x, y, z]) =>
    page.evaluate(
      (place) => {
        const [view] = window.ruedo.stage.further,
          { left, top, width, height } = view.canvas.getBoundingClientRect(),
          { camera } = view.view;
        camera.updateMatrixWorld();
        const at = camera.position
          .clone()
          .set(...place)
          .project(camera);
        return [left + ((at.x + 1) / 2) * width, top + ((1 - at.y) / 2) * height];
      },
      [x, y, z],
    );
  const tool = (name) => page.evaluate((tool) => window.ruedo.page.set({ tool }), name);
  // Of the robot's own place on the floor, 1 m aside
  const [x, y] = await page.evaluate(() => [...window.ruedo.poses.now.slice(0, 2)]);
  const there = [x + 1, y - 1, 0];
  await still(true);
  const [px, py] = await onFurther(there);
  await page.mouse.move(px, py);
  await until(
    "a further view has coordinates under the pointer",
    ([x, y]) => {
      const [a, b] = document.getElementById("coordinates").textContent.split(", ").map(parseFloat);
      return Math.abs(a - x) < 0.05 && Math.abs(b - y) < 0.05;
    },
    there,
  );
  await tool("measure");
  for (const to of [there, [x + 1, y + 1, 0]]) {
    const [mx, my] = await onFurther(to);
    await page.mouse.click(mx, my);
  }
  await until("a way is measured in a further view", () =>
    /^(1\.9[5-9]|2\.0[0-5]) m/.test(document.getElementById("coordinates")?.textContent),
  );
  await tool("select");
  await page.getByRole("tab", { name: "World" }).click();
  const box = await page.evaluate(() => {
    const { stage } = window.ruedo,
      model = stage.bodies.description.models.find(({ name }) => name === "box_1"),
      { min, max } = stage.bodies.boxOf(model);
    return [(min.x + max.x) / 2, (min.y + max.y) / 2, max.z];
  });
  const [bx, by] = await onFurther(box);
  await page.mouse.click(bx, by);
  await until(
    "a click there selects the model that is seen",
    () => window.ruedo.page.now.selected === "box_1",
  );
  await page.evaluate(() => window.ruedo.page.set({ selected: "" }));
  await page.getByRole("tab", { name: "Notes" }).click();
  check("(picked)", true);
}
