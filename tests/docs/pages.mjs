// Every page of the site in a browser, on a desktop and on a phone: node pages.mjs SITE PAGE...
// Prints a line for each page that is wider than the screen, has a picture that does not load, or
// asks for anything from elsewhere. In a folder with playwright-core. PICTURES is a folder for
// pictures of all of them.
import { createRequire } from "node:module";
import { join } from "node:path";

const require = createRequire(join(process.cwd(), "x.js"));
const { chromium } = require("playwright-core");
const [site, ...pages] = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"],
});
for (const [screen, width, colorScheme] of [
  ["desktop", 1280, "light"],
  ["phone", 390, "dark"],
]) {
  const context = await browser.newContext({ viewport: { width, height: 800 }, colorScheme });
  const page = await context.newPage();
  page.setDefaultTimeout(180_000);
  page.on("request", (request) => {
    if (!/^(file|data|blob):/.test(request.url())) console.log(`asked ${request.url()}`);
  });
  for (const name of pages) {
    await page.goto(`file://${site}/${name}`, { waitUntil: "load" });
    const found = await page.evaluate(() => ({
      wider: document.documentElement.scrollWidth - document.documentElement.clientWidth,
      broken: [...document.images]
        .filter((one) => one.complete && !one.naturalWidth)
        .map((one) => one.src),
    }));
    if (found.wider > 0) console.log(`${screen} ${name}: ${found.wider} pixels too wide`);
    for (const one of found.broken) console.log(`${screen} ${name}: ${one} does not load`);
    if (process.env.PICTURES)
      await page.screenshot({
        path: join(process.env.PICTURES, `${screen}-${name.replaceAll("/", "_")}.png`),
      });
  }
  await context.close();
}
await browser.close();
