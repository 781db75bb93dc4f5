// The console in a headless browser: node browser.mjs URL FOLDER MODE, in a folder with playwright-core; MODE is "live" or
// "log". Prints a line for each thing that was seen, and "error: ..." for what went wrong.
import { createRequire } from "node:module";
import { mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const { chromium } = createRequire(join(process.cwd(), "x.js"))("playwright-core");
const [url, folder, mode] = process.argv.slice(2);
const context = await chromium.launchPersistentContext(mkdtempSync(join(tmpdir(), "ruedo-browser-")), {
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", headless: true, viewport: { width: 1366, height: 820 },
  args: ["--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage"],
});
const page = await context.newPage();
const errors = [];
page.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
page.on("pageerror", (error) => errors.push(String(error)));
// A picture that the next one replaces while it is read is no error.
page.on("requestfailed", (request) => { if (!request.url().startsWith("blob:")) errors.push(`${request.url()}: ${request.failure()?.errorText}`); });
page.on("request", (request) => { if (!request.url().startsWith(new URL(url).origin) && !request.url().startsWith("blob:")) errors.push(`asked ${request.url()}`); });
page.setDefaultTimeout(90_000);

const seen = (text) => console.log(text);
const until = (what, test) => page.waitForFunction(test, undefined, { timeout: 90_000, polling: 200 }).then(() => seen(what));
const fact = (name) => page.locator(`[data-fact="${name}"]`).innerText();
const clock = async () => parseFloat(await page.locator("#clock").innerText());

async function live() {
  await until("robots are listed", () => window.ruedo?.world?.robots.length > 0);
  await until("the scene is drawn", () => window.ruedo.stage.description && window.ruedo.stage.frames > 2);
  await until("rays have appeared", () => {
    let lines = 0;
    window.ruedo.stage.scene.traverse((o) => { if (o.isLineSegments && o.geometry.drawRange.count > 100 && Number.isFinite(o.geometry.drawRange.count)) ++lines; });
    return lines > 0;
  });
  await page.locator("canvas#canvas").focus();
  const before = parseFloat(await fact("pose"));
  await page.keyboard.down("KeyW");
  await page.waitForFunction((x) => Math.abs(parseFloat(document.querySelector('[data-fact="pose"]').textContent) - x) > 0.2, before, { timeout: 90_000 });
  await page.keyboard.up("KeyW");
  seen("the robot moved when driven");
  await until("a picture has come", () => document.querySelector("img.picture")?.naturalWidth > 0);
  await page.screenshot({ path: join(folder, "laptop.png") });
  await page.setViewportSize({ width: 900, height: 480 });    // software draws every pixel
  await page.getByRole("tab", { name: "Plots" }).click();
  await page.waitForTimeout(2500);
  await page.screenshot({ path: join(folder, "plots.png") });
  await page.getByRole("tab", { name: "Channels" }).click();
  await page.locator('tr[data-channel$="/odometry"]').first().click();
  await until("values of a channel are shown", () => /theta/.test(document.querySelector(".channels pre")?.textContent ?? ""));
  await until("rates are shown", () => [...document.querySelectorAll(".channels .number")].some((cell) => parseFloat(cell.textContent) > 1));
  await page.screenshot({ path: join(folder, "channels.png") });
  await page.locator("#pause").click();
  await until("it says that it is paused", () => document.getElementById("state").textContent === "paused");
  await page.waitForTimeout(500);
  const held = await clock();
  await page.waitForTimeout(1500);
  if (await clock() !== held) throw new Error("the clock goes on while paused");
  seen("pause holds the clock");
  const paused = await page.evaluate(() => window.ruedo.time_s);
  await page.keyboard.press(".");
  await page.waitForFunction((t) => window.ruedo.time_s > t, paused, { timeout: 20_000 }).catch(() => { throw new Error("a step does not move the clock"); });
  seen("a step moves the clock");
  await page.locator("#pause").click();
  await until("it goes on", () => document.getElementById("state").textContent === "running");
  await page.getByRole("tab", { name: "Robot" }).click();
  await page.keyboard.press("t");
  await page.setViewportSize({ width: 390, height: 844 });
  await page.waitForTimeout(2000);
  await page.screenshot({ path: join(folder, "phone.png") });
  seen(`frame cost ${(await page.evaluate(() => window.ruedo.stage.frameCost_ms)).toFixed(1)} ms`);
}

async function log() {
  await until("the time line is there", () => !document.getElementById("timeline").hidden);
  await until("robots are listed", () => window.ruedo?.world?.robots.length > 0);
  const scrub = (share) => page.evaluate((s) => {
    const slider = document.getElementById("scrub");
    slider.value = String(Number(slider.min) + s * (Number(slider.max) - Number(slider.min)));
    slider.dispatchEvent(new Event("change"));
  }, share);
  const x = () => page.evaluate(() => window.ruedo.poses.now[0]);
  await scrub(0.05);
  await page.waitForTimeout(2500);
  const early = await x(), earlyClock = await clock();
  await scrub(0.9);
  await page.waitForFunction((t) => parseFloat(document.getElementById("clock").textContent) > t + 0.5, earlyClock);
  await page.waitForTimeout(2500);
  if (Math.abs(await x() - early) < 0.05) throw new Error("scrubbing does not move the robot");
  seen("the time line scrubs");
  await page.screenshot({ path: join(folder, "log.png") });
}

try {
  const begun = performance.now();
  await page.goto(url, { waitUntil: "load" });
  seen(`loaded in ${(performance.now() - begun).toFixed(0)} ms`);
  await (mode === "log" ? log() : live());
} catch (error) {
  console.log(`error: ${error.message.split("\n")[0]}`);
  await page.screenshot({ path: join(folder, "failed.png") }).catch(() => undefined);
}
for (const error of errors) console.log(`error: ${error}`);
await context.close();
