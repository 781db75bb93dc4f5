// Overlays of robots in the view: point clouds, names, frames, joints, an IMU, a camera's frustum,
// and collision shapes.
export default async function senses({ page, until, check, seen, ready, picture }) {
  await page.setViewportSize({ width: 1000, height: 560 });
  await ready();
  await page.getByRole("tab", { name: "Robot" }).click();
  // The wall stands 3 m ahead of the robot: all points above the ground lie on its face.
  for (const device of ["LIDAR", "EYE"])
    await until(
      `the cloud of ${device} lies on the wall`,
      (name) => {
        const cloud = window.ruedo.overlays.of.get("probe")?.clouds.get(name)?.object;
        if (!cloud?.visible) return false;
        const { array } = cloud.geometry.getAttribute("position"),
          matrix = cloud.matrix.elements;
        let hits = 0;
        for (let i = 0; i < array.length; i += 3) {
          const at = (row) =>
            matrix[row] * array[i] +
            matrix[row + 4] * array[i + 1] +
            matrix[row + 8] * array[i + 2] +
            matrix[row + 12];
          if (at(2) < 0.05) continue;
          if (Math.abs(at(0) - 3) > 0.02) return false;
          ++hits;
        }
        return hits > 150;
      },
      device,
    );
  const layer = (name) => page.locator(`[data-layer="${name}"]`).click();
  await layer("labels");
  await until("names stand over what they name", () => {
    const spans = [...document.querySelectorAll(".labels span")];
    return (
      spans.map((each) => each.textContent).includes("probe") &&
      spans.every((each) => each.hidden || each.style.transform.includes("px"))
    );
  });
  await page.locator("#inset").selectOption("probe/EYE/depth");
  await until("a camera's picture is in the view", () => {
    const canvas = document.querySelector(".inset canvas");
    return canvas?.width === 64 && canvas.height === 48;
  });
  await page.locator(".inset canvas").hover();
  await until("a depth is shown under the pointer: the wall's, 2.9 m ahead of the camera", () => {
    const [, metres] = /here ([\d.]+) m/.exec(
      document.querySelector(".inset figcaption").textContent,
    ) ?? [0, NaN];
    return Math.abs(metres - 2.9) < 0.02;
  });
  await page.locator("#inset").selectOption("probe/CLASSES");
  await page.locator(".inset canvas").hover();
  await until("a class is shown under the pointer, with the model that has it", () =>
    /here label 40 wall$/.test(document.querySelector(".inset figcaption").textContent),
  );
  check(
    "and explained by its colour below the picture",
    (await page.locator(".inset .xy-legend").innerText()) === "40 wall",
    await page.locator(".inset .xy-legend").innerText(),
  );
  await page.locator("#inset").selectOption("probe/HEAT");
  await page.locator(".inset canvas").hover();
  await until("a temperature is shown under the pointer: the wall's", () =>
    /dark to bright: .* K · here 310\.00 K$/.test(
      document.querySelector(".inset figcaption").textContent,
    ),
  );
  await page.locator("#inset").selectOption("probe/EYE/depth");
  await page.locator(".inset canvas").hover();
  await page.getByRole("tab", { name: "Channels" }).click();
  const told = () => document.querySelector(".inset figcaption").textContent;
  const before = await page.evaluate(told);
  await until(
    "whatever the panel shows",
    (text) => document.querySelector(".inset figcaption").textContent !== text,
    before,
  );
  await page.getByRole("tab", { name: "Robot" }).click();
  await until("joints are shown", () =>
    /shoulder-?\d/.test(document.getElementById("joints")?.textContent ?? ""),
  );
  const slider = page.getByLabel("move shoulder");
  check(
    "a slider ends where its joint does",
    (await slider.getAttribute("min")) === "-1" &&
      (await slider.getAttribute("max")) === "1" &&
      /-1 to 1 rad/.test(await page.locator("#joints").innerText()),
    await page.locator("#joints").innerText(),
  );
  await slider.evaluate((slider) => {
    slider.value = "0.5";
    slider.dispatchEvent(new Event("input"));
  });
  await until("a slider moves a joint", () => {
    const position = document.querySelector("#joints td").textContent;
    return Math.abs(Number(position) - 0.5) < 0.05;
  });
  await until("an IMU at rest shows gravity, and no turning", () => {
    const words = document.querySelector('[data-fact="IMU"]')?.textContent ?? "";
    return /9\.8\d m\/s².* rad\/s/.test(words);
  });
  await page.locator("#tf summary").click();
  await until("frames are a tree", () => {
    const text = document.getElementById("tf").textContent;
    return (
      text.includes("probe/LIDAR 0.000 m, 0.000 m, 0.300 m") &&
      /probe\/base_link -?0\.00\d m/.test(text)
    );
  });
  await until("a link that moves is in it, as its joint has it", () =>
    /probe\/arm -0\.\d{3} m, -?0\.00\d m, 0\.\d{3} m, pitch (2\d|3\d)\.\d°/.test(
      document.getElementById("tf").textContent,
    ),
  );
  await picture("senses");
  const triangles = () => window.ruedo.stage.renderer.info.render.triangles;
  await page.evaluate(() => window.ruedo.stage.setShadows(false)); // theirs count, too
  const frames = await page.evaluate(() => window.ruedo.stage.frames);
  await until("(it is drawn)", (n) => window.ruedo.stage.frames > n + 1, frames);
  const looks = await page.evaluate(triangles);
  await layer("shapes");
  // A box of 12 triangles instead of a ball of some hundred.
  await until(
    "shapes of physics take the place of looks",
    (n) => window.ruedo.stage.renderer.info.render.triangles < n - 100,
    looks,
  );
  await picture("senses-shapes");
  await layer("shapes");
  await until(
    "and looks come back",
    (n) => window.ruedo.stage.renderer.info.render.triangles > n - 50,
    looks,
  );
  // ---- the user's settings of drawing
  const cloud = () => {
    const { object } = window.ruedo.overlays.of.get("probe").clouds.get("LIDAR"),
      { array } = object.geometry.getAttribute("color");
    return [object.material.size, new Set(array).size];
  };
  await page.getByRole("tab", { name: "World" }).click();
  const usual = await page.evaluate(cloud);
  const layerChoice = page.getByLabel("layer", { exact: true });
  await layerChoice.selectOption("rays");
  check(
    "what a layer has not is not offered",
    (await page.getByLabel("coloured by").isHidden()) &&
      (await page.getByLabel("strength").isVisible()),
  );
  await layerChoice.selectOption("clouds");
  await page.getByLabel("size", { exact: true }).fill("2");
  await until(
    "points are larger",
    (size) =>
      window.ruedo.overlays.of.get("probe").clouds.get("LIDAR").object.material.size === size,
    4 * usual[0],
  );
  check(
    "points of another layer stay as they are",
    (await page.evaluate(() => {
      const overlay = window.ruedo.overlays.of.get("probe");
      return [overlay.contacts.object.material.size, overlay.display("points").size].join();
    })) === "9,1",
  );
  await page.getByLabel("coloured by").selectOption("height");
  // Of two points that are equally far, and not equally high
  await until("and coloured by height", () => {
    const { object } = window.ruedo.overlays.of.get("probe").clouds.get("LIDAR"),
      colours = object.geometry.getAttribute("color"),
      { array } = object.geometry.getAttribute("position");
    const points = Array.from({ length: colours.count }, (_, i) => ({
      range: Math.hypot(...array.subarray(3 * i, 3 * i + 3)),
      z: array[3 * i + 2],
      colour: ["getX", "getY", "getZ"].map((get) => colours[get](i)),
    }));
    const pairs = points.flatMap((a) =>
      points
        .map((b) => [a, b])
        .filter(([a, b]) => Math.abs(a.range - b.range) < 0.02 && a.z - b.z > 0.4),
    );
    const apart = ([a, b]) => Math.hypot(...a.colour.map((value, k) => value - b.colour[k]));
    return pairs.length > 0 && pairs.every((pair) => apart(pair) > 0.05);
  });
  await picture("senses-display");
  const colours = () => {
    const { object } = window.ruedo.overlays.of.get("probe").clouds.get("LIDAR");
    return object.geometry.getAttribute("color").array.slice(0, 300).join();
  };
  for (const by of ["range", "intensity", "plain"]) {
    const before = await page.evaluate(colours);
    await page.getByLabel("coloured by").selectOption(by);
    await until(
      `and coloured by ${by}`,
      (was) => {
        const { object } = window.ruedo.overlays.of.get("probe").clouds.get("LIDAR");
        return object.geometry.getAttribute("color").array.slice(0, 300).join() !== was;
      },
      before,
    );
  }
  await page.getByLabel("points stay, s").fill("4");
  await until("points stay for a while, in their places", () => {
    const overlay = window.ruedo.overlays.of.get("probe"),
      { count } = overlay.past.get("LIDAR")?.object.geometry.getAttribute("position") ?? {};
    return count > (3 * overlay.clouds.get("LIDAR").seen.points.length) / 3;
  });
  const fade = (value) =>
    page.getByLabel("opacity", { exact: true }).evaluate((slider, to) => {
      slider.value = to;
      slider.dispatchEvent(new Event("input"));
    }, value);
  await fade("0.5");
  await page.getByLabel("display of").selectOption("probe");
  await fade("0.25");
  await until("one robot's are drawn as that robot's", () => {
    const { material } = window.ruedo.overlays.of.get("probe").clouds.get("LIDAR").object;
    return material.transparent && Math.abs(material.opacity - 0.25) < 0.01;
  });
  await plots({ page, until });
  seen("all was seen");
  check("(done)", true);
}

// Elements of arrays have the names of their joints, and a formula may be a derivative.
async function plots({ page, until }) {
  await page.getByRole("tab", { name: "Plots" }).click();
  await page.getByLabel("channel to plot").selectOption("probe/joints");
  await until("a joint's name is offered", () =>
    [...document.querySelectorAll("#offered-fields option")].some(
      ({ value, label }) => value === "joint_position[0]" && /shoulder/.test(label),
    ),
  );
  for (const path of ["joint_position[0]", "derivative(joint_position[0])"]) {
    await page.getByLabel("field to plot").fill(path);
    await page.locator("#plot").click();
  }
  await until("and plotted beside its derivative", () => {
    const [position, speed] = window.ruedo.plots.panes[0]?.series ?? [];
    return (
      /\(shoulder\)$/.test(position?.label) &&
      position.values.length > 5 &&
      speed?.values.filter(Number.isFinite).length > 5
    );
  });
}
