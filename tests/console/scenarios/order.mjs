// The page loads in one order, whatever comes late: each part in turn is held back until all the
// others are there. The robot rests at (1, 2) m: while its start is unknown, its odometry would
// seem 2.236 m off.
export default async function order({ page, seen, until, expect }) {
  await page.setViewportSize({ width: 700, height: 400 });
  let held = null,
    waiting = [];
  const release = () => {
    held = null;
    for (const go of waiting.splice(0)) go();
  };
  const pass = (part, go) => (part === held ? waiting.push(go) : go());
  await page.route(/\/scene/, (route) =>
    pass(
      new URL(route.request().url()).pathname,
      () => void route.continue().catch(() => undefined),
    ),
  );
  await page.routeWebSocket(/\/socket/, (socket) => {
    const server = socket.connectToServer();
    socket.onMessage((message) => server.send(message));
    server.onMessage((message) =>
      pass(
        typeof message !== "string" ? "messages" : /"hello"/.test(message) ? "greeting" : "names",
        () => socket.send(message),
      ),
    );
  });
  expect(/ERR_ABORTED|aborted/); // requests that were held back when the page was left
  const kOthersAreThere = {
    greeting: () => window.ruedo?.page.now.link === "open",
    messages: () =>
      window.ruedo?.loading.hasScene &&
      document.getElementById("state").textContent === "connected",
    names: () => window.ruedo?.loading.hasScene,
    "/scene.json": () => window.ruedo?.loading.world !== null && !window.ruedo.loading.hasScene,
  };
  kOthersAreThere["/scene/meshes"] = kOthersAreThere["/scene/links"] =
    kOthersAreThere["/scene.json"];
  for (const part of Object.keys(kOthersAreThere)) {
    release();
    held = part;
    await page.reload();
    await until(`(all but ${part})`, kOthersAreThere[part]);
    if (part.startsWith("/")) {
      // it can be controlled before it is drawn
      await page.keyboard.press(" ");
      await until("(it is paused)", () => window.ruedo.page.now.paused);
      await page.keyboard.press(" ");
      await until("(it goes on)", () => !window.ruedo.page.now.paused);
    }
    release();
    await until("(the odometry's error is known)", () =>
      /m, .*°/.test(document.querySelector('[data-fact="odometry error"]')?.textContent ?? ""),
    );
    await until(
      `the odometry is right with ${part} last`,
      () => document.querySelector('[data-fact="odometry error"]').textContent === "0.000 m, 0.0°",
    );
    await page.locator("#canvas").focus();
    await page.keyboard.press("2");
    await until("(the view follows the robot)", () => {
      const { x, y } = window.ruedo.stage.view.controls.target;
      return Math.hypot(x - 1, y - 2) < 0.01;
    });
    await until("(and both trails begin where it is)", () => {
      const { truth, odometry } = window.ruedo.overlays.of.get("p3dx");
      return [truth, odometry].every(
        ({ points }) => points.length >= 3 && Math.hypot(points[0] - 1, points[1] - 2) < 1e-3,
      );
    });
  }
  seen("the order is the same");
}
