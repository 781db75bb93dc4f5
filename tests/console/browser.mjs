// The console in a headless browser: node browser.mjs URL FOLDER SCENARIO [JSON], in a folder with playwright-core. The
// scenario is a file beside this one. Prints a line for each thing that was seen, and "error: ..." for what went wrong.
import { createRequire } from "node:module";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";

const { chromium } = createRequire(join(process.cwd(), "x.js"))("playwright-core");
const [url, folder, scenario, given] = process.argv.slice(2);
const kPatience_ms = 90_000;    // software draws every pixel, on a machine that does other things, too
const profile = mkdtempSync(join(tmpdir(), "ruedo-browser-"));
const context = await chromium.launchPersistentContext(profile, {
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", headless: true, viewport: { width: 900, height: 520 },
  args: ["--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage"],
});
const page = await context.newPage();
const errors = [];
let expected = null;    // errors that belong to the scenario
const wrong = (text) => { if (!expected?.test(text)) errors.push(text); };
page.on("console", (message) => { if (message.type() === "error") wrong(message.text()); });
page.on("pageerror", (error) => wrong(String(error)));
// A picture that the next one replaces while it is read is no error.
page.on("requestfailed", (request) => { if (!request.url().startsWith("blob:")) wrong(`${request.url()}: ${request.failure()?.errorText}`); });
page.on("request", (request) => { if (!request.url().startsWith(new URL(url).origin) && !request.url().startsWith("blob:")) errors.push(`asked ${request.url()}`); });
page.setDefaultTimeout(kPatience_ms);

const lines = createInterface({ input: process.stdin })[Symbol.asyncIterator]();
const seen = (text) => console.log(text);
const tools = {
  page, url, seen, context, given: given ? JSON.parse(given) : null,
  expect: (pattern) => { expected = pattern; },
  // Waits for a line from who started this.
  told: async () => (await lines.next()).value,
  until: (what, test, argument) => page.waitForFunction(test, argument, { timeout: kPatience_ms, polling: 100 })
    .then(() => { if (what) seen(what); }, () => { throw new Error(`never: ${what || test}`); }),
  check: (what, good, found = "") => { if (!good) throw new Error(`not so: ${what} ${found}`); seen(what); },
  picture: (name) => page.screenshot({ path: join(folder, `${name}.png`) }),
  fact: (name) => page.locator(`[data-fact="${name}"]`).innerText(),
  clock: async () => parseFloat(await page.locator("#clock").innerText()),
  ready: () => tools.until("", () => window.ruedo?.world?.robots.length > 0 && window.ruedo.stage.description && window.ruedo.stage.frames > 1),
};
try {
  await page.goto(url, { waitUntil: "load" });
  await (await import(`./${scenario}.mjs`)).default(tools);
} catch (error) {
  console.log(`error: ${error.message.split("\n")[0]}`);
  await tools.picture("failed").catch(() => undefined);
}
for (const error of errors) console.log(`error: ${error}`);
await context.close();
rmSync(profile, { recursive: true, force: true });
process.exit(0);
