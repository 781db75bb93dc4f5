// The measurements and exports of the view: coordinates, distances, edges, pictures, videos, and
// links back to it.
import { readFileSync } from "node:fs";

export default async function looks({ page, until, check, ready, still, onScreen }) {
  await page.setViewportSize({ width: 1000, height: 520 });
  await ready();
  await page.locator("#canvas").focus();
  await page.keyboard.press(" ");
  await until("(paused)", () => document.getElementById("state").textContent === "paused");
  await page.getByRole("tab", { name: "World" }).click();
  await page.keyboard.press("3");
  const words = () => document.getElementById("coordinates").textContent;
  await page.mouse.move(...(await onScreen(-1, 0.5)));
  await until("coordinates are those under the pointer", () => {
    const [x, y] = document.getElementById("coordinates").textContent.split(",").map(parseFloat);
    return Math.abs(x + 1) < 0.05 && Math.abs(y - 0.5) < 0.05;
  });
  await page.locator("#measure").click();
  await page.mouse.click(...(await onScreen(-1, 0.5)));
  await page.mouse.click(...(await onScreen(-1, -2.5)));
  await until(
    "a way is measured",
    () =>
      Math.abs(parseFloat(document.getElementById("coordinates").textContent) - 3) < 0.05 &&
      /level/.test(document.getElementById("coordinates")?.textContent),
  );
  check("(in words)", true, await page.evaluate(words));
  const differs = await page.evaluate(() => {
    const { stage, measure } = window.ruedo,
      picture = (visible) => {
        measure.line.visible = visible;
        stage.redraw();
        return document.getElementById("canvas").toDataURL();
      };
    return picture(true) !== picture(false);
  });
  check("and seen, over the floor that it lies on", differs, "the same picture without it");
  await page.locator("#measure").click();
  const lines = () =>
    page.evaluate(() =>
      window.ruedo.stage.bodies.built.standing.every(({ meshes }) =>
        meshes.every((mesh) => mesh.material.wireframe),
      ),
    );
  await page.locator("#wireframe").check();
  check("edges alone are drawn", await lines());
  await page.locator("#wireframe").uncheck();
  check("(and surfaces again)", !(await lines()));
  const saved = async (click) => {
    const [download] = await Promise.all([page.waitForEvent("download"), click()]);
    return [download.suggestedFilename(), readFileSync(await download.path())];
  };
  const [name, png] = await saved(() => page.locator("#screenshot").click());
  check(
    "a screenshot is a picture",
    /^arena_\d+\.\d\ds\.png$/.test(name) &&
      png.subarray(1, 4).toString() === "PNG" &&
      png.length > 5000,
    `${name}, ${png.length}`,
  );
  await page.locator("#record").click();
  await page.locator("#canvas").focus();
  await page.keyboard.press("1");
  for (let i = 0; i < 6; ++i) await page.keyboard.press("j");
  await still();
  const [film, webm] = await saved(() => page.locator("#record").click());
  check(
    "a video is one",
    (film.endsWith(".webm") && webm.readUInt32BE(0) === 0x1a45dfa3) || film.endsWith(".mp4"),
    film,
  );
  const at = webm.indexOf(Buffer.from([0x44, 0x89, 0x88])); // its duration, a float64 in ms
  check(
    "(and it says how long it is)",
    film.endsWith(".mp4") || (at > 0 && at < 1024 && webm.readDoubleBE(at + 3) > 100),
    at,
  );
  await page.locator('[data-model="box_1"]').click();
  check(
    "names are written as they are",
    (await page.locator("#selected").innerText()) === "box_1",
    await page.locator("#selected").innerText(),
  );
  await page.getByLabel("one step while paused (.)").click();
  await page.keyboard.press(" ");
  await until(
    "after a click on step, space goes on",
    () => document.getElementById("state").textContent === "running",
  );
  await page.keyboard.press("?");
  check(
    "the keys are shown from their beginning",
    await page.evaluate(() => {
      const help = document.getElementById("help");
      return help.scrollHeight > help.clientHeight && help.scrollTop === 0;
    }),
    "further down",
  );
  await page.keyboard.press("Escape");
  const before = await page.evaluate(() => window.ruedo.stage.view.at);
  await page.evaluate(() => window.ruedo.plots.plot("p3at/odometry", "v", false));
  await page.locator('[data-layer="sonar"]').click();
  await page.locator("#link").click();
  await until("(the address has it)", () => location.hash.includes("selected=box_1"));
  await page.evaluate(() => localStorage.clear()); // as in another browser
  await page.reload();
  await until(
    "a link leads back to camera and selection",
    (was) =>
      window.ruedo?.page.now.selected === "box_1" &&
      window.ruedo.stage.view.at.every((v, i) => Math.abs(v - was[i]) < 0.01),
    before,
  );
  await until(
    "and to what was open",
    () =>
      window.ruedo.plots.panes[0]?.series[0]?.path === "v" &&
      window.ruedo.page.now.tab === "World" &&
      !window.ruedo.page.now.layers.has("sonar"),
  );
}
