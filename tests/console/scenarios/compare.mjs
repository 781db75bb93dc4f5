// A log beside another one: ghosts, plots of how far apart the robots are, and the first
// difference. Given, from an independent reader of both logs: where the robot is at a moment,
// the first difference, and the largest distance between the robots.
export default async function compare({ page, given, seen, until, check, picture }) {
  // Frames alone do not show it: an empty view is drawn before the page is connected, and requests
  // to the log are lost until then.
  await until(
    "the world is shown",
    () => window.ruedo?.page.now.playback && window.ruedo.stage.frames > 1,
  );
  await page.evaluate(() => window.ruedo.link.play(false, 1));
  await page.getByRole("tab", { name: "Plots" }).click();
  await until("the first difference is shown", () => document.getElementById("difference-words"));
  const words = await page.locator("#difference-words").innerText();
  check(
    "it is that of the logs",
    given.channels.some((channel) => words.includes(`${given.first.toFixed(3)} s: ${channel}`)),
    words,
  );
  await page.locator("#first-difference").click();
  await until(
    "a button on the time line goes there",
    (t) => Math.abs(window.ruedo.page.now.playback.now - t) < 1e-6,
    given.first,
  );
  await page.locator("#event-kind").selectOption("difference");
  await page.evaluate((t) => window.ruedo.link.seek(t), given.time);
  await page.locator("#canvas").focus();
  await page.keyboard.press("<");
  await until(
    "and so does the jump to the event before",
    (t) => Math.abs(window.ruedo.page.now.playback.now - t) < 1e-6,
    given.first,
  );

  await page.evaluate((t) => window.ruedo.link.seek(t), given.time);
  const isAt = ([which, body, [x, y]]) => {
    const { now } = which === "ghost" ? window.ruedo.ghosts.poses : window.ruedo.poses;
    return Math.hypot(now[7 * body] - x, now[7 * body + 1] - y) < 1e-4;
  };
  await until("the robot is where its log has it", isAt, ["robot", given.body, given.pose]);
  await until("its ghost is where the other log has it", isAt, ["ghost", given.body, given.other]);
  const drawn = () => window.ruedo.ghosts.built.moving.visible;
  await until("the ghost is drawn", drawn);
  const place = await page.evaluate((body) => {
    const movers = window.ruedo.ghosts.built.movers.find(({ links }) =>
      links.some((link) => link.body === body && link.pose.slice(0, 2).every((v) => v === 0)),
    );
    const i = movers.links.findIndex((link) => link.body === body);
    return [...movers.meshes[0].instanceMatrix.array.slice(16 * i + 12, 16 * i + 14)];
  }, given.body);
  check(
    "there",
    Math.hypot(place[0] - given.other[0], place[1] - given.other[1]) < 1e-3,
    JSON.stringify([place, given.other]),
  );
  await picture("compare");

  await page.locator('[data-apart="p3at"]').getByText("Plot").click();
  await until(
    "how far apart they are is plotted",
    (most) => {
      const series = window.ruedo.plots.panes.flatMap((pane) => pane.series);
      const distance = series.find(({ path }) => path === "distance"),
        angle = series.find(({ path }) => path === "angle");
      return (
        distance?.channel === "compared/p3at" &&
        Math.abs(Math.max(...distance.values) - most) < 1e-9 &&
        angle?.values.length === distance.values.length
      );
    },
    given.most,
  );
  check(
    "and told",
    (await page.locator('[data-apart="p3at"]').innerText()).includes(given.most.toPrecision(3)),
    await page.locator('[data-apart="p3at"]').innerText(),
  );
  await picture("compare_plots");
  await page.locator('.chip[data-layer="ghosts"]').click();
  await until("ghosts can be switched off", () => !window.ruedo.ghosts.built.moving.visible);
  seen("compared");
}
