// The console in a headless browser: node browser.mjs URL FOLDER SCENARIO [JSON], in a folder with
// playwright-core. The scenario is a file beside this one. Prints a line for each observation, and
// "error: ..." for each failure.
import { createRequire } from "node:module";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";

const require = createRequire(join(process.cwd(), "x.js"));
const { chromium } = require("playwright-core");
// The page's own encoder of messages.
const bundle = await require("esbuild").build({
  entryPoints: ["src/wire/lcm.ts"],
  bundle: true,
  write: false,
  preserveSymlinks: true,
  format: "esm",
});
const { encode } = await import(
  `data:text/javascript,${encodeURIComponent(bundle.outputFiles[0].text)}`
);
const kAnyBody = [...encode("name_request_t", { name: "" })];
const [url, folder, scenario, given] = process.argv.slice(2);
// Pixels are drawn in software, on a busy machine.
const kPatience_ms = Number(process.env.RUEDO_PATIENCE_S ?? 180) * 1000;
const profile = mkdtempSync(join(tmpdir(), "ruedo-browser-"));
const context = await chromium.launchPersistentContext(profile, {
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  headless: true,
  viewport: { width: 900, height: 520 },
  timeout: kPatience_ms,
  args: [
    "--no-sandbox",
    "--disable-gpu",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
  ],
});
const page = await context.newPage();
const errors = [];
let expected = null; // errors that belong to the scenario
const wrong = (text) => {
  if (!expected?.test(text)) errors.push(text);
};
page.on("console", (message) => {
  if (message.type() === "error" || /^THREE/.test(message.text())) wrong(message.text());
});
page.on("pageerror", (error) => wrong(String(error)));
// No errors: a picture that is replaced while it is being read, and a server that does not answer
// the page's heartbeat in time.
page.on("requestfailed", (request) => {
  if (!request.url().startsWith("blob:") && !request.url().endsWith("/icon.svg"))
    wrong(`${request.url()}: ${request.failure()?.errorText}`);
});
page.on("request", (request) => {
  if (
    !/^(blob|data):/.test(request.url()) &&
    request.url() !== url &&
    (url.startsWith("file:") || !request.url().startsWith(new URL(url).origin))
  )
    errors.push(`asked ${request.url()}`);
});
page.setDefaultTimeout(kPatience_ms);
// All notes that the page has shown: they disappear by themselves, maybe before they are checked.
await page.addInitScript(() => {
  window.notes = [];
  addEventListener("DOMContentLoaded", () =>
    new MutationObserver((changes) => {
      for (const change of changes)
        for (const node of change.addedNodes) window.notes.push(node.textContent);
    }).observe(document.getElementById("toasts"), { childList: true }),
  );
});

// RUEDO_PAGE=sources: the page of the current sources, though the program was built with another.
async function serveSources() {
  const { outputFiles } = await require("esbuild").build({
    entryPoints: { main: "src/main.ts" },
    outdir: "out",
    bundle: true,
    write: false,
    preserveSymlinks: true,
    format: "esm",
    target: "es2022",
  });
  for (const [ending, contentType] of [
    ["js", "text/javascript"],
    ["css", "text/css"],
  ]) {
    const body = outputFiles.find(({ path }) => path.endsWith(`.${ending}`)).text;
    await page.route(`**/main.${ending}`, (route) => route.fulfill({ contentType, body }));
  }
}

// The state that the page shows, in one line.
const shown = () =>
  page
    .evaluate(() => {
      const text = (selector) => document.querySelector(selector)?.textContent ?? "";
      const facts = [...document.querySelectorAll("[data-fact]")].map(
        (fact) => `${fact.dataset.fact} ${fact.textContent}`,
      );
      const { playback } = window.ruedo?.page.now ?? {};
      return [
        `state ${text("#state")}`,
        `clock ${text("#clock")}`,
        `${window.ruedo?.stage.frames} frames drawn`,
        ...facts,
        text("#notice"),
        ...window.notes.slice(-3),
        playback ? `playback ${JSON.stringify(playback)}` : "",
      ]
        .filter(Boolean)
        .join("; ");
    })
    .catch((error) => `no page: ${error.message.split("\n")[0]}`);

