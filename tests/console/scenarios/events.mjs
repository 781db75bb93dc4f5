// The events below the time line, of a log or of a live run. Given, of a log: the expected events,
// in order, and the times of consecutive states.
export default async function events({ page, until, check, seen, ready, given, picture }) {
  await page.setViewportSize({ width: 1100, height: 480 });
  await ready();
  await page.locator("#canvas").focus();
  if (!given) return live({ page, until, check, seen });
  await page.keyboard.press(" ");
  await until("(it stands still)", () => !window.ruedo.page.now.playback.playing);
  await until(
    "(events are there)",
    (wanted) =>
      wanted.every(([, kind, robot, words]) =>
        window.ruedo.page.now.events.some(
          (e) => e.kind === kind && e.robot === robot && e.text.includes(words),
        ),
      ),
    given.events,
  );
  const told = await page.evaluate(() =>
    window.ruedo.page.now.events.map(({ t, kind, robot, text }) => [t, kind, robot, text]),
  );
  for (const [t, kind, robot, words] of given.events) {
    const found = told.find((e) => e[1] === kind && e[2] === robot && e[3].includes(words));
    check(
      `a ${kind} of ${robot} at its time`,
      found && Math.abs(found[0] - t) < 1e-6,
      `${t} ${words}: ${JSON.stringify(told)}`,
    );
  }
  check(
    "in the order of time",
    told.every(([t], i) => i === 0 || t >= told[i - 1][0]),
  );
  const now = () => page.evaluate(() => window.ruedo.page.now.playback.now);
  const seek = async (t) => {
    await page.evaluate((to) => window.ruedo.link.seek(to), t);
    await at(t);
  };
  const at = (t) =>
    until(`(at ${t} s)`, (to) => Math.abs(window.ruedo.page.now.playback.now - to) < 1e-6, t);
  await seek(0);
  const apart = [...new Set(told.map(([t]) => t))].filter((t) => t > 0);
  for (const t of apart) {
    await page.keyboard.press(">");
    await at(t);
  }
  await page.keyboard.press(">");
  await until(
    "behind the last one there is none",
    () => document.getElementById("event").textContent === "no later event",
  );
  for (const t of apart.slice(0, -1).reverse()) {
    await page.getByRole("button", { name: "the event before" }).click();
    await at(t);
  }
  seen("jumps lead from one to the next, and back");
  await seek(0);
  await page.getByLabel("events", { exact: true }).selectOption("watchdog");
  await page.getByRole("button", { name: "the next event" }).click();
  await at(given.events.find(([, kind]) => kind === "watchdog")[0]);
  await until("one kind alone is jumped to, and said in words", () =>
    document.getElementById("event").textContent.endsWith("p3dx: no command came: stopped"),
  );
  await picture("events");
  await page.getByLabel("events", { exact: true }).selectOption("");
  const lane = page.locator("#events");
  const { width } = await lane.boundingBox();
  // In the middle of the longest time without an event: near one, a click goes to it.
  const { begin, end } = given;
  const times = [begin, ...told.map(([t]) => t), end].sort((a, b) => a - b);
  const [from, to] = times
    .slice(1)
    .map((t, i) => [times[i], t])
    .reduce((most, gap) => (gap[1] - gap[0] > most[1] - most[0] ? gap : most));
  const middle = (from + to) / 2;
  await lane.click({
    position: { x: 8 + ((middle - begin) / (end - begin)) * (width - 16) + 1.5, y: 7 },
  });
  await until(
    "a click on the lane goes there",
    ([t, tolerance]) => Math.abs(window.ruedo.page.now.playback.now - t) < tolerance,
    [middle, 0.02 * (end - begin)],
  );
  await seek(given.states[1]);
  await page.keyboard.press(".");
  await at(given.states[2]);
  await page.getByRole("button", { name: "the state before" }).click();
  await at(given.states[1]);
  await page.keyboard.press(",");
  await at(given.states[0]);
  seen("frames are stepped through both ways");
  await seek(1);
  await page.keyboard.press("[");
  await seek(1.5);
  await page.keyboard.press("]");
  await seek(1);
  const { jumps } = await page.evaluate(() => window.ruedo.page.now.playback);
  await page.keyboard.press(" ");
  await until(
    "a part is played again and again",
    (n) => window.ruedo.page.now.playback.jumps >= n + 2 && window.ruedo.page.now.playback.playing,
    jumps,
  );
  check("(and no other)", (await now()) < 2.2, await now());
  await page.keyboard.press("o");
  await until("until it is no more", () => window.ruedo.page.now.playback.now > 2.2);
  await page.setViewportSize({ width: 390, height: 780 });
  await picture("events-phone");
  const rows = await page.evaluate(() => {
    const [time, ...buttons] = ["#logtime", "#timeline > button, #timeline > .row > button"]
      .flatMap((selector) => [...document.querySelectorAll(selector)])
      .filter((element) => element.checkVisibility())
      .map((element) => element.getBoundingClientRect());
    return { time: time.bottom, tops: [...new Set(buttons.map(({ top }) => Math.round(top)))] };
  });
  check(
    "a phone's time line is two rows",
    rows.tops.length === 1 && rows.time <= rows.tops[0],
    JSON.stringify(rows),
  );
  await page.getByRole("button", { name: "loop, speed and kinds of events" }).click();
  await picture("events-phone-more");
  check(
    "a phone has all of it",
    await page.evaluate(() =>
      [
        '[title^="play it again"]',
        "#event-kind",
        '#more-time [aria-label="speed"]',
        "#scrub",
        "#logtime",
      ].every((selector) => {
        const element = document.querySelector(selector),
          { left, right, bottom } = element.getBoundingClientRect();
        return (
          element.checkVisibility() && left >= 0 && right <= innerWidth && bottom <= innerHeight
        );
      }),
    ),
  );
}

async function live({ page, until, seen }) {
  const has = (kind, text) =>
    until(
      `a ${kind} is reported`,
      ([wanted, words]) =>
        window.ruedo.page.now.events.some((e) => e.kind === wanted && e.text.includes(words)),
      [kind, text],
    );
  await page.keyboard.down("KeyW");
  await has("command", "drive at");
  await has("collision", "p3dx");
  await page.keyboard.up("KeyW");
  const { now, t } = await page.evaluate(() => ({
    now: window.ruedo.page.now.time_s,
    t: window.ruedo.page.now.events.find(({ kind }) => kind === "collision").t,
  }));
  await page.getByLabel("events", { exact: true }).selectOption("collision");
  await page.keyboard.press("<");
  await until(
    "a click jumps to the past",
    ([from, to]) => {
      const { past } = window.ruedo.page.now;
      return past && past.now >= from - 1e-6 && past.now <= to;
    },
    [t, now],
  );
  await page.keyboard.press("End");
  await until("End comes back", () => window.ruedo.page.now.past === null);
  await page.keyboard.press("r");
  await page.keyboard.press("Enter");
  await until("after a reset earlier events hold no more", () => {
    const { events } = window.ruedo.page.now;
    return events[0]?.kind === "reset" && events.every(({ kind }) => kind !== "collision");
  });
  seen("all was seen");
}
