// Everything by which the page steers: driving by keys, stick and gamepad, motion primitives,
// layers, placing, rate, reset. test_browser.py checks the effects in the run's log, too.
const kLayers = {
  // layer: what it switches, in the overlay of a robot
  rays: (o) => [...o.scans.values()].map((s) => s.lines.object),
  points: (o) => [...o.scans.values()].map((s) => s.points.object),
  sonar: (o) => [...o.sonars.values()].map((s) => s.group),
  trail: (o) => [o.truth.strip.object],
  odometry: (o) => [o.odometry.strip.object],
  contacts: (o) => [o.contacts.object],
  frames: (o) => [o.frames],
};

export default async function controls(tools) {
  const { page, seen, until, check, ready, still, drawn, onScreen, server, serverIs, picture } =
    tools;
  await ready();
  // Greatest and least speed ahead and turn rate since the last mark: a slow page sees few of them.
  await page.evaluate(() => {
    const { pages } = window.ruedo,
      pose = pages.pose.bind(pages);
    window.mark = () => {
      window.speeds = { ahead: [0, 0], turn: [0, 0] };
    };
    window.mark();
    pages.pose = (m) => {
      pose(m);
      for (const [name, v] of [
        ["ahead", m.vel[0]],
        ["turn", m.rotation_rate[2]],
      ])
        window.speeds[name] = [
          Math.min(window.speeds[name][0], v),
          Math.max(window.speeds[name][1], v),
        ];
      window.stands = Math.hypot(...m.vel) < 0.01 && Math.abs(m.rotation_rate[2]) < 0.01;
    };
  });
  const moved = (what, name, sign) =>
    until(what, ([n, s]) => Math.max(...window.speeds[n].map((v) => s * v)) > 0.05, [name, sign]);
  const stands = (what) => until(what, () => window.stands);
  await page.evaluate(() =>
    window.ruedo.choose(window.ruedo.page.now.world.robots.findIndex((r) => r.name === "p3dx")),
  );
  await page.locator("#canvas").focus();

  // Starts again, whatever the last drive did while a busy machine was late.
  const again = async () => {
    await stands("(it stands)");
    const epoch = await page.evaluate(() => window.ruedo.clock.epoch);
    await page.locator("#canvas").focus();
    await page.keyboard.press("r");
    await page.keyboard.press("Enter"); // confirms
    await until("(a reset)", (e) => window.ruedo.clock.epoch > e && window.stands, epoch);
    await page.evaluate(() => window.mark());
  };

  // ---- driving
  for (const [what, key, name, sign] of [
    ["the up arrow drives ahead", "ArrowUp", "ahead", 1],
    ["S drives back", "KeyS", "ahead", -1],
    ["A turns left", "KeyA", "turn", 1],
    ["D turns right", "KeyD", "turn", -1],
  ]) {
    await page.keyboard.down(key);
    await moved(what, name, sign);
    await page.keyboard.up(key);
    await again();
  }
  const stick = await page.locator(".stick").boundingBox();
  const [x, y] = [stick.x + stick.width / 2, stick.y + stick.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x, y - stick.height / 4, { steps: 2 });
  await moved("the stick drives ahead", "ahead", 1);
  await page.mouse.move(x - stick.width / 4, y, { steps: 2 });
  await moved("the stick turns left", "turn", 1);
  await page.mouse.up();
  await stands("the stick let go stops the robot");
  await again();
  await page.evaluate(() => {
    navigator.getGamepads = () => [null, { axes: [0, -0.9, 0, 0], buttons: [] }];
  });
  await moved("a gamepad drives ahead", "ahead", 1);
  await page.evaluate(() => {
    navigator.getGamepads = () => [null, { axes: [-0.8, 0.05, 0, 0], buttons: [] }];
  }); // 0.05: within the dead zone
  await moved("a gamepad turns left", "turn", 1);
  await page.evaluate(() => {
    navigator.getGamepads = () => [];
  });
  await again();

  // ---- a motion primitive
  // Of the newest message: what is shown may be of the one before.
  const place = () =>
    page.evaluate(() => {
      const { stage } = window.ruedo,
        { bases } = stage.bodies.description,
        { x, y } = stage.bodies.planar(bases.findIndex(({ robot }) => robot === "p3dx"));
      return [x, y];
    });
  const before = await place();
  for (const odd of ["1e9", ""]) {
    await page.getByLabel("how far").fill(odd);
    await page.locator("#move").click();
    const said = await page.getByLabel("how far").evaluate((input) => input.validationMessage);
    const motion = await page.locator('[data-fact="motion"]').innerText();
    check(`what nobody means is not sent: "${odd}"`, said !== "" && /idle/.test(motion), motion);
  }
  await page.getByLabel("how far").fill("0.4");
  await page.locator("#move").click();
  await until("a motion primitive is done", () =>
    /advance done/.test(document.querySelector('[data-fact="motion"]')?.textContent ?? ""),
  );
  await stands("(it stands)");
  const after = await place(),
    went = Math.hypot(after[0] - before[0], after[1] - before[1]);
  check("it went the requested distance", Math.abs(went - 0.4) < 0.02, `${went} m`);

  // ---- layers
  const chosen = await page.evaluate(() => [...window.ruedo.page.now.layers]);
  check(
    "what robots sense and where they were is on at first",
    chosen.join() === "rays,points,sonar,trail,odometry,contacts,clouds,ghosts,markers",
    chosen,
  );
  await until(
    "both trails lead to where the robot is",
    ([x, y]) => {
      const { truth, odometry } = window.ruedo.overlays.of.get("p3dx");
      return [truth, odometry].every(
        ({
          strip: {
            object: { geometry },
          },
        }) => {
          const n = geometry.drawRange.count,
            p = geometry.getAttribute("position")?.array;
          return (
            n >= 2 &&
            Math.hypot(p[3 * n - 3] - x, p[3 * n - 2] - y) < 0.05 &&
            Math.hypot(p[3 * n - 3] - p[0], p[3 * n - 2] - p[1]) > 0.2
          );
        },
      );
    },
    after,
  );
  await until("contact points are where the pad touches the ground", () => {
    const { geometry } = window.ruedo.overlays.of.get("pad").contacts.object,
      p = geometry.getAttribute("position")?.array ?? [],
      n = geometry.drawRange.count;
    return (
      n >= 3 &&
      Array.from(
        { length: n },
        (_, i) =>
          Math.abs(p[3 * i] - 1.5) < 0.26 &&
          Math.abs(p[3 * i + 1] - 1) < 0.26 &&
          Math.abs(p[3 * i + 2]) < 0.02,
      ).every(Boolean)
    );
  });
  await page.locator("#pause").click();
  await until("(it is paused)", () => document.getElementById("state").textContent === "paused");
  await page.evaluate(() => {
    // from here the points on the wall can be seen
    const { stage } = window.ruedo;
    stage.view.controls.target.set(0, -1, 0);
    stage.view.camera.position.set(-2, 5, 6);
    stage.setAutomatic(false);
  });
  await still();
  // Whether the page redraws after a click, and differently.
  const draw = () =>
    page.evaluate(() => {
      const { stage } = window.ruedo;
      stage.renderer.render(stage.scene, stage.view.camera);
      return document.getElementById("canvas").toDataURL();
    });
  await drawn();
  for (const [layer, objects] of Object.entries(kLayers)) {
    const visible = () =>
      page.evaluate(
        `(() => { const of = ${objects}; return [...window.ruedo.overlays.of.values()].flatMap(of).map((o) => o.visible); })()`,
      );
    const click = async (which = layer) => {
      const frames = await page.evaluate(() => window.ruedo.stage.frames);
      await page.locator(`[data-layer="${which}"]`).click();
      await until(`(${which} are drawn again)`, (n) => window.ruedo.stage.frames > n, frames);
    };
    const isCovered = layer === "trail"; // by that of the odometry
    if (isCovered) await click("odometry");
    const was = await visible(),
      before = await draw();
    await click();
    const is = await visible(),
      other = await draw();
    check(
      `${layer} can be switched`,
      was.length > 0 && was.every((v, i) => v !== is[i]),
      `${was} before and ${is} after`,
    );
    check(`${layer} make a difference to the picture`, before !== other, "the same picture");
    await click();
    check(`(${layer} are as they were)`, before === (await draw()), "another picture");
    if (isCovered) await click("odometry");
  }
  await page.evaluate(() => window.ruedo.stage.setAutomatic(true));
  await page.locator("#pause").click();
  await until("(it goes on)", () => document.getElementById("state").textContent === "running");

  // ---- placing, by a click on the ground
  await page.getByRole("tab", { name: "World" }).click();
  await page.keyboard.press("3");
  // Clicks on the ground there, and returns the exact place, by the page's own camera.
  const click = async (at) => {
    const place = await onScreen(...at);
    const exact = await page.evaluate((pixel) => {
      const { point } = window.ruedo.stage.picker.pick(...pixel);
      return [point.x, point.y];
    }, place);
    await page.mouse.click(...place);
    return exact;
  };
  const put = async (thing, at) => {
    await page.getByLabel("what to place").selectOption({ label: thing });
    await page.locator("#canvas").focus();
    await page.keyboard.press("b");
    return click(at);
  };
  check(
    "beside what lies over it, a click reaches the view",
    (await page.evaluate(() => {
      window.ruedo.page.set({ reduced: true }); // one more chip, in the row that scrolls
      const { right, bottom } = document.getElementById("legend").getBoundingClientRect();
      return document.elementFromPoint(right - 2, bottom + 2)?.id;
    })) === "canvas",
    "something else is there",
  );
  const clicked = await put("a box", [-1.5, 1]);
  await until(
    "a box was placed",
    () =>
      window.ruedo.page.now.world.bodies.some((b) => b.name === "box/link") &&
      window.ruedo.stage.bodies.description.models.some((m) => m.name === "box"),
  );
  await until(
    "the box stands where the click was",
    ([x, y]) => {
      const {
          page: {
            now: { world },
          },
          poses,
        } = window.ruedo,
        index = world.bodies.find((b) => b.name === "box/link").index;
      return (
        Math.hypot(poses.now[7 * index] - x, poses.now[7 * index + 1] - y) < 0.01 &&
        Math.abs(poses.now[7 * index + 2] - 0.2) < 0.01
      );
    },
    clicked,
  );
  // ---- going to a clicked point: paused, so that the robot is not there before all was looked at
  await page.locator("#pause").click();
  await until("(it is paused)", () => document.getElementById("state").textContent === "paused");
  await page.locator("#canvas").focus();
  await page.keyboard.press("g");
  const near = await click([0.8, -1]);
  await page.keyboard.down("Shift");
  const last = await click([0, -1.2]);
  await page.keyboard.up("Shift");
  await page.keyboard.press("Escape");
  check(
    "two points lie ahead",
    (await page.evaluate(() => window.ruedo.trip.points().length)) === 2,
    "other points",
  );
  // At once, so that nothing else moves between the two pictures.
  const way = await page.evaluate(() => {
    const { stage, way } = window.ruedo,
      picture = () => {
        stage.renderer.render(stage.scene, stage.view.camera);
        return document.getElementById("canvas").toDataURL();
      };
    const visible = way.line.visible && way.ends.visible,
      drawn = picture();
    way.line.visible = way.ends.visible = false;
    const without = picture();
    way.line.visible = way.ends.visible = visible;
    const points = ({ geometry }) => [...geometry.getAttribute("position").array];
    return {
      visible,
      differs: drawn !== without,
      ends: points(way.ends),
      line: points(way.line),
    };
  });
  const isAt = (at, [x, y]) => Math.hypot(way.ends[at] - x, way.ends[at + 1] - y) < 0.01;
  check(
    "the way there is drawn, from the robot through all clicks",
    way.visible &&
      way.differs &&
      way.ends.length === 6 &&
      way.line.length === 9 &&
      way.line.slice(3).join() === way.ends.join() &&
      isAt(0, near) &&
      isAt(3, last),
    JSON.stringify([way, near, last]),
  );
  await page.locator("#pause").click();
  await until(
    "the robot goes to where the clicks were",
    ([x, y]) => {
      const { stage, trip, way } = window.ruedo,
        base = stage.bodies.description.bases.findIndex(({ robot }) => robot === "p3dx"),
        at = stage.bodies.planar(base);
      return (
        !way.line.visible && trip.points().length === 0 && Math.hypot(at.x - x, at.y - y) < 0.06
      );
    },
    last,
  );
  await put("Pioneer 3-DX", [-1.5, -1]);
  await until("a robot was placed", () =>
    window.ruedo.page.now.world.robots.some((r) => r.name === "p3dx_2"),
  );
  await put("a box", [-1.5, -1]);
  await until("where there is no room, it says so", () =>
    window.notes.some((note) => /there is no room for/.test(note)),
  );
  await picture("placed");

  // ---- rate
  const rated = async (what, value, rate) => {
    await page.getByLabel("rate").selectOption(value);
    await serverIs(what, (state) => state.rate === rate);
  };
  await rated("the server has the rate that was chosen", "0.25", 0.25);
  // Sim time between two answers against real time from before the first question to after the
  // second: never too little.
  const first = await server();
  await page.waitForTimeout(3000);
  const second = await server(),
    pace = ((second.utime - first.utime) * 1e-3) / (second.answered_ms - first.asked_ms);
  check("at a quarter of the rate the clock runs a quarter as fast", pace < 0.3 && pace > 0, pace);
  await rated("as fast as it goes is a rate, too", "max", Infinity);
  await rated("(a rate of one)", "1", 1);

  // ---- reset
  const epoch = await page.evaluate(() => window.ruedo.clock.epoch);
  await page.locator("#canvas").focus();
  await page.keyboard.press("r");
  await page.keyboard.press("Enter"); // confirms
  await until("a reset sets the clock back", (e) => window.ruedo.clock.epoch > e, epoch);
  await until(
    "a reset takes away what was placed",
    () =>
      !window.ruedo.page.now.world.bodies.some((b) => b.name === "box/link") &&
      window.ruedo.stage.bodies.description.models.every((m) => m.name !== "box") &&
      window.ruedo.page.now.world.robots.length === 2,
  );
  await page.getByRole("tab", { name: "Robot" }).click();
  await until("a reset puts the robot back", () => {
    const [a, b] = document
      .querySelector('[data-fact="pose"]')
      ?.textContent.split(/[^-.0-9]+/)
      .map(Number) ?? [9, 9];
    return Math.hypot(a, b) < 0.01;
  });
  seen("all was steered");
}
