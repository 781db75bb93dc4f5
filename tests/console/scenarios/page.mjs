// The page itself: how fast it loads, on small screens, dark and light, and what it says when the
// server is gone.
const channels = (colour) =>
  colour
    .match(/[\d.]+/g)
    .slice(0, 3)
    .map(Number);
function contrast(a, b) {
  // of WCAG
  const light = (colour) =>
    channels(colour)
      .map((v) => v / 255)
      .map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
      .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const [low, high] = [light(a), light(b)].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
}

export default async function looks(tools) {
  const { page, url, seen, told, until, check, ready, still, picture, expect } = tools;
  // ---- from the address to the first drawn frame, best of three: printed and not checked, since
  // this machine is busy and draws in software. Checked is what makes a page slow anywhere.
  await page.setViewportSize({ width: 640, height: 400 });
  const loads = [],
    warnings = [];
  page.on("console", (message) => {
    const text = message.text(); // a browser without a GPU reads the view's pixels back
    if (message.type() === "warning" && !/ReadPixels/.test(text)) warnings.push(text);
  });
  for (let i = 0; i < 3; ++i) {
    await page.goto(url, { waitUntil: "load" });
    await until("(the first frame is drawn)", () => window.ruedo?.stage.firstDrawn_ms > 0);
    loads.push(
      await page.evaluate(() => {
        const parts = [
          ...performance.getEntriesByType("navigation"),
          ...performance.getEntriesByType("resource"),
        ];
        return {
          drawn_ms: Math.round(window.ruedo.stage.firstDrawn_ms),
          loaded_ms: Math.round(parts[0].loadEventEnd),
          requests: parts.length,
          kilobytes: Math.round(parts.reduce((sum, p) => sum + p.transferSize, 0) / 1024),
        };
      }),
    );
  }
  const best = loads.sort((a, b) => a.drawn_ms - b.drawn_ms)[0];
  console.log(`measured: ${JSON.stringify(best)}`);
  check(
    "the page is small",
    best.requests > 4 && best.requests < 20 && best.kilobytes < 1000,
    JSON.stringify(best),
  );
  check("it loads without warnings", warnings.length === 0, warnings.slice(0, 3).join(" | "));
  check("the world is drawn soon", best.drawn_ms < 60_000, `${best.drawn_ms} ms`);
  await page.setViewportSize({ width: 900, height: 520 });
  await ready();

  // ---- small screens
  for (const [width, height] of [
    [390, 844],
    [360, 640],
    [844, 390],
  ]) {
    await page.setViewportSize({ width, height });
    for (const tab of ["Robot", "Plots", "Channels", "World", "Notes"]) {
      if (await page.evaluate(() => document.getElementById("app").classList.contains("closed")))
        await page.keyboard.press("p");
      await page.getByRole("tab", { name: tab }).click();
      await still();
      const wide = await page.evaluate(() => {
        const outside = [
          ...document.querySelectorAll("#bar button, #bar select, .dv-tab, .page *, #timeline *"),
        ].filter((e) => {
          const box = e.getBoundingClientRect();
          return box.width > 0 && (box.right > innerWidth + 1 || box.left < -1);
        });
        const scrolls = [...document.querySelectorAll("html, body, .page")].some(
          (e) => e.scrollWidth > e.clientWidth + 1,
        );
        return outside
          .map((e) => `${e.tagName} ${e.className} ${e.textContent.slice(0, 20)}`)
          .concat(scrolls ? ["scrolls"] : []);
      });
      if (wide.length > 0)
        throw new Error(
          `${width} x ${height}, ${tab}: wider than the screen: ${wide.slice(0, 5).join("; ")}`,
        );
    }
    if (width === 390) await picture("phone_world");
  }
  seen("nothing is wider than a phone");
  const small = await page.evaluate(
    () =>
      [...document.querySelectorAll("#bar button, .dv-tab")]
        .map((e) => e.getBoundingClientRect())
        .filter((box) => box.width > 0 && Math.min(box.width, box.height) < 34).length,
  );
  check("buttons are large enough for fingers", small === 0, small);
  await page.setViewportSize({ width: 900, height: 520 });

  // ---- dark and light
  const colours = {};
  for (const theme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme: theme });
    await page.evaluate(() => localStorage.removeItem("ruedo.theme"));
    await page.reload();
    await ready();
    check(
      `${theme} is taken from the system`,
      (await page.evaluate(() => document.documentElement.dataset.theme)) === theme,
    );
    await page.getByRole("tab", { name: "Robot" }).click();
    const shown = [".page", ".facts dt", ".facts dd", "h2", "#bar", ".pill"];
    await until(
      "(all of it is there, in its colours)",
      (selectors) =>
        selectors.every((selector) => document.querySelector(selector)) &&
        document.getAnimations().every(({ playState }) => playState === "finished"),
      shown,
    );
    colours[theme] = await page.evaluate(
      (selectors) =>
        selectors.map((selector) => {
          const element = document.querySelector(selector);
          let behind = element;
          while (getComputedStyle(behind).backgroundColor === "rgba(0, 0, 0, 0)")
            behind = behind.parentElement;
          return [
            selector,
            getComputedStyle(element).color,
            getComputedStyle(behind).backgroundColor,
          ];
        }),
      shown,
    );
    for (const [selector, front, back] of colours[theme])
      if (contrast(front, back) < 4.5)
        throw new Error(`${theme}: ${selector} is hard to read: ${front} on ${back}`);
    seen(`texts can be read in ${theme}`);
    await picture(theme);
  }
  await page.locator("#canvas").focus();
  await page.keyboard.press("t");
  check(
    "T changes to light",
    (await page.evaluate(() => document.documentElement.dataset.theme)) === "light",
  );
  await page.reload();
  await ready();
  check(
    "and it is remembered",
    (await page.evaluate(() => document.documentElement.dataset.theme)) === "light",
  );
  await page.keyboard.press("?");
  check("the keys are shown", /arrow keys/.test(await page.locator("#help").innerText()));
  // ---- dialogs capture all keys
  const open = () => page.evaluate(() => document.querySelectorAll("dialog[open]").length);
  const { step } = await tools.server();
  await page.keyboard.down("KeyW");
  for (const key of [".", "r", "2", "n", " "]) await page.keyboard.press(key);
  await page.keyboard.up("KeyW");
  check(
    "no key acts behind a dialog",
    (await page.evaluate(
      () =>
        document.getElementById("readout").textContent === "" &&
        window.ruedo.page.now.mode === "orbit" &&
        !window.ruedo.page.now.paused,
    )) && (await open()) <= 1,
  );
  if ((await open()) === 0) await page.keyboard.press("?"); // space was on its button
  await page.keyboard.press("Escape");
  check("Esc closes the keys", (await open()) === 0);
  await page.locator("#canvas").focus();
  await page.keyboard.press("r");
  check(
    "a reset is asked about",
    /Reset the world/i.test(await page.locator("dialog[open]").innerText()),
  );
  await picture("reset");
  await page.keyboard.press("Escape");
  check("Esc says no", (await open()) === 0 && (await tools.server()).step > step);

  // ---- the server ends, and comes back
  expect(/WebSocket|net::ERR_|Failed to load|socket/); // its end cuts off what is under way
  seen("end the server");
  await told();
  await until(
    "it says that the server has ended",
    () => document.getElementById("notice").textContent === "The server has ended.",
  );
  await until(
    "and shows it in the bar",
    () => document.getElementById("state").textContent === "ended",
  );
  await picture("ended");
  seen("begin the server");
  await told();
  await until(
    "it comes back by itself",
    () =>
      document.getElementById("notice").hidden &&
      document.getElementById("state").textContent === "running",
  );
  await until("and says so", () => window.notes.includes("Connected again."));
  seen("kill the server");
  await told();
  await until("it says that the connection is lost", () =>
    /connection to the server is lost/.test(document.getElementById("notice")?.textContent),
  );
  await until("and that it tries again", () =>
    /Trying again/.test(document.getElementById("notice")?.textContent),
  );
  await picture("lost");
  seen("begin the server");
  await told();
  await until(
    "it comes back from that, too",
    () =>
      document.getElementById("notice").hidden &&
      document.getElementById("state").textContent === "running",
  );
  await page.locator("#canvas").focus();
  await page.keyboard.down("KeyW");
  await until(
    "and drives the new run",
    () => parseFloat(document.querySelector('[data-fact="speed"]')?.textContent) > 0.1,
  );
  await page.keyboard.up("KeyW");
  await page.keyboard.press(" ");
  await until("and pauses it", () => document.getElementById("state").textContent === "paused");
}
