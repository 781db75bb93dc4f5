// Searches the site as a reader does: node search.mjs ADDRESS WORDS, in a folder with
// playwright-core.
// In both colour schemes, and after a change of them by the page's button, types the words, follows
// the first result, and prints a line: scheme, found or not, the address that it leads to. Prints
// each request to another host. PICTURES is a folder for a picture of each.
import { createRequire } from "node:module";
import { join } from "node:path";

const require = createRequire(join(process.cwd(), "x.js"));
const { chromium } = require("playwright-core");
const [address, words] = process.argv.slice(2);
const host = new URL(address).host;
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"],
});
for (const [colorScheme, width, toggled] of [
  ["light", 1280, false],
  ["dark", 390, false],
  ["light", 1280, true],
]) {
  const context = await browser.newContext({ viewport: { width, height: 800 }, colorScheme });
  const page = await context.newPage();
  page.setDefaultTimeout(180_000);
  page.on("request", (request) => {
    const asked = new URL(request.url());
    if (!["data:", "blob:"].includes(asked.protocol) && asked.host !== host)
      console.log(`asked ${request.url()}`);
  });
  page.on("pageerror", (error) => console.log(`error ${error}`));
  await page.goto(address, { waitUntil: "load" });
  if (toggled) await page.locator("label[for=__palette_1]").click();
  if (width < 600) await page.locator("label.md-header__button[for=__search]").click();
  await page.locator(".md-search__input").click();
  await page.keyboard.type(words);
  const results = page.locator(".md-search-result__item");
  // Results are shown from the first letters on; those of all words have the last one.
  const last = words.split(" ").at(-1);
  await results.and(page.locator(":first-child", { hasText: new RegExp(last, "i") })).waitFor();
  const scheme = await page.evaluate(() => document.body.dataset.mdColorScheme);
  if (process.env.PICTURES)
    await page.screenshot({ path: join(process.env.PICTURES, `search-${scheme}-${width}.png`) });
  const count = await results.count();
  await results.first().locator("a").first().click();
  await page.waitForURL((url) => !url.pathname.endsWith("/index.html"));
  const there = new URL(page.url());
  console.log(`${scheme} ${count > 0} ${there.pathname} ${await page.title()}`);
  await context.close();
}
await browser.close();
