// Everything by which the page steers: layers, driving by keys, stick and gamepad, motion primitives, placing, reset, rate.
const kLayers = {    // layer: what it switches, in the overlay of a robot
  rays: (o) => [...o.scans.values()].map((s) => s.lines.object), points: (o) => [...o.scans.values()].map((s) => s.points.object),
  sonar: (o) => [...o.sonars.values()].map((s) => s.group), trail: (o) => [o.truth.strip.object], odometry: (o) => [o.odometry.strip.object],
  contacts: (o) => [o.contacts.object], frames: (o) => [o.frames],
};

export default async function controls(tools) {
  const { page, seen, until, check, ready, picture } = tools;
  await ready();
  const speed = () => page.evaluate(() => document.querySelector('[data-fact="speed"]')?.textContent.split(/[^-.0-9]+/).map(Number) ?? [0, 0]);
  // Until speed ahead and turn rate are within bounds.
  const until_speed = (what, bounds) => until(what, ([v0, v1, w0, w1]) => {
    const [v, w] = (document.querySelector('[data-fact="speed"]')?.textContent ?? "").split(/[^-.0-9]+/).map(Number);
    return v >= v0 && v <= v1 && w >= w0 && w <= w1;
  }, bounds);
  const stands = () => until_speed("", [-0.01, 0.01, -0.01, 0.01]);
  await page.evaluate(() => window.ruedo.choose(window.ruedo.world.robots.findIndex((r) => r.name === "p3dx")));
  await page.locator("#canvas").focus();

  // From the start, whatever the last drive came to while a busy machine looked away.
  const again = async () => {
    await stands();
    const time = await page.evaluate(() => window.ruedo.time_s);
    await page.locator("#canvas").focus();
    await page.keyboard.press("r");
    await until("", (t) => window.ruedo.time_s < t, time);
  };

  // ---- driving
  for (const [what, key, bounds] of [["the up arrow drives ahead", "ArrowUp", [0.1, 9, -9, 9]], ["S drives back", "KeyS", [-9, -0.1, -9, 9]], ["A turns left", "KeyA", [-9, 9, 0.2, 9]], ["D turns right", "KeyD", [-9, 9, -9, -0.2]]]) {
    await page.keyboard.down(key);
    await until_speed(what, bounds);
    await page.keyboard.up(key);
    await again();
  }
  const stick = await page.locator(".stick").boundingBox();
  const [x, y] = [stick.x + stick.width / 2, stick.y + stick.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x, y - 50, { steps: 3 });
  await until_speed("the stick drives ahead", [0.1, 9, -0.05, 0.05]);
  await page.mouse.move(x - 50, y, { steps: 3 });
  await until_speed("the stick turns left", [-9, 9, 0.2, 9]);
  await page.mouse.up();
  await again();
  seen("the stick let go stops the robot");
  await page.evaluate(() => { navigator.getGamepads = () => [null, { axes: [0, -0.9, 0, 0], buttons: [] }]; });
  await until_speed("a gamepad drives ahead", [0.1, 9, -9, 9]);
  await page.evaluate(() => { navigator.getGamepads = () => [null, { axes: [-0.8, 0.05, 0, 0], buttons: [] }]; });    // 0.05: within the dead zone
  await until_speed("a gamepad turns left", [-0.01, 0.01, 0.2, 9]);
  await page.evaluate(() => { navigator.getGamepads = () => []; });
  await again();

  // ---- a motion primitive
  const place = () => page.evaluate(() => { const [a, b] = document.querySelector('[data-fact="pose"]').textContent.split(/[^-.0-9]+/).map(Number); return [a, b]; });
  const before = await place();
  await page.getByLabel("how far").fill("0.4");
  const typing = await place();
  check("typing does not drive", Math.hypot(typing[0] - before[0], typing[1] - before[1]) < 1e-3);
  await page.locator("#move").click();
  await until("a motion primitive is done", () => /advance done/.test(document.querySelector('[data-fact="motion"]')?.textContent ?? ""));
  await stands();
  const after = await place(), went = Math.hypot(after[0] - before[0], after[1] - before[1]);
  check("it went as far as was asked", Math.abs(went - 0.4) < 0.02, went);

  // ---- layers
  const chosen = await page.evaluate(() => [...window.ruedo.layers]);
  check("frames are off at first, all else is on", chosen.length === 6 && !chosen.includes("frames"), chosen);
  const points = await page.evaluate(() => {
    const of = (robot) => window.ruedo.overlays.get(robot);
    const positions = (strip) => [...strip.object.geometry.getAttribute("position").array.slice(0, 3 * strip.object.geometry.drawRange.count)];
    return { truth: positions(of("p3dx").truth.strip).length / 3, odometry: positions(of("p3dx").odometry.strip).length / 3, contacts: positions(of("pad").contacts) };
  });
  check("both trails have grown", points.truth > 10 && points.odometry > 10, JSON.stringify(points));
  const under = points.contacts.length >= 9 && points.contacts.every((v, i) => (i % 3 === 0 ? Math.abs(v - 1.5) : i % 3 === 1 ? Math.abs(v - 1) : Math.abs(v)) < (i % 3 === 2 ? 0.02 : 0.26));
  check("contact points are where the pad touches the ground", under, points.contacts);
  await page.locator("#pause").click();
  await until("", () => document.getElementById("state").textContent === "paused");
  await page.keyboard.press("Home");
  await page.waitForTimeout(1500);
  const view = await page.locator("#canvas").boundingBox();
  const pixels = () => page.screenshot({ clip: { x: view.x, y: view.y + 60, width: view.width, height: view.height - 60 - 150 } });    // without chips and stick
  for (const [layer, objects] of Object.entries(kLayers)) {
    const visible = () => page.evaluate(`(() => { const of = ${objects}; return [...window.ruedo.overlays.values()].flatMap(of).map((o) => o.visible); })()`);
    const was = await visible(), drawn = await pixels();
    await page.locator(`[data-layer="${layer}"]`).click();
    await page.waitForTimeout(700);
    const is = await visible(), other = await pixels();
    check(`${layer} can be switched`, was.length > 0 && was.every((v, i) => v !== is[i]), `${was} ${is}`);
    check(`${layer} make a difference to the picture`, !drawn.equals(other));
    await page.locator(`[data-layer="${layer}"]`).click();
    await page.waitForTimeout(300);
  }
  await page.locator("#pause").click();
  await until("", () => document.getElementById("state").textContent === "running");

  // ---- placing, by a click on the ground
  await page.getByRole("tab", { name: "World" }).click();
  await page.keyboard.press("3");
  await page.waitForTimeout(800);
  const put = async (thing, at) => {
    await page.getByLabel("what to place").selectOption({ label: thing });
    await page.locator("#canvas").focus();
    await page.keyboard.press("b");
    // Where those metres are on the screen, by the page's own camera.
    const [px, py, gx, gy] = await page.evaluate(([gx, gy]) => {
      const { stage } = window.ruedo, box = document.getElementById("canvas").getBoundingClientRect();
      const p = stage.camera.position.clone().set(gx, gy, 0).project(stage.camera);
      const sx = Math.round(box.left + (p.x + 1) / 2 * box.width), sy = Math.round(box.top + (1 - p.y) / 2 * box.height);
      const { ground } = stage.pick(sx, sy);
      return [sx, sy, ground.x, ground.y];
    }, at);
    await page.mouse.click(px, py);
    return [gx, gy];
  };
  const [bx, by] = await put("a box", [-1.5, 1]);
  await until("a box was placed", () => window.ruedo.world.bodies.some((b) => b.name === "box/link") && window.ruedo.stage.description.models.some((m) => m.name === "box"));
  await until("the box stands where the click was", ([x, y]) => {
    const { world, poses } = window.ruedo, index = world.bodies.find((b) => b.name === "box/link").index;
    return Math.hypot(poses.now[7 * index] - x, poses.now[7 * index + 1] - y) < 0.01 && Math.abs(poses.now[7 * index + 2] - 0.2) < 0.01;
  }, [bx, by]);
  await put("Pioneer 3-DX", [-1.5, -1]);
  await until("a robot was placed", () => window.ruedo.world.robots.some((r) => r.name === "p3dx_2"));
  await put("a box", [-1.5, -1]);
  await until("where there is no room, it says so", () => /there is no room for/.test(document.getElementById("toasts").textContent));
  await picture("placed");

  // ---- rate and reset
  await page.evaluate(() => {
    const { session } = window.ruedo, state = session.state.bind(session);
    session.state = (reply) => { const read = state(reply); window.rates = [...(window.rates ?? []), read.rate]; return read; };
  });
  await page.getByLabel("rate").selectOption("0.25");
  await until("the server has the rate that was chosen", () => window.rates?.at(-1) === 0.25);
  const pace = await page.evaluate(async () => {
    const from = [performance.now(), window.ruedo.time_s];
    await new Promise((done) => setTimeout(done, 4000));
    return (window.ruedo.time_s - from[1]) * 1000 / (performance.now() - from[0]);
  });
  check("at a quarter of the rate the clock goes a quarter as fast", pace < 0.35 && pace > 0.02, pace);
  await page.getByLabel("rate").selectOption("max");
  await until("as fast as it goes is a rate, too", () => window.rates?.at(-1) === Infinity);
  await page.getByLabel("rate").selectOption("1");
  await until("", () => window.rates?.at(-1) === 1);
  const time = await page.evaluate(() => window.ruedo.time_s);
  await page.locator("#canvas").focus();
  await page.keyboard.press("r");
  await until("a reset sets the clock back", (t) => window.ruedo.time_s < t, time);
  await until("a reset takes away what was placed", () => !window.ruedo.world.bodies.some((b) => b.name === "box/link") && window.ruedo.stage.description.models.every((m) => m.name !== "box") && window.ruedo.world.robots.length === 2);
  await page.getByRole("tab", { name: "Robot" }).click();
  await until("a reset puts the robot back", () => { const [a, b] = document.querySelector('[data-fact="pose"]')?.textContent.split(/[^-.0-9]+/).map(Number) ?? [9, 9]; return Math.hypot(a, b) < 0.01; });
  if (!(await speed()).every(Number.isFinite)) throw new Error("the speed is no number");
}