const lines = createInterface({ input: process.stdin })[Symbol.asyncIterator]();
const seen = (text) => console.log(text);
const tools = {
  page,
  url,
  seen,
  context,
  given: given ? JSON.parse(given) : null,
  expect: (pattern) => {
    expected = pattern;
  },
  // Waits for a line from the program that started this.
  told: async () => (await lines.next()).value,
  // Waits until a condition in the page holds: a function, since the page evaluates no texts. A
  // working page reaches no limit, however slow the machine.
  until: (what, test, argument) =>
    page.waitForFunction(test, argument, { timeout: kPatience_ms, polling: 100 }).then(
      () => {
        if (!what.startsWith("(")) seen(what);
      },
      async (error) => {
        throw new Error(
          `waited for: ${what}; there was: ${await shown()}${/Timeout/.test(error.message) ? "" : `; ${error.message.split("\n")[0]}`}`,
        );
      },
    ),
  check: (what, good, found = "") => {
    if (!good) throw new Error(`not so: ${what}; there was: ${found}`);
    seen(what);
  },
  picture: (name) => page.screenshot({ path: join(folder, `${name}.png`) }),
  // The number that a fact of the chosen robot begins with, once there is one.
  fact: async (name) => {
    const number = await page.waitForFunction((wanted) => {
      const text = document.querySelector(`[data-fact="${wanted}"]`)?.textContent ?? "";
      return /^-?\d/.test(text) && { value: parseFloat(text) };
    }, name);
    return (await number.jsonValue()).value;
  },
  clock: async () => parseFloat(await page.locator("#clock").innerText()),
  // The server's state: sim time in us, paused, rate.
  server: () =>
    page.evaluate(async (body) => {
      const { session } = window.ruedo,
        begun = performance.now(),
        state = session.state(await session.ask(12, new Uint8Array(body))); // GET_STATE
      return {
        utime: Number(state.utime),
        step: Number(state.step),
        paused: state.paused,
        rate: state.rate,
        asked_ms: begun,
        answered_ms: performance.now(),
      };
    }, kAnyBody),
  // Until the server says that of itself.
  serverIs: async (what, test) => {
    const end = performance.now() + kPatience_ms;
    let state = await tools.server();
    while (!test(state) && performance.now() < end) state = await tools.server();
    tools.check(what, test(state), JSON.stringify(state));
  },
  // Until a paused run is shown as it is, and nothing of it is left to draw.
  drawn: async () => {
    const { utime } = await tools.server();
    await tools.until(
      "(the last state is shown)",
      (t) => Math.abs(window.ruedo.page.now.time_s - t) < 1e-6,
      utime * 1e-6,
    );
    await page.evaluate(async (patience_ms) => {
      const { stage } = window.ruedo,
        end = performance.now() + patience_ms,
        next = () => new Promise((done) => requestAnimationFrame(done));
      for (let still = 0, was = stage.frames; still < 10; was = stage.frames) {
        if (performance.now() > end) throw new Error("the page does not stop drawing");
        await next();
        still = was === stage.frames ? still + 1 : 0;
      }
    }, kPatience_ms);
  },
  // Until the camera and the layout are at rest. They move with the page's frames, of which there
  // are few on a slow machine. further: of the first further view instead.
  still: (further = false) =>
    page.evaluate(
      async ([patience_ms, isFurther]) => {
        const { stage } = window.ruedo,
          [other] = stage.further,
          { camera } = isFurther ? other.view : stage.view,
          canvas = isFurther ? other.canvas : document.getElementById("canvas"),
          end = performance.now() + patience_ms;
        const look = () => {
          const { left, top, width, height } = canvas.getBoundingClientRect();
          camera.updateMatrixWorld(); // else it is of the last frame
          return [camera.matrixWorld.elements, camera.projectionMatrix.elements]
            .flatMap((elements) => [...elements])
            .concat(left, top, width, height)
            .map((v) => v.toFixed(3))
            .join();
        };
        for (let was = "", is = look(); is !== was;) {
          if (performance.now() > end) throw new Error("the camera did not come to rest");
          for (let i = 0; i < 3; ++i) await new Promise((next) => requestAnimationFrame(next));
          [was, is] = [is, look()];
        }
      },
      [kPatience_ms, further],
    ),
  // Where those metres are on the screen, by the page's own camera, once that is at rest.
  onScreen: async (x, y, z = 0) => {
    await tools.still();
    return page.evaluate(
      (place) => {
        const { camera } = window.ruedo.stage.view,
          { left, top, width, height } = document.getElementById("canvas").getBoundingClientRect(),
          at = camera.position
            .clone()
            .set(...place)
            .project(camera);
        return [
          Math.round(left + ((at.x + 1) / 2) * width),
          Math.round(top + ((1 - at.y) / 2) * height),
        ];
      },
      [x, y, z],
    );
  },
  ready: () =>
    tools.until(
      "(the world is drawn)",
      () =>
        window.ruedo?.page.now.world?.robots.length > 0 &&
        window.ruedo.stage.bodies.description &&
        window.ruedo.stage.frames > 1,
    ),
};
try {
  if (process.env.RUEDO_PAGE === "sources") await serveSources();
  const steps = await import(`./${scenario}.mjs`);
  expected = steps.expected ?? null; // of the page's first moments, too
  await page.goto(url, { waitUntil: "load" });
  await steps.default(tools);
} catch (error) {
  console.log(`error: ${error.message.split("\n")[0]}`);
  await page
    .screenshot({ path: join(folder, "failed.png"), timeout: 10_000 })
    .catch(() => undefined);
}
for (const error of errors) console.log(`error: ${error}`);
await context.close();
rmSync(profile, { recursive: true, force: true });
process.exit(0);
